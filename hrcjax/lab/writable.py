"""Whether a place can be written to, asked before work begins."""

import os
import tempfile
from pathlib import Path

from hrcjax.lab.atomic import TEMPORARY
from hrcjax.lab.errors import UsageError


def check_writable(folder: Path, option: str) -> None:
    """Refuses a folder that cannot be written to, or made.

    Args:
        option: that names another one, such as --output.

    Raises:
        UsageError: it, or the nearest folder above that exists, is a file or takes no file.
    """
    there = Path(os.path.abspath(folder))
    while not os.path.lexists(there) and there != there.parent:
        there = there.parent
    if not there.is_dir():
        raise UsageError(f"cannot write to {folder}: {there} is no folder; give another {option}")
    try:
        with tempfile.TemporaryFile(prefix=TEMPORARY, dir=there):
            pass
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise UsageError(f"cannot write to {folder}: {reason} ({there}); give another {option}") from None
