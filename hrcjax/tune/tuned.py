"""A file of tuned parameters: a TOML table of dotted names and values, with the command that made it above."""

import tomllib
from collections.abc import Mapping
from pathlib import Path

from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.errors import UsageError, one_line

TUNED = "tuned.toml"
"""Its name in the folder of a run."""


def tuned_text(values: Mapping[str, float], above: str) -> str:
    """The file's text.

    Args:
        above: lines of comment.
    """
    lines = [f"# {line}".rstrip() for line in above.splitlines()]
    return "\n".join([*lines, "", "[parameters]", *(f'"{name}" = {float(x)!r}' for name, x in values.items())]) + "\n"


def write_tuned(path: Path, values: Mapping[str, float], above: str) -> None:
    """Writes the file, whole or not at all."""
    write_bytes(path, tuned_text(values, above).encode())


def read_tuned(place: Path, option: str) -> dict[str, float]:
    """The values of a file, or of the one in the folder of a run.

    Args:
        option: for the message.

    Raises:
        UsageError: no such file, or it has another format.
    """
    path = place / TUNED if place.is_dir() else place
    if not path.is_file():
        raise UsageError(
            f"{option} {place}: no {TUNED} there; accepted: the folder of a finished tuning, or such a file"
        )
    try:
        entries = tomllib.loads(path.read_text(encoding="utf-8")).get("parameters")
    except (OSError, ValueError) as error:
        raise UsageError(f"{option} {path}: {one_line(error)}") from error
    if not isinstance(entries, dict) or not all(type(x) in (int, float) for x in entries.values()):
        raise UsageError(f"{option} {path}: accepted is a table [parameters] of names in quotes and numbers")
    return {name: float(x) for name, x in entries.items()}
