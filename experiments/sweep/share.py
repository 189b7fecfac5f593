"""A sweep in several processes: the share of one of them, and the results of all."""

import json
import sys
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from hrcjax.lab.errors import UsageError
from hrcjax.sweeps.engine import Tally, chunk_slices, run_sweep
from hrcjax.sweeps.hosts import check_same
from hrcjax.sweeps.merge import all_keys, copy_chunks, merge_if_last, take_stock
from hrcjax.sweeps.shard import Shard
from hrcjax.sweeps.store import CONFIG, RunStore, open_shard

from .config import SweepConfig
from .job import Job

SHARED = ("shard", "devices", "hosts", "coordinator", "host_timeout")
OWN = ("config", "out", "by", "best", "figures", "overwrite", "merge", *SHARED)
"""Options of a merge that are its own; the others are those of the merged run."""


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def run_shard(job: Job, shard: Shard, memory: float, devices: Sequence[Any]) -> tuple[Tally, bool]:
    """Computes the share of a shard, or a host's part; then, if all others have finished, writes the results.

    Returns:
        The tally of the whole run and True; or, while chunks of others are missing or another one writes the results,
        the tally of the share and False.
    """
    chunks = len(job.problem.worlds) * len(chunk_slices(job.settings.count, job.chunk))
    what = f"{shard.kind} {shard}"
    share = None
    if shard.kind == "host":
        check_same(f"{job.mark} on {len(devices)} devices")
        _say(
            f"{what}: {chunks} chunks of up to {job.chunk} settings on {len(devices)} devices of all hosts -> {job.folder}"
        )
    else:
        share = shard.share(chunks)
        if shard.of > chunks:
            idle = f"shard {shard.of}" if shard.of == chunks + 1 else f"shards {chunks + 1} to {shard.of}"
            _say(
                f"{chunks} chunks for {shard.of} shards: nothing to do for {idle}; a smaller --memory makes more chunks"
            )
        _say(f"{what}: {len(share)} of {chunks} chunks of up to {job.chunk} settings -> {job.folder}")
    with open_shard(job.folder, job.mark, job.record, shard) as store:
        own = run_sweep(job.problem, job.settings, store, job.chunk, memory, share=share, devices=devices)
        keys = all_keys(job.problem, job.settings, job.chunk)
        missing = sum(not store.has(key) for key in keys)
        if missing:
            _say(f"{what} has finished; {missing} of {len(keys)} files of the run are not in {job.folder} yet")
            _say(f"the last {shard.kind} in this folder writes the results; folders of their own are joined by --merge")
            return own, False
        whole = merge_if_last(job.problem, job.settings, store, job.chunk, job.attrs)
        if whole is None:
            _say(f"{what} has finished; another {shard.kind} writes the results")
            return own, False
    whole.computed, whole.resumed = own.computed, whole.resumed - own.computed
    whole.compile_seconds, whole.compute_seconds = own.compile_seconds, own.compute_seconds
    return whole, True


def recorded(folder: Path, config: SweepConfig) -> SweepConfig:
    """The options of the run in a folder, with those of `config` that are a merge's own.

    Raises:
        UsageError: no run of the sweep there.
    """
    try:
        asked = json.loads((folder / CONFIG).read_text(encoding="utf-8"))["config"]
        names = {field.name for field in fields(SweepConfig)} - {*OWN, "analyse", "json", "list"}
        known = {name: asked[name] for name in names}
    except FileNotFoundError:
        raise UsageError(f"--merge: {folder} holds no run: {CONFIG} is missing") from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UsageError(f"--merge: {folder}: its {CONFIG} is damaged; run its command again") from error
    return replace(config, **{n: tuple(v) if isinstance(v, list) else v for n, v in known.items()})


def check_folders(job: Job, folders: Sequence[Path]) -> None:
    """Refuses to merge folders of other runs.

    Raises:
        UsageError: a folder holds no run, or another one; without folders, the run's own holds none.
    """
    for folder in folders or [job.folder]:
        try:
            mark = json.loads((folder / CONFIG).read_text(encoding="utf-8"))["fingerprint"]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise UsageError(f"--merge: {folder} holds no run, or its {CONFIG} is damaged") from error
        if folders and mark != job.mark:
            raise UsageError(f"--merge: {folder} holds another run than {folders[0]}, or one of other code or versions")


def collect(job: Job, store: RunStore, folders: Sequence[Path]) -> Tally:
    """The tally of a run whose chunks are in its folder or in others, from which they are copied.

    Raises:
        UsageError: chunks are missing.
        StorageError: a copy could not be written.
    """
    keys = all_keys(job.problem, job.settings, job.chunk)
    if folders:
        _say(f"{copy_chunks(folders, store, keys)} files copied from {len(folders)} folders")
    return take_stock(store, keys)
