"""Checks that a folder is writable, before work begins."""

import errno
import os
import tempfile
from pathlib import Path

from hrcjax.lab.atomic import TEMPORARY
from hrcjax.lab.errors import UsageError

PROBE = 64 * 1024
"""Size of the test file [bytes]."""


def check_writable(folder: Path, option: str) -> None:
    """Refuses a folder that cannot be created or written: no permission, no space, a name too long, a parent that is a file.

    Args:
        option: the option for the folder, such as --output.

    Raises:
        UsageError: the folder, or its nearest existing parent, is a file or not writable.
    """
    if os.path.exists(folder) and not os.path.isdir(folder):
        raise UsageError(f"{folder} is a file, not a folder; give another {option}")
    there, missing = Path(os.path.abspath(folder)), []
    while not os.path.lexists(there) and there != there.parent:
        missing.append(there.name)
        there = there.parent
    if not there.is_dir():
        raise UsageError(f"cannot write to {folder}: {there} is not a folder; give another {option}")
    try:
        longest = os.pathconf(there, "PC_NAME_MAX")
        if any(len(os.fsencode(name)) > longest for name in missing):
            raise OSError(errno.ENAMETOOLONG, os.strerror(errno.ENAMETOOLONG))
        with tempfile.TemporaryFile(prefix=TEMPORARY, dir=there) as file:
            file.write(bytes(PROBE))
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise UsageError(f"cannot write to {folder}: {reason} ({there}); give another {option}") from None
