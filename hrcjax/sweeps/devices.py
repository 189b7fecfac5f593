"""Several chunks at once on the devices of this machine, one on each: every device runs the program that one alone would run,
on arrays of the same shapes, so that the numbers are the same to the bit."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jax.sharding import Mesh, NamedSharding
from jax.sharding import PartitionSpec as P

from hrcjax.lab.errors import UsageError

AXIS = "setting"


def choose_devices(count: int) -> list[Any]:
    """The first devices of this process; 0: all accelerators, or one CPU device.

    Raises:
        UsageError: fewer than `count` devices.
    """
    there = jax.local_devices()
    if count == 0:
        return there if jax.default_backend() != "cpu" else there[:1]
    if not 0 < count <= len(there):
        kind = jax.default_backend()
        more = f"; XLA_FLAGS=--xla_force_host_platform_device_count={count} divides a CPU" if kind == "cpu" else ""
        raise UsageError(f"--devices {count}: accepted is 1 to {len(there)}, the number of {kind} devices here{more}")
    return there[:count]


@dataclass(frozen=True)
class Spread:
    """Places arrays on devices, and runs a function of settings on all of them."""

    devices: tuple[Any, ...]

    @property
    def count(self) -> int:
        return len(self.devices)

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
        return jax.device_put(tree, jax.tree.map(lambda spec: NamedSharding(self._mesh, spec), specs))

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
