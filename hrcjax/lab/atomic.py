"""Files that are either whole or absent, whenever the process or the machine stops."""

import contextlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path

from hrcjax.lab.errors import StorageError, one_line

TEMPORARY = ".tmp-"


def sync_folder(folder: Path) -> None:
    """Makes the names in a folder durable."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def storage_errors(path: Path) -> Iterator[None]:
    """Turns a failed write into a `StorageError` that names the file and the space left."""
    try:
        yield
    except StorageError:
        raise
    except (OSError, RuntimeError) as error:  # HDF5 reports a full disk as either
        reason = error.strerror if isinstance(error, OSError) and error.strerror else one_line(error)
        raise StorageError(f"cannot write {path}: {reason}; what was finished before is kept") from error


def replace_file(path: Path, write: Callable[[Path], None]) -> None:
    """Lets `write` fill a temporary file beside `path`, makes it durable and gives it its name.

    Raises:
        StorageError: it could not be written; `path` is what it was before.
    """
    temporary = path.with_name(f"{TEMPORARY}{os.getpid()}-{path.name}")
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
    """`replace_file` for bytes at hand."""

    def write(temporary: Path) -> None:
        with open(temporary, "wb") as file:
            file.write(data)

    replace_file(path, write)


def remove_temporaries(folder: Path) -> None:
    """Removes what killed writers left behind."""
    for leftover in folder.glob(f"{TEMPORARY}*"):
        with contextlib.suppress(OSError):
            leftover.unlink()
