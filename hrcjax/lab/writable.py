"""Whether a place can be written to, asked before work begins."""

import errno
import os
import tempfile
from pathlib import Path

from hrcjax.lab.atomic import TEMPORARY
from hrcjax.lab.errors import UsageError

PROBE = 64 * 1024
"""Bytes that are written on trial."""


def check_writable(folder: Path, option: str) -> None:
    """Refuses a folder that cannot be written to, or made: no right, no space, a name too long, below a file.

    Args:
        option: that names another one, such as --output.

    Raises:
        UsageError: it, or the nearest folder above that exists, is a file or takes no file.
    """
    if os.path.exists(folder) and not os.path.isdir(folder):
        raise UsageError(f"{folder} is a file, not a folder; give another {option}")
    there, missing = Path(os.path.abspath(folder)), []
    while not os.path.lexists(there) and there != there.parent:
        missing.append(there.name)
        there = there.parent
    if not there.is_dir():
        raise UsageError(f"cannot write to {folder}: {there} is no folder; give another {option}")
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
