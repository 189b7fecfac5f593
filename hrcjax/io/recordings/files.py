"""Files of a folder in natural order, and text files."""

import re
from collections.abc import Iterable
from pathlib import Path

from hrcjax.lab.errors import UsageError


def natural_key(path: Path) -> list[tuple[int, int, str]]:
    """Sort key of the natural order: 2.png before 10.png."""
    words = re.split(r"([0-9]+)", path.name.lower())
    return [(1, int(word), word) if i % 2 else (0, 0, word) for i, word in enumerate(words)]


def files_with(folder: Path, suffixes: Iterable[str]) -> list[Path]:
    """Files of `folder` with one of `suffixes` (lower case, with the dot), in natural order, without hidden files."""
    wanted = set(suffixes)
    found = (p for p in folder.iterdir() if p.suffix.lower() in wanted and not p.name.startswith(".") and p.is_file())
    return sorted(found, key=natural_key)


def text_lines(path: Path, accepted: str) -> list[tuple[int, str]]:
    """Line number and text of each line that is neither empty nor a comment (#).

    Raises:
        UsageError: missing or not a text file; the message ends with `accepted`.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise UsageError(f"{path} is missing: accepted is {accepted}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} cannot be read ({type(error).__name__}): accepted is {accepted}") from None
    lines = ((number, line.strip()) for number, line in enumerate(text.splitlines(), 1))
    return [(number, line) for number, line in lines if line and not line.startswith("#")]
