"""Locks on files between processes; the operating system releases them when a process ends, however it ends."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from hrcjax.lab.atomic import storage_errors
from hrcjax.lab.errors import StorageError, UsageError


class TakenError(UsageError):
    """Another process holds the lock."""


@contextlib.contextmanager
def locked(file: Path, taken: str, *, shared: bool = False, wait: bool = False) -> Iterator[None]:
    """Holds a lock on a file, which is created.

    Args:
        taken: message if another process holds it.
        shared: several processes may hold it, and none that wants it alone.
        wait: until it is free.

    Raises:
        TakenError: another process holds it.
        StorageError: the file cannot be created, or its file system has no locks.
    """
    import fcntl  # here: Windows, on which the programs stop with one line, lacks it

    with storage_errors(file):
        descriptor = os.open(file, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        try:
            kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
            fcntl.flock(descriptor, kind | (0 if wait else fcntl.LOCK_NB))
        except BlockingIOError:
            raise TakenError(taken) from None
        except OSError as error:
            raise StorageError(f"cannot lock {file}: {error.strerror}; its file system must support flock") from error
        yield
    finally:
        os.close(descriptor)
