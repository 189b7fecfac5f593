"""The folder of a run: config.json, one file per finished chunk, and at the end results.nc.

Chunk files are written atomically, with the fingerprint of their run and a digest of their arrays. So a run may be killed at
any time: valid chunks are kept, all others are computed again.
"""

import contextlib
import hashlib
import io
import json
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray as xr

from hrcjax.lab.atomic import remove_temporaries, storage_errors, write_bytes
from hrcjax.lab.errors import StorageError, UsageError, one_line
from hrcjax.lab.lock import locked
from hrcjax.lab.run_folder import own_files
from hrcjax.lab.writable import check_writable
from hrcjax.sweeps.shard import Shard

CONFIG, RESULTS, CHUNKS, LOCK, LOCKS = "config.json", "results.nc", "chunks", ".lock", ".locks"
ENGINE = "h5netcdf"


def open_run(folder: str | Path) -> xr.Dataset:
    """The results of a finished run, read lazily from disk: `open_run("runs/...").score_overall.sel(zeta=5)`.

    Raises:
        UsageError: no such folder, no run in it, an unfinished or damaged run.
    """
    folder = Path(folder)
    if not (folder / CONFIG).is_file():
        raise UsageError(f"{folder} holds no run: {CONFIG} is missing")
    if not (folder / RESULTS).is_file():
        raise UsageError(f"the run in {folder} is not finished; the command that started it resumes it")
    try:
        return xr.open_dataset(folder / RESULTS, engine=ENGINE, decode_timedelta=False)
    except (OSError, ValueError, KeyError) as error:
        detail = one_line(error)
        raise UsageError(
            f"{folder / RESULTS} is damaged ({detail}); remove it and run the same command again"
        ) from error


def newest_run(root: str | Path = "runs") -> Path | None:
    """The folder under `root` of the run that finished last."""
    finished = list(Path(root).glob(f"*/{RESULTS}"))
    return max(finished, key=lambda path: path.stat().st_mtime).parent if finished else None


def _digest(arrays: Mapping[str, np.ndarray]) -> str:
    digest = hashlib.blake2b(digest_size=16)
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name}{array.dtype.str}{array.shape}".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


class RunStore:
    """The locked folder of one run. Create it with `open_store`."""

    def __init__(self, folder: Path, fingerprint: str) -> None:
        self.folder = folder
        self.fingerprint = fingerprint

    def _path(self, key: str) -> Path:
        return self.folder / CHUNKS / f"{key}.h5"

    def write(self, key: str, arrays: Mapping[str, np.ndarray]) -> None:
        """Stores arrays under a key such as "world-000-chunk-0001".

        Raises:
            StorageError: they could not be written; other chunks are kept.
        """
        memory = io.BytesIO()
        with h5py.File(memory, "w") as file:
            for name, array in arrays.items():
                file[name] = array
            file.attrs.update({"fingerprint": self.fingerprint, "key": key, "digest": _digest(arrays)})
        write_bytes(self._path(key), memory.getbuffer())

    def read(self, key: str, only: str = "") -> dict[str, np.ndarray] | None:
        """The arrays of a key; None if absent, damaged, or of another run.

        Args:
            only: read only this array of a chunk whose digest was checked before.
        """
        path = self._path(key)
        if not path.is_file():
            return None
        try:
            with h5py.File(path) as file:
                arrays = {str(name): np.asarray(file[name]) for name in ([only] if only else file)}
                attrs = dict(file.attrs)
        except Exception:  # damaged files raise errors of many types
            return None
        right = attrs.get("fingerprint") == self.fingerprint and attrs.get("key") == key
        return arrays if right and (only or attrs.get("digest") == _digest(arrays)) else None

    def has(self, key: str) -> bool:
        """Whether there is a file of this key, valid or not."""
        return self._path(key).is_file()

    def finished(self) -> xr.Dataset | None:
        """The results of this run if they have been written."""
        try:
            results = open_run(self.folder)
        except UsageError:
            return None
        if results.attrs.get("fingerprint") == self.fingerprint:
            return results
        results.close()
        return None


def _difference(old: Any, new: Any, name: str = "") -> str:
    """The first difference between two nested values, as text."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in [*old, *(k for k in new if k not in old)]:
            if old.get(key) != new.get(key):
                return _difference(old.get(key), new.get(key), f"{name}.{key}" if name else str(key))

    def shorten(value: Any) -> str:
        text = "not given" if value is None else json.dumps(value)
        return text if len(text) < 60 else text[:57] + "..."

    return f"{name} is {shorten(old)} there, {shorten(new)} here"


def _clear(folder: Path) -> None:
    """Removes a run from its folder, and no other files."""
    (folder / RESULTS).unlink(missing_ok=True)
    for name in (CHUNKS, LOCKS):
        shutil.rmtree(folder / name, ignore_errors=True)
    for figure in (folder / "figures").glob("*.png"):
        figure.unlink(missing_ok=True)
    (folder / CONFIG).unlink(missing_ok=True)


@contextlib.contextmanager
def open_store(
    folder: str | Path, fingerprint: str, record: Mapping[str, Any], overwrite: bool = False
) -> Iterator[RunStore]:
    """Creates or resumes the folder of a run, and locks it.

    Args:
        fingerprint: of everything that determines the results.
        record: content of config.json; its "identity" is compared for the message.
        overwrite: replace another run in the folder.

    Raises:
        UsageError: the folder holds another run or other files, or is locked by another process.
        StorageError: the folder cannot be created or written.
    """
    folder = _prepared(folder)
    with locked(folder / LOCK, f"another process writes to {folder}; wait for it or give another --out"):
        _admit(folder, fingerprint, record, overwrite)
        with storage_errors(folder):
            (folder / CHUNKS).mkdir(exist_ok=True)
        for place in (folder, folder / CHUNKS):
            remove_temporaries(place)
        yield RunStore(folder, fingerprint)


@contextlib.contextmanager
def open_shard(folder: str | Path, fingerprint: str, record: Mapping[str, Any], shard: Shard) -> Iterator[RunStore]:
    """As `open_store`, but other shards of the same run may be in the folder, on this machine or on others.

    Raises:
        UsageError: as `open_store`; or the same shard is running.
        StorageError: the folder cannot be created, written or locked.
    """
    folder = _prepared(folder)
    busy = f"a process that is not a {shard.kind} writes to {folder}; wait for it or give another --out"
    with locked(folder / LOCK, busy, shared=True):
        with storage_errors(folder):
            for name in (LOCKS, CHUNKS):
                (folder / name).mkdir(exist_ok=True)
        with locked(folder / LOCKS / shard.name, f"{shard.kind} {shard} runs already in {folder}"):
            with locked(folder / LOCKS / "config", "", wait=True):
                _admit(folder, fingerprint, record, overwrite=False)
            yield RunStore(folder, fingerprint)


def _prepared(folder: str | Path) -> Path:
    """The folder, created, if a run may be there."""
    folder = Path(folder)
    check_writable(folder, "--out")
    own_files(folder, {CONFIG}, {RESULTS, CHUNKS, LOCK, LOCKS, "figures"}, "run", "--out")
    with storage_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    return folder


def _admit(folder: Path, fingerprint: str, record: Mapping[str, Any], overwrite: bool) -> None:
    """Writes config.json, or checks that the existing one is of the same run."""
    if (folder / CONFIG).exists():
        try:
            old = json.loads((folder / CONFIG).read_text(encoding="utf-8"))
            same = old["fingerprint"] == fingerprint
            difference = _difference(old["identity"], record["identity"])
        except (ValueError, KeyError, TypeError):
            same, difference = False, f"its {CONFIG} is damaged"
        except OSError as error:
            raise StorageError(f"cannot read {folder / CONFIG}: {error.strerror}") from error
        if same:
            return
        if not overwrite:
            raise UsageError(f"{folder} holds another run ({difference}); give another --out, or --overwrite")
        with storage_errors(folder):
            _clear(folder)
    text = json.dumps({"fingerprint": fingerprint, **record}, indent=1) + "\n"
    write_bytes(folder / CONFIG, text.encode())
