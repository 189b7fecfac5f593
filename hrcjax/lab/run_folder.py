"""The folder of a run: its default name, and what speaks against writing there, found out before the work begins."""

import contextlib
import errno
import hashlib
import os
from collections.abc import Collection
from pathlib import Path

from hrcjax.lab.atomic import TEMPORARY
from hrcjax.lab.errors import StorageError, UsageError

LONGEST = 100
"""Bytes of a folder's default name; file systems take 255."""
PROBE = 64 * 1024
"""Bytes that are written on trial."""


def folder_name(text: str) -> str:
    """A default name for a folder, cut to `LONGEST` bytes and told apart by a digest of the whole."""
    whole = os.fsencode(text.replace("/", "-"))
    if len(whole) <= LONGEST:
        return os.fsdecode(whole)
    digest = hashlib.sha256(whole).hexdigest()[:8]
    start = os.fsdecode(whole[: LONGEST - 9]).encode(errors="ignore").decode()  # no half characters
    return f"{start}-{digest}"


def check_writable(folder: Path, option: str) -> None:
    """Writes on trial into the folder, or into the one where it would be made, and leaves nothing behind.

    Args:
        option: that names the folder.

    Raises:
        UsageError: it is a file.
        StorageError: it cannot be made or written: no right, a name too long, below a file, no space.
    """
    if os.path.exists(folder) and not os.path.isdir(folder):
        raise UsageError(f"{folder} is a file, not a folder; give another {option}")
    place, missing = folder.absolute(), []
    while not os.path.lexists(place):
        missing.append(place.name)
        place = place.parent
    probe = place / f"{TEMPORARY}{os.getpid()}-probe"
    try:
        longest = os.pathconf(place, "PC_NAME_MAX")
        if any(len(os.fsencode(name)) > longest for name in missing):
            raise OSError(errno.ENAMETOOLONG, os.strerror(errno.ENAMETOOLONG))
        try:
            with open(probe, "xb") as file:
                file.write(bytes(PROBE))
                file.flush()
                os.fsync(file.fileno())
        finally:
            with contextlib.suppress(OSError):
                probe.unlink(missing_ok=True)
    except OSError as error:
        raise StorageError(f"cannot write {folder}: {error.strerror}; give another {option}") from error


def own_files(folder: Path, claims: Collection[str], known: Collection[str], what: str, option: str) -> list[str]:
    """The files of an earlier run in a folder; none if there is no folder yet.

    Args:
        claims: names of files of which each says that the folder is a run's.
        known: names of other files that a run may leave.
        what: a run, in words: "run" or "map".
        option: that names the folder.

    Raises:
        UsageError: the folder holds files that are not known and no run.
        StorageError: it cannot be read.
    """
    if not os.path.isdir(folder):
        return []
    try:
        there = sorted(name for name in os.listdir(folder) if not name.startswith(TEMPORARY))
    except OSError as error:
        raise StorageError(f"cannot read {folder}: {error.strerror}; give another {option}") from error
    own = [name for name in there if name in claims]
    strange = [name for name in there if name not in {*claims, *known}]
    if strange and not own:
        raise UsageError(f"{folder} holds other files ({strange[0]}) and no {what}; give another {option}")
    return own
