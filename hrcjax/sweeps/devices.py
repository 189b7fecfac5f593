"""Several chunks at once on the devices of this machine or of several hosts, one on each: every device runs the program that one
alone would run, on arrays of the same shapes, so that the numbers are the same to the bit."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jax.experimental.multihost_utils import process_allgather
from jax.sharding import Mesh, NamedSharding
from jax.sharding import PartitionSpec as P

from hrcjax.lab.errors import UsageError

AXIS = "setting"


def choose_devices(count: int) -> list[Any]:
    """The first devices of this process, or of each of several hosts; 0: all accelerators, or one CPU device of each.

    Raises:
        UsageError: a host has fewer than `count` devices.
    """
    hosts: dict[int, list[Any]] = {}
    for device in jax.devices():
        hosts.setdefault(device.process_index, []).append(device)
    fewest = min(map(len, hosts.values()))
    kind = jax.default_backend()
    if count == 0:
        count = max(map(len, hosts.values())) if kind != "cpu" else 1
    elif not 0 < count <= fewest:
        more = f"; XLA_FLAGS=--xla_force_host_platform_device_count={count} divides a CPU" if kind == "cpu" else ""
        raise UsageError(f"--devices {count}: accepted is 1 to {fewest}, the number of {kind} devices here{more}")
    return [device for index in sorted(hosts) for device in hosts[index][:count]]


@dataclass(frozen=True)
class Spread:
    """Places arrays on devices, and runs a function of settings on all of them."""

    devices: tuple[Any, ...]

    @property
    def count(self) -> int:
        return len(self.devices)

    @property
    def local(self) -> list[int]:
        """Places of this process's devices among all, ascending."""
        return [i for i, device in enumerate(self.devices) if device.process_index == jax.process_index()]

    @property
    def hosts(self) -> int:
        return len({device.process_index for device in self.devices})

    @property
    def _mesh(self) -> Mesh:
        return Mesh(np.asarray(self.devices), (AXIS,))

    def groups(self, chunks: Sequence[int]) -> Iterator[list[int]]:
        """The chunks that are computed together."""
        for start in range(0, len(chunks), self.count):
            yield list(chunks[start : start + self.count])

    def place(self, tree: Any, specs: Any) -> Any:
        """The arrays of a pytree on the devices; unchanged for one.

        Args:
            specs: for each leaf, or one for all: P("setting") divides the first axis, P() copies.
        """
        if self.count == 1:
            return tree
        shardings = jax.tree.map(lambda spec: NamedSharding(self._mesh, spec), specs)
        if self.hosts == 1:
            return jax.device_put(tree, shardings)

        def put(leaf: Any, sharding: NamedSharding) -> jax.Array:
            whole = np.asarray(leaf)  # device_put would compare the hosts' values, and so wait for all
            return jax.make_array_from_callback(whole.shape, sharding, lambda index: whole[index])

        return jax.tree.map(put, tree, jax.tree.broadcast(shardings, tree))

    def fetch(self, array: jax.Array) -> np.ndarray:
        """The part of a result that this process's devices computed, in the order of `local`."""
        if self.hosts == 1:
            return np.asarray(array)
        parts = sorted(array.addressable_shards, key=lambda part: part.index[0].start)
        return np.concatenate([np.asarray(part.data) for part in parts])

    def agreed(self, missing: np.ndarray) -> np.ndarray:
        """What all hosts lack, the same on all of them; each waits for the others here.

        Args:
            missing: of the same shape on all.
        """
        return missing if self.hosts == 1 else process_allgather(missing).all(axis=0)

    def specs(self, batch: Any, defaults: Any) -> Any:
        """P("setting") for swept leaves, which have one more axis than the default, P() for the others."""
        return jax.tree.map(lambda leaf, default: P(AXIS) if np.ndim(leaf) > np.ndim(default) else P(), batch, defaults)

    def over(self, evaluate: Callable[[Any, Any], Mapping[str, Any]], specs: Any) -> Callable[[Any, Any], Any]:
        """`evaluate` of (batch, world), each device with its settings; no device waits for another within it.

        Args:
            specs: those of the batch.
        """
        if self.count == 1:
            return evaluate

        def part(batch: Any, world: Any) -> dict[str, Any]:
            return dict(evaluate(batch, world))

        return jax.shard_map(part, mesh=self._mesh, in_specs=(specs, P()), out_specs=P(AXIS), check_vma=False)
