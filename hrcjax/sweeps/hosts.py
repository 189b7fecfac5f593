"""One program on several hosts: they join by `jax.distributed`, and end together."""

import hashlib
import os
import socket
import sys
import time
import traceback
from collections.abc import Callable

import jax
import numpy as np
from jax.experimental.multihost_utils import process_allgather

from hrcjax.lab.errors import UsageError, one_line
from hrcjax.sweeps.shard import Shard, parse_shard

AUTO = "auto"
NO_LIMIT = 30 * 24 * 3600
"""How long a host that has finished waits for the others, whose death it is told of [s]."""


def check_hosts(hosts: str, coordinator: str, timeout: int) -> None:
    """Refuses wrong words, before anything is started.

    Raises:
        UsageError: which, and what is accepted.
    """
    if not hosts and coordinator:
        raise UsageError(f"--coordinator {coordinator} needs --hosts I/N")
    if hosts and hosts != AUTO:
        parse_shard(hosts, "host", "--hosts")
        if not coordinator:
            raise UsageError(f"--hosts {hosts} needs --coordinator HOST:PORT, a free port of the first host")
    name, _, port = coordinator.rpartition(":")
    if coordinator and not (name and coordinator.isascii() and port.isdecimal() and 0 < int(port) < 65536):
        raise UsageError(f"--coordinator {coordinator}: accepted is HOST:PORT, for example node01:8476")
    if not 1 <= timeout <= NO_LIMIT:
        raise UsageError(f"--host-timeout {timeout}: accepted is a whole number of seconds from 1 to {NO_LIMIT}")


def join(hosts: str, coordinator: str, timeout: int) -> Shard:
    """Connects this process with those on the other hosts, before any other use of JAX; which of them it is.

    Args:
        hosts: I/N, or "auto": as the scheduler says.
        coordinator: HOST:PORT, on the first of them.
        timeout: for joining, and without a sign of life of another one, after which JAX ends this process [s].

    Raises:
        UsageError: the coordinator cannot be reached or cannot listen, no scheduler is found, hosts differ in the number of their
            devices, or these do not reach each other.
    """
    jax.config.update("jax_enable_preemption_service", False)  # it would take SIGTERM, which stops this program
    number, of = None, None
    if hosts != AUTO:
        shard = parse_shard(hosts, "host", "--hosts")
        number, of = shard.number - 1, shard.of
        _say(f"host {shard}: waits for the others at {coordinator}, at most {timeout} s")
        if shard.number == 1:
            _listen(coordinator)
        else:
            _reach(coordinator, timeout)
    try:
        jax.distributed.initialize(
            coordinator or None,
            of,
            number,
            cluster_detection_method=None if hosts == AUTO else "deactivate",
            initialization_timeout=timeout,
            heartbeat_timeout_seconds=timeout,
            shutdown_timeout_seconds=NO_LIMIT,
        )
    except ValueError as error:
        raise UsageError(
            f"--hosts {hosts}: no scheduler says who takes part ({one_line(error)}); give --hosts I/N --coordinator HOST:PORT"
        ) from error
    indices = [device.process_index for device in jax.devices()]
    counts = {indices.count(index) for index in indices}
    if len(counts) > 1:
        raise UsageError(
            f"--hosts {hosts}: hosts have {min(counts)} to {max(counts)} devices; the same number is needed"
        )
    try:
        _equal("")  # connects their devices while all are here: later, one may come minutes after another
    except jax.errors.JaxRuntimeError as error:
        raise UsageError(
            f"--hosts {hosts}: devices of different hosts do not reach each other: {one_line(error)}"
        ) from error
    shard = Shard(jax.process_index() + 1, jax.process_count(), "host")
    _say(
        f"host {shard}: joined; if another one is lost, JAX ends this one after {timeout} s, and the same commands resume"
    )
    return shard


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _listen(coordinator: str) -> None:
    """Checks that the port can be opened: where it cannot, JAX may crash."""
    try:
        with socket.create_server(("", int(coordinator.rpartition(":")[2]))):  # also if it was left a moment ago
            pass
    except OSError as error:
        raise UsageError(f"--coordinator {coordinator}: {os.strerror(error.errno or 0)}; give another port") from error


def _reach(coordinator: str, timeout: int) -> None:
    """Waits until somebody listens: where nobody does, JAX aborts."""
    name, _, port = coordinator.rpartition(":")
    begin = time.monotonic()
    while True:
        try:
            socket.create_connection((name.strip("[]"), int(port)), timeout=timeout).close()
            return
        except (OSError, UnicodeError) as error:
            if isinstance(error, UnicodeError) or time.monotonic() - begin > timeout:
                raise UsageError(
                    f"--coordinator {coordinator}: not reached within {timeout} s ({getattr(error, 'strerror', None) or one_line(error)}); "
                    "host 1 must be started, and its port be open"
                ) from error
            time.sleep(0.2)


def _equal(text: str) -> bool:
    """Whether all hosts bring the same text; each waits for the others here."""
    digest = np.frombuffer(hashlib.blake2b(text.encode(), digest_size=16).digest(), np.uint8)
    return bool((process_allgather(digest) == digest).all())


def check_same(text: str) -> None:
    """Refuses to run different sweeps on the hosts, on all of them.

    Args:
        text: what must be the same.

    Raises:
        UsageError: it differs.
    """
    if not _equal(text):
        raise UsageError("the hosts run different sweeps: options, code and versions must be the same on all")


def end_together(program: Callable[[], int]) -> int:
    """The status of a program. If it fails on this one of several hosts, the process ends here: at its usual end it would wait
    for the others, and they for it."""
    try:
        status = program()
    except BaseException:
        if not jax.distributed.is_initialized():
            raise
        traceback.print_exc()
        status = 1
    if jax.distributed.is_initialized():
        if status not in (0, 3):
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
        _say("this host is done; it waits until the others are")
    return status
