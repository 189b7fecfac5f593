"""One program on several hosts, here processes that meet on the loopback: the results of one process, to the bit."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from hrcjax.lab.errors import UsageError
from hrcjax.sweeps.hosts import check_hosts, join
from hrcjax.sweeps.store import open_run

TOY = Path(__file__).parents[1] / "helpers" / "toy_sweep.py"
SMALL = ["--grid", "K_att=log:0.01:0.1:4", "K_rep=lin:0.1:1:3", "zeta=2,4", "--memory", "0.5", "--no-figures"]
TWO = [*SMALL, "--scene", "robotica", "hri"]
"""Five chunks in each of two worlds."""
CHUNKS = ("world-000-chunk-00000.h5", "world-000-chunk-00002.h5")
"""The first chunks of two hosts of two devices."""
TWO_DEVICES = {"XLA_FLAGS": "--xla_force_host_platform_device_count=2"}


def free_port(among: range = range(20000, 32000)) -> int:
    """A port below those that connections take, so that nobody takes it meanwhile."""
    for port in np.random.default_rng().permutation(among).tolist():
        with socket.socket() as one:
            try:
                one.bind(("", port))
            except OSError:
                continue
            return port
    raise AssertionError("no free port")


def start(cache: Path, *options: str, **more: str) -> subprocess.Popen[str]:
    environment = {**os.environ, "JAX_PLATFORMS": "cpu", "JAX_COMPILATION_CACHE_DIR": str(cache), **more}
    words = [sys.executable, str(TOY), *TWO, *options]
    return subprocess.Popen(words, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def end(process: subprocess.Popen[str]) -> str:
    """What a process that succeeds says."""
    _, said = process.communicate(timeout=200)
    assert process.returncode == 0, said[-3000:]
    return said


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sweep by one process on one device."""
    folder = tmp_path_factory.mktemp("one")
    end(start(folder / "cache", "--out", str(folder / "whole")))
    return folder / "whole"


def same(one: Path, other: Path) -> None:
    with open_run(one) as a, open_run(other) as b:
        assert list(a.variables) == list(b.variables)
        for name in a.variables:
            np.testing.assert_array_equal(a[name].values, b[name].values, err_msg=str(name))


@pytest.mark.slow
def test_hosts_with_folders_of_their_own_of_which_the_first_is_killed_and_both_are_restarted(
    tmp_path: Path, whole: Path
) -> None:
    parts = [tmp_path / "part1", tmp_path / "part2"]
    at = f"127.0.0.1:{free_port()}"

    def both(**more: str) -> list[subprocess.Popen[str]]:
        words = [
            ["--out", str(part), "--devices", "2", "--hosts", f"{i}/2", "--coordinator", at]
            for i, part in enumerate(parts, 1)
        ]
        return [start(tmp_path / "cache", *of, **TWO_DEVICES, **more) for of in words]

    first, second = both(TOY_DELAY="1")
    begin = time.monotonic()
    while not all((part / "chunks" / name).exists() for part, name in zip(parts, CHUNKS, strict=True)):
        assert time.monotonic() - begin < 200 and first.poll() is None and second.poll() is None
        time.sleep(0.005)
    os.kill(first.pid, signal.SIGKILL)
    first.communicate()
    _, said = second.communicate(timeout=60)
    assert second.returncode != 0 and "another task died" in said and "the same commands resume" in said
    there = [sorted(path.name for path in (part / "chunks").glob("world-*-chunk-*.h5")) for part in parts]
    assert not set(there[0]) & set(there[1]) and 2 <= sum(map(len, there)) < 10
    for process in both(TOY_IDENTITY="toy"):
        said = end(process)
        assert "of 48 settings are finished already" in said and "on 4 devices of all hosts" in said
    there = [{path.name for path in (part / "chunks").glob("world-*-chunk-*.h5")} for part in parts]
    assert not there[0] & there[1] and len(there[0] | there[1]) == 10  # no chunk twice
    end(start(tmp_path / "cache", "--merge", *map(str, parts), "--out", str(tmp_path / "r")))
    same(whole, tmp_path / "r")


@pytest.mark.slow
def test_hosts_that_slurm_names_share_a_folder_and_the_last_one_writes_the_results(tmp_path: Path, whole: Path) -> None:
    port = free_port(range(65536 - 2**12, 65536))
    step = {"SLURM_JOB_ID": str(port - 65536 + 2**12), "SLURM_STEP_NODELIST": "127.0.0.1", "SLURM_NTASKS": "2"}
    words = ["--out", str(tmp_path / "r"), "--hosts", "auto"]
    ranks = [{"SLURM_PROCID": str(i), "SLURM_LOCALID": str(i)} for i in range(2)]
    said = [end(process) for process in [start(tmp_path / "cache", *words, **step, **rank) for rank in ranks]]
    assert "host 1/2: joined" in said[0] and "host 2/2: joined" in said[1]
    assert all("10 chunks of up to 5 settings on 2 devices of all hosts" in of for of in said)
    assert sum("files of the run are not in" in of or "another host writes" in of for of in said) <= 1
    same(whole, tmp_path / "r")


@pytest.mark.slow
def test_hosts_with_different_sweeps_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    at = f"127.0.0.1:{free_port()}"
    words = [["--out", str(tmp_path / "r"), "--hosts", f"{i}/2", "--coordinator", at, "--seed", str(i)] for i in (1, 2)]
    both = [start(tmp_path / "cache", *of) for of in words]
    said = "".join(process.communicate(timeout=200)[1] for process in both)
    assert "error: the hosts run different sweeps: options, code and versions must be the same on all" in said
    assert all(process.returncode != 0 for process in both) and not (tmp_path / "r").exists()


def test_a_port_in_use_gets_one_line() -> None:
    with socket.create_server(("", 0)) as taken:
        at = f"127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(UsageError, match=f"--coordinator {at}: Address already in use; give another port"):
            join("1/2", at, 1)


def test_a_coordinator_that_is_not_there_gets_one_line() -> None:
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        at = f"127.0.0.1:{closed.getsockname()[1]}"
        with pytest.raises(
            UsageError, match=f"--coordinator {at}: not reached within 1 s .Connection refused.; host 1 must"
        ):
            join("2/2", at, 1)


@pytest.mark.parametrize(
    ("hosts", "coordinator", "timeout", "message"),
    [
        ("", "node01:8476", 120, "--coordinator node01:8476 needs --hosts I/N"),
        ("1/2", "", 120, "--hosts 1/2 needs --coordinator HOST:PORT"),
        ("3/2", "node01:8476", 120, "--hosts 3/2: the first number counts from 1"),
        ("all", "node01:8476", 120, "--hosts all: accepted is I/N"),
        ("1/2", "node01", 120, "--coordinator node01: accepted is HOST:PORT"),
        ("1/2", "node01:99999", 120, "--coordinator node01:99999: accepted is HOST:PORT"),
        ("auto", "", 0, "--host-timeout 0: accepted is"),
    ],
)
def test_wrong_words_get_one_line(hosts: str, coordinator: str, timeout: int, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        check_hosts(hosts, coordinator, timeout)


def test_right_words_are_accepted() -> None:
    for hosts, coordinator in (("", ""), ("auto", ""), ("2/4", "node01:8476"), ("1/1", "[::1]:8476")):
        check_hosts(hosts, coordinator, 120)
