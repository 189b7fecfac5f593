"""The folder of a measuring run: the arrays of every case, as they come."""

import contextlib
import json
import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.lab.atomic import remove_temporaries, replace_file, storage_errors, write_bytes
from hrcjax.lab.errors import UsageError
from hrcjax.lab.lock import locked
from hrcjax.lab.progress import Progress
from hrcjax.lab.run_folder import own_files
from hrcjax.lab.writable import check_writable

ABOUT, CASES, FIGURES, LOCK = "run.json", "cases", "figures", ".lock"
KNOWN = (CASES, FIGURES, LOCK, "rows.json")
"""What a run may write beside `ABOUT`."""
Case = dict[str, NDArray]
Make = Callable[[], Mapping[str, Any]]
"""Computes the arrays of a case."""


@contextlib.contextmanager
def locked_store(folder: Path, mark: str, about: Mapping[str, Any], overwrite: bool) -> Iterator["RunStore"]:
    """A `RunStore` in a folder that no other process may write to meanwhile.

    Raises:
        UsageError: as `RunStore`, or another process writes to the folder.
        StorageError: it cannot be made or locked.
    """
    check_writable(folder, "--out")
    own_files(folder, (ABOUT,), KNOWN, "run", "--out")
    with storage_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    with locked(folder / LOCK, f"another process writes to {folder}; wait for it or give another --out"):
        yield RunStore(folder, mark, about, overwrite)


class RunStore:
    """Cases by name, such as "episode/robotica-0-reach_in"."""

    def __init__(self, folder: Path, mark: str, about: Mapping[str, Any], overwrite: bool) -> None:
        """Opens or makes the folder.

        Args:
            mark: what decides the results; cases are kept only if it is the same.
            about: of the run, stored beside them.

        Raises:
            UsageError: the folder holds another run, or other files.
        """
        check_writable(folder, "--out")
        self.folder = folder
        if own_files(folder, (ABOUT,), KNOWN, "run", "--out"):
            known = json.loads((folder / ABOUT).read_text(encoding="utf-8"))
            if known.get("fingerprint") != mark:
                if not overwrite:
                    raise UsageError(
                        f"{folder} holds a run with other options or other code; give another --out, or --overwrite"
                    )
                shutil.rmtree(folder / CASES, ignore_errors=True)
        (folder / CASES).mkdir(parents=True, exist_ok=True)
        remove_temporaries(folder / CASES)
        write_bytes(folder / ABOUT, (json.dumps({"fingerprint": mark, **about}, indent=1) + "\n").encode())

    def _path(self, name: str) -> Path:
        return self.folder / CASES / f"{name.replace('/', '--')}.npz"

    def get(self, name: str) -> Case | None:
        """The arrays of a finished case; None: not finished, or damaged."""
        try:
            with np.load(self._path(name), allow_pickle=False) as file:
                return {key: file[key] for key in file.files}
        except (OSError, ValueError, EOFError, KeyError):
            return None
        except Exception as error:  # zipfile has errors of its own for a damaged file
            if type(error).__name__ == "BadZipFile":
                return None
            raise

    def put(self, name: str, arrays: Mapping[str, Any]) -> Case:
        """Stores a case, whole or not at all."""
        kept = {key: np.asarray(value) for key, value in arrays.items()}
        replace_file(self._path(name), lambda path: _save(path, kept))
        return kept

    def take(self, name: str, make: Make) -> tuple[Case, bool]:
        """A case, computed if it is not there; and whether it was computed."""
        found = self.get(name)
        return (found, False) if found is not None else (self.put(name, make()), True)


def collect(store: RunStore, wanted: Mapping[str, tuple[str, Make]]) -> dict[str, Case]:
    """All cases by name, computed as far as they are not there, with a progress bar.

    Args:
        wanted: by name, the name that a case is stored under, and what makes it.
    """
    found: dict[str, Case] = {}
    with Progress(len(wanted), unit="case") as progress:
        for name, (file, make) in wanted.items():
            found[name], computed = store.take(file, make)
            progress.advance(1, None if computed else 0.0, name)
    return found


def _save(path: Path, arrays: Case) -> None:
    with open(path, "wb") as file:
        np.savez_compressed(file, **arrays)  # pyright: ignore[reportArgumentType]  # arrays by name
