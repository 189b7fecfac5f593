"""The folder of a run: its default name, and existing files in it."""

import hashlib
import os
from collections.abc import Collection
from pathlib import Path

from hrcjax.lab.atomic import TEMPORARY
from hrcjax.lab.errors import StorageError, UsageError

LONGEST = 100
"""Longest default name of a folder [bytes]; file systems accept 255."""


def folder_name(text: str) -> str:
    """A default name for a folder; longer than `LONGEST` bytes, it is cut and ends with a digest."""
    whole = os.fsencode(text.replace("/", "-"))
    if len(whole) <= LONGEST:
        return os.fsdecode(whole)
    digest = hashlib.sha256(whole).hexdigest()[:8]
    start = os.fsdecode(whole[: LONGEST - 9]).encode(errors="ignore").decode()  # no partial characters
    return f"{start}-{digest}"


def own_files(folder: Path, claims: Collection[str], known: Collection[str], what: str, option: str) -> list[str]:
    """The files of an earlier run in a folder; none if there is no folder.

    Args:
        claims: file names that identify the folder as one of a run.
        known: other file names that a run may write.
        what: "run" or "map", for the message.
        option: the option for the folder, for the message.

    Raises:
        UsageError: the folder holds other files and no run.
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
