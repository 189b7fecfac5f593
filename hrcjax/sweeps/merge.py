"""From chunks to results: what is there, chunks of several folders in one, and results.nc."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hrcjax.lab.atomic import remove_temporaries
from hrcjax.lab.errors import StorageError, UsageError
from hrcjax.lab.lock import TakenError, locked
from hrcjax.sweeps.dataset import write_results
from hrcjax.sweeps.engine import Tally, chunk_key, chunk_slices, count_statuses, world_key
from hrcjax.sweeps.settings import Settings
from hrcjax.sweeps.store import CHUNKS, LOCKS, RunStore
from hrcjax.sweeps.sweepable import Sweepable

SHOWN = 4
"""Missing chunks that a message names."""


def all_keys(problem: Sweepable, settings: Settings, chunk: int) -> list[str]:
    """The names of all chunks of a run and of what describes its worlds, world by world."""
    chunks = range(len(chunk_slices(settings.count, chunk)))
    keys = []
    for world in range(len(problem.worlds)):
        keys += [world_key(world)] if problem.describe is not None else []
        keys += [chunk_key(world, c) for c in chunks]
    return keys


def copy_chunks(folders: Sequence[Path], store: RunStore, keys: Sequence[str]) -> int:
    """Copies valid chunks that the store lacks from other folders of the same run; returns their number.

    Raises:
        StorageError: one could not be written.
    """
    sources = [RunStore(folder, store.fingerprint) for folder in folders]
    copied = 0
    for key in keys:
        if store.has(key) and store.read(key) is not None:
            continue
        for source in sources:
            if source.has(key) and (arrays := source.read(key)) is not None:
                store.write(key, arrays)
                copied += 1
                break
    return copied


def take_stock(store: RunStore, keys: Sequence[str]) -> Tally:
    """The tally of a run whose chunks are all there, each of them checked.

    Raises:
        UsageError: some are missing or damaged.
    """
    tally, missing = Tally(), []
    for key in keys:
        arrays = store.read(key)
        if arrays is None:
            missing.append(key)
        elif "status" in arrays:
            tally.resumed += len(arrays["status"])
            count_statuses(tally, arrays["status"])
    if missing:
        named = ", ".join(missing[:SHOWN]) + (", ..." if len(missing) > SHOWN else "")
        raise UsageError(
            f"{len(missing)} of {len(keys)} files are missing or damaged in {store.folder / CHUNKS} ({named}); run their shards "
            "again, or the command without --shard and --merge, which computes them"
        )
    return tally


def merge_results(
    problem: Sweepable, settings: Settings, store: RunStore, chunk: int, attrs: Mapping[str, Any]
) -> None:
    """Writes results.nc from chunks that were checked.

    Raises:
        StorageError: a chunk is damaged, or the file could not be written.
    """
    slices = chunk_slices(settings.count, chunk)

    def read(key: str, name: str) -> Any:
        arrays = store.read(key, only=name)
        if arrays is None or name not in arrays:
            raise StorageError(f"{key} in {store.folder} is damaged; run the same command again")
        return arrays[name]

    def chunks(world: int, name: str) -> Any:
        return ((place, read(chunk_key(world, c), name)) for c, place in enumerate(slices))

    write_results(store.folder, problem, settings, chunks, lambda world, name: read(world_key(world), name), attrs)


def merge_if_last(
    problem: Sweepable, settings: Settings, store: RunStore, chunk: int, attrs: Mapping[str, Any]
) -> Tally | None:
    """Writes results.nc of a run shared by shards if all chunks are there and it is missing; None: another shard does it now.

    Raises:
        UsageError: a chunk is damaged.
        StorageError: results.nc could not be written.
    """
    keys = all_keys(problem, settings, chunk)
    try:
        with locked(store.folder / LOCKS / "results", "another shard writes the results"):
            done = store.finished()
            tally = take_stock(store, keys)
            if done is None:
                merge_results(problem, settings, store, chunk, attrs)
                for place in (store.folder, store.folder / CHUNKS):
                    remove_temporaries(place)  # of killed shards: nobody writes any more
            else:
                done.close()
            return tally
    except TakenError:
        return None
