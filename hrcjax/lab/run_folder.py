"""The folder of a run: its default name, and what of earlier runs or of others is in it."""

import hashlib
import os
from collections.abc import Collection
from pathlib import Path

from hrcjax.lab.atomic import TEMPORARY
from hrcjax.lab.errors import StorageError, UsageError

LONGEST = 100
"""Bytes of a folder's default name; file systems take 255."""


def folder_name(text: str) -> str:
    """A default name for a folder, cut to `LONGEST` bytes and told apart by a digest of the whole."""
    whole = os.fsencode(text.replace("/", "-"))
    if len(whole) <= LONGEST:
        return os.fsdecode(whole)
    digest = hashlib.sha256(whole).hexdigest()[:8]
    start = os.fsdecode(whole[: LONGEST - 9]).encode(errors="ignore").decode()  # no half characters
    return f"{start}-{digest}"


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
