"""The optimiser, and its states on disk; optax and orbax are wanted by this program alone."""

import logging
import shutil
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

import jax
import numpy as np

from hrcjax.lab.atomic import storage_errors
from hrcjax.lab.errors import UsageError, one_line
from hrcjax.tune.step import Optimiser, TuneState

try:
    import optax
    import orbax.checkpoint as ocp
except ImportError as missing:
    raise UsageError(f"tuning needs {missing.name}: pip install 'hrcjax[tune]'") from missing

KEPT = 2
"""Checkpoints that are kept, the newest ones."""
History = dict[str, np.ndarray]
"""Name -> (step, start, ...)."""


def make_optimiser(rate: float, clip: float) -> Optimiser:
    """Adam, with gradients shortened to a norm of `clip`."""
    return optax.chain(optax.clip_by_global_norm(clip), optax.adam(rate))


def optimiser_versions() -> dict[str, str]:
    """Versions of the packages that decide steps and checkpoints."""
    return {name: metadata.version(name) for name in ("optax", "orbax-checkpoint")}


def _leaves(state: TuneState) -> list[Any]:
    """Every array of a state, the key as its numbers."""
    plain = jax.tree.map(
        lambda x: jax.random.key_data(x) if jax.dtypes.issubdtype(x.dtype, jax.dtypes.prng_key) else x, state
    )
    return jax.tree.leaves(plain)


class Checkpoints:
    """States and history of a run by step, each whole or absent."""

    def __init__(self, folder: Path) -> None:
        logging.getLogger("absl").setLevel(logging.ERROR)
        options = ocp.CheckpointManagerOptions(max_to_keep=KEPT, enable_async_checkpointing=False)
        self.folder = folder.absolute()
        self.manager = ocp.CheckpointManager(self.folder, options=options)

    def save(self, state: TuneState, history: History) -> None:
        """Stores the state after a step; once."""
        step = int(state.step)
        if step in self.manager.all_steps():
            return
        arrays = {f"{k:03d}": np.asarray(leaf) for k, leaf in enumerate(_leaves(state))}
        with storage_errors(self.folder):
            self.manager.save(step, args=ocp.args.StandardSave({"state": arrays, "history": history}))  # pyright: ignore[reportCallIssue]
            self.manager.wait_until_finished()

    def newest(self, like: TuneState) -> tuple[TuneState, History] | None:
        """The newest state that can be read, and its history; None: there is none. Damaged ones are moved aside, and named.

        Args:
            like: a state of the same shapes.
        """
        for step in sorted(self.manager.all_steps(), reverse=True):
            try:
                found: Any = self.manager.restore(step, args=ocp.args.StandardRestore())  # pyright: ignore[reportCallIssue]
                arrays = [found["state"][name] for name in sorted(found["state"])]
                return _state_of(arrays, like), dict(found["history"])
            except MemoryError:
                raise
            except Exception as error:  # orbax has many errors for damaged files
                place = self.folder.parent / f"damaged-step-{step}"
                shutil.rmtree(place, ignore_errors=True)
                with storage_errors(place):
                    (self.folder / str(step)).rename(place)
                print(
                    f"warning: the state after step {step} cannot be read ({one_line(error)}): {place}",
                    file=sys.stderr,
                    flush=True,
                )
                self.manager.reload()
        return None

    def close(self) -> None:
        """Ends the manager."""
        self.manager.close()


def _state_of(arrays: list[Any], like: TuneState) -> TuneState:
    leaves, shape = jax.tree.flatten(like)
    if len(arrays) != len(leaves):
        raise ValueError("a checkpoint of other arrays")

    def one(array: Any, leaf: Any) -> Any:
        if jax.dtypes.issubdtype(leaf.dtype, jax.dtypes.prng_key):
            return jax.random.wrap_key_data(jax.numpy.asarray(array))
        if array.shape != leaf.shape or array.dtype != leaf.dtype:
            raise ValueError("a checkpoint of other arrays")
        return jax.numpy.asarray(array)

    return jax.tree.unflatten(shape, [one(a, leaf) for a, leaf in zip(arrays, leaves, strict=True)])
