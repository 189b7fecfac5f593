"""Atomic file writes: a file is complete or absent, also after a crash."""

import contextlib
import os
import secrets
from collections.abc import Callable, Iterator
from pathlib import Path

from hrcjax.lab.errors import StorageError, one_line

TEMPORARY = ".tmp-"


def sync_folder(folder: Path) -> None:
    """Makes the directory entries of a folder durable (fsync)."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def storage_errors(path: Path) -> Iterator[None]:
    """Turns a failed write into a `StorageError` with the file and the free space."""
    try:
        yield
    except StorageError:
        raise
    except (OSError, RuntimeError) as error:  # HDF5 reports a full disk as either
        reason = error.strerror if isinstance(error, OSError) and error.strerror else one_line(error)
        raise StorageError(f"cannot write {path}: {reason}; results finished before are kept") from error


def replace_file(path: Path, write: Callable[[Path], None]) -> None:
    """Lets `write` fill a temporary file beside `path`, syncs it and renames it to `path`.

    Raises:
        StorageError: it could not be written; `path` is unchanged.
    """
    temporary = path.with_name(f"{TEMPORARY}{secrets.token_hex(6)}-{path.name}")  # process ids repeat between machines
    with storage_errors(path):
        try:
            write(temporary)
            with open(temporary, "rb+") as file:
                os.fsync(file.fileno())
            os.replace(temporary, path)
            sync_folder(path.parent)
        except BaseException:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
            raise


def write_bytes(path: Path, data: bytes | memoryview) -> None:
    """`replace_file` with given bytes."""

    def write(temporary: Path) -> None:
        with open(temporary, "wb") as file:
            file.write(data)

    replace_file(path, write)


def remove_temporaries(folder: Path) -> None:
    """Removes temporary files of interrupted writers."""
    for leftover in folder.glob(f"{TEMPORARY}*"):
        with contextlib.suppress(OSError):
            leftover.unlink()
