"""Runs all settings in all worlds: one compiled program, chunk after chunk, each stored when finished."""

import math
import shutil
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import PartitionSpec as P

from hrcjax.lab.errors import StorageError, UsageError, one_line
from hrcjax.lab.parameters import batch_params
from hrcjax.lab.progress import Progress, duration
from hrcjax.lab.traced import traced
from hrcjax.numerics import unrolled_options
from hrcjax.sweeps.devices import Spread, choose_devices
from hrcjax.sweeps.settings import Settings
from hrcjax.sweeps.store import RunStore
from hrcjax.sweeps.sweepable import NOT_FINITE, Sweepable

MEGABYTE = 1_000_000


@dataclass
class Tally:
    """Counts and times of a run."""

    computed: int = 0
    """Settings computed by this process."""
    resumed: int = 0
    """Settings that were finished already."""
    compile_seconds: float = 0.0
    compute_seconds: float = 0.0
    not_finite: int = 0
    """Settings of the whole run with status NOT_FINITE."""
    statuses: dict[int, int] = field(default_factory=dict)
    """Status -> number of settings of the whole run."""


def chunk_size(settings: int, memory: float, bytes_per_setting: int) -> int:
    """Settings per chunk, so that a chunk fits `memory` [MB] and all chunks have about the same size.

    Raises:
        UsageError: a single setting does not fit.
    """
    most = int(memory * MEGABYTE // max(1, bytes_per_setting))
    if most < 1:
        raise UsageError(f"--memory {memory:g}: one setting needs about {bytes_per_setting / MEGABYTE:.3g} MB")
    return math.ceil(settings / math.ceil(settings / most))


def chunk_slices(settings: int, chunk: int) -> list[slice]:
    """The settings of each chunk."""
    return [slice(start, min(start + chunk, settings)) for start in range(0, settings, chunk)]


def chunk_key(world: int, chunk: int) -> str:
    """Name of a chunk in the store."""
    return f"world-{world:03d}-chunk-{chunk:05d}"


def world_key(world: int) -> str:
    """Name of a world's descriptive arrays in the store."""
    return f"world-{world:03d}-about"


class _Program:
    """`evaluate`, compiled at its first call, for one shape of settings and worlds."""

    def __init__(self, problem: Sweepable, progress: Progress, memory: float, spread: Spread) -> None:
        self.problem, self.progress, self.memory, self.spread = problem, progress, memory, spread
        self.compiled: Any = None
        self.seconds = 0.0

    def prepare(self, batch: Any, world: Any, chunk: int, enough: Callable[[Mapping[str, Any]], None]) -> None:
        """Compiles, once. Raises ValueError if `evaluate` does not return its declared outputs.

        Args:
            enough: raises if there is not enough disk space for results of these shapes and types.
        """
        if self.compiled is not None:
            return
        begin = time.monotonic()
        self.progress.say("compiling (up to a minute the first time)")
        evaluate = self.spread.over(self.problem.evaluate, self.spread.specs(batch, self.problem.params))
        identity, count = self.problem.identity, self.spread.count
        if identity is not None and count > 1:
            identity = f"{identity} on {count} devices"
        program = traced(evaluate, (batch, world), identity)
        self._check(program.out_info, chunk)
        enough(program.out_info)
        self.compiled = program.lower().compile(compiler_options=unrolled_options())
        self.seconds = time.monotonic() - begin
        self.progress.say(f"compiled in {duration(self.seconds)}{self._memory()}")

    def _memory(self) -> str:
        try:
            sizes = self.compiled.memory_analysis()
            used = (sizes.temp_size_in_bytes + sizes.argument_size_in_bytes + sizes.output_size_in_bytes) / MEGABYTE
        except (AttributeError, NotImplementedError, jax.errors.JaxRuntimeError):
            return ""
        more = f", more than the {self.memory:g} MB of --memory" if used > self.memory else ""
        return f"; a chunk takes {used:.0f} MB{more}"

    def _check(self, out: Mapping[str, Any], chunk: int) -> None:
        problem = self.problem
        wanted = {**dict.fromkeys(problem.metrics, 1), **{name: 1 + len(t[0]) for name, t in problem.traces.items()}}
        missing, extra = set(wanted) - set(out), set(out) - set(wanted) - {"status"}
        if missing or extra:
            raise ValueError(f"evaluate lacks {sorted(missing)} and has undeclared {sorted(extra)}")
        for name, ndim in wanted.items():
            if len(out[name].shape) != ndim or out[name].shape[0] != chunk:
                raise ValueError(
                    f"evaluate returns {name} of shape {out[name].shape}; needed are {ndim} dims, the first of size {chunk}"
                )

    def __call__(self, batch: Any, world: Any) -> dict[str, np.ndarray]:
        try:
            out = self.compiled(*jax.tree.leaves((batch, world)))
        except TypeError as error:
            raise ValueError(f"worlds differ in shape or type: {one_line(error)}") from error
        return {name: self.spread.fetch(array) for name, array in jax.block_until_ready(dict(out)).items()}


def flag_not_finite(outcome: Mapping[str, np.ndarray], open_ended: frozenset[str] = frozenset()) -> np.ndarray:
    """Status of each setting: NOT_FINITE where a result is infinite or NaN, else the program's status, else 0."""
    count = len(next(iter(outcome.values())))
    status = np.array(outcome.get("status", np.zeros(count)), np.int32)
    for name, array in outcome.items():
        if np.issubdtype(array.dtype, np.floating) and name not in open_ended:
            status[~np.isfinite(array).reshape(count, -1).all(axis=1)] = NOT_FINITE
    return status


def _values(settings: Settings, places: Sequence[slice], chunk: int) -> dict[str, np.ndarray]:
    """The values of some chunks, one after the other; a short chunk is padded with its last setting."""
    at = [np.minimum(np.arange(place.start, place.start + chunk), place.stop - 1) for place in places]
    return {name: column[np.concatenate(at)] for name, column in settings.values.items()}


def _enough_disk(store: RunStore, outcome: Mapping[str, Any], to_do: int, total: int) -> None:
    """Raises StorageError if the remaining chunks and the results do not fit on the disk.

    Args:
        outcome: shapes and types of the results of a chunk.
        to_do: settings to be computed.
        total: settings in the results.
    """
    each = sum(math.prod(array.shape[1:]) * array.dtype.itemsize for array in outcome.values())
    need, free = each * (to_do + total), shutil.disk_usage(store.folder).free
    if need > free:
        text = f"{need / MEGABYTE:.0f} MB are needed in {store.folder}, {free / MEGABYTE:.0f} MB are free"
        raise StorageError(f"{text}; choose another --out or fewer settings")


def run_sweep(
    problem: Sweepable,
    settings: Settings,
    store: RunStore,
    chunk: int,
    memory: float = 1000.0,
    dtype: Any = jnp.float32,
    stream: Any = None,
    share: Collection[int] | None = None,
    devices: Sequence[Any] = (),
) -> Tally:
    """Computes the chunks that are missing in the store.

    Chunks always have the same size and the same settings, so that a resumed run gives the same results, and several
    processes the same as one. Of several hosts, each stores what its devices compute, and counts what is in its store.

    Args:
        share: only the chunks of these indices, counted over all worlds; the tally and the disk space are theirs. None: all.
        devices: each computes a chunk at a time; empty: JAX's first one. Of several hosts: the same ones on all, each of which
            calls this function with the same arguments; chunks that any of them has stored are not computed again.

    Raises:
        UsageError: a world cannot be built.
        StorageError: a chunk cannot be stored; those before it are kept.
        ValueError: `evaluate` does not return its declared outputs, or worlds differ in shape.
    """
    slices = chunk_slices(settings.count, chunk)
    spread = Spread(tuple(devices or choose_devices(1)))
    tally = Tally()
    missing = np.zeros((len(problem.worlds), len(slices)), bool)
    sizes = np.array([place.stop - place.start for place in slices])
    total, unknown = 0, set()
    for w in range(len(problem.worlds)):
        ours = [c for c in range(len(slices)) if share is None or w * len(slices) + c in share]
        if ours and problem.describe is not None and store.read(world_key(w)) is None:
            unknown.add(w)
        for c in ours:
            total += int(sizes[c])
            finished = store.read(chunk_key(w, c))
            if finished is None:
                missing[w, c] = True
            else:
                tally.resumed += int(sizes[c])
                count_statuses(tally, finished["status"])
    missing = spread.agreed(missing)
    todo = {w: np.flatnonzero(of).tolist() for w, of in enumerate(missing) if w in unknown or of.any()}
    left = int((missing * sizes).sum())
    need = math.ceil(left / spread.hosts), total if share is None and spread.hosts == 1 else 0
    with Progress(total, total - left, stream) as progress:
        if left < total:
            progress.say(f"{total - left} of {total} settings are finished already")
        program = _Program(problem, progress, memory, spread)
        for w, chunks in todo.items():
            _run_world(problem, settings, store, slices, w, chunks, chunk, program, progress, tally, dtype, need)
        tally.compile_seconds = program.seconds
        tally.compute_seconds = progress.busy
    return tally


def count_statuses(tally: Tally, status: np.ndarray) -> None:
    """Adds the statuses of a chunk."""
    for code, times in zip(*np.unique(status, return_counts=True), strict=True):
        tally.statuses[int(code)] = tally.statuses.get(int(code), 0) + int(times)
    tally.not_finite = tally.statuses.get(NOT_FINITE, 0)


def _build_world(problem: Sweepable, w: int, progress: Progress) -> Any:
    labels, build = problem.worlds[w]
    name = f"scene {labels['scene']}, person {labels['person']}, seed {labels['seed']}"
    progress.say(f"{name}: building")
    begin = time.monotonic()
    try:
        world = build()
    except (ValueError, OSError) as error:
        raise UsageError(f"scene {labels['scene']}, person {labels['person']}: {one_line(error)}") from error
    progress.say(f"{name}: built in {duration(time.monotonic() - begin)}")
    return world


def _run_world(
    problem: Sweepable,
    settings: Settings,
    store: RunStore,
    slices: list[slice],
    w: int,
    missing: list[int],
    chunk: int,
    program: _Program,
    progress: Progress,
    tally: Tally,
    dtype: Any,
    need: tuple[int, int],
) -> None:
    world = _build_world(problem, w, progress)
    if problem.describe is not None and store.read(world_key(w)) is None:  # another shard may have written it
        store.write(world_key(w), {name: np.asarray(array) for name, array in problem.describe(world).items()})
    spread = program.spread
    world = spread.place(world, P())
    for group in spread.groups(missing):
        places = [slices[c] for c in group]
        filled = places + places[-1:] * (spread.count - len(places))  # for devices without a chunk
        batch = batch_params(problem.params, _values(settings, filled, chunk), dtype)
        batch = spread.place(batch, spread.specs(batch, problem.params))
        program.prepare(batch, world, chunk * spread.count, lambda out: _enough_disk(store, out, *need))
        begin = time.monotonic()
        outcome = program(batch, world)
        for row, i in enumerate(spread.local):
            if i >= len(group):
                break
            count = places[i].stop - places[i].start
            kept = {name: array[row * chunk : row * chunk + count] for name, array in outcome.items()}
            kept["status"] = flag_not_finite(kept, problem.open_ended)
            store.write(chunk_key(w, group[i]), kept)
            count_statuses(tally, kept["status"])
            tally.computed += count
        progress.advance(sum(place.stop - place.start for place in places), time.monotonic() - begin)
