"""A file of tuned parameters: a TOML table of dotted names and values, with the command that made it above and the worlds below."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.configs import config_names, configs_folder
from hrcjax.lab.errors import UsageError, one_line

TUNED = "tuned.toml"
"""Its name in the folder of a run."""
SHIPPED = "tuned"
"""Folder of the shipped files among the named settings."""
Seen = Mapping[str, Mapping[str, str]]
"""World -> part of it -> digest."""


def tuned_text(values: Mapping[str, float], above: str, training: Seen | None = None) -> str:
    """The file's text.

    Args:
        above: lines of comment.
        training: the worlds in which the values were found.
    """
    lines = [f"# {line}".rstrip() for line in above.splitlines()]
    lines += ["", "[parameters]", *(f'"{name}" = {float(x)!r}' for name, x in values.items())]
    for world, parts in (training or {}).items():
        lines += ["", f"[training.{_quoted(world)}]", *(f'{part} = "{digest}"' for part, digest in parts.items())]
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    """A key of TOML."""
    kept = "".join(f"\\u{ord(c):04x}" if ord(c) < 0x20 or ord(c) == 0x7F else c for c in text.replace("\\", "\\\\"))
    return '"' + kept.replace('"', '\\"') + '"'


def write_tuned(path: Path, values: Mapping[str, float], above: str, training: Seen | None = None) -> None:
    """Writes the file, whole or not at all."""
    write_bytes(path, tuned_text(values, above, training).encode())


def find_tuned(place: str | Path, option: str) -> Path:
    """The file of a shipped name, of the folder of a run, or the file itself; a folder whose name is a shipped one: ./NAME.

    Raises:
        UsageError: there is none.
    """
    names, path = config_names(SHIPPED), Path(place)
    if str(place) in names:
        return configs_folder() / SHIPPED / f"{place}.toml"
    path = path / TUNED if path.is_dir() else path
    if not path.is_file():
        shipped = f", or one of {', '.join(names)}" if names else ""
        raise UsageError(
            f"{option} {place}: no {TUNED} there; accepted: the folder of a finished tuning, such a file{shipped}"
        )
    return path


def _tables(place: str | Path, option: str) -> tuple[Path, dict[str, Any]]:
    path = find_tuned(place, option)
    try:
        return path, tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UsageError(f"{option} {path}: {one_line(error)}") from error


def read_tuned(place: str | Path, option: str) -> dict[str, float]:
    """The values of a file, of the one in the folder of a run, or of a shipped one by name.

    Args:
        option: for the message.

    Raises:
        UsageError: no such file, or it has another format.
    """
    path, tables = _tables(place, option)
    entries = tables.get("parameters")
    if not isinstance(entries, dict) or not all(type(x) in (int, float) for x in entries.values()):
        raise UsageError(f"{option} {path}: accepted is a table [parameters] of names in quotes and numbers")
    return {name: float(x) for name, x in entries.items()}


def read_training(place: str | Path, option: str) -> dict[str, dict[str, str]]:
    """The worlds in which the values of a file were found; empty where it does not say.

    Raises:
        UsageError: as `read_tuned`.
    """
    worlds = _tables(place, option)[1].get("training", {})
    known = worlds.items() if isinstance(worlds, dict) else ()
    return {name: {k: str(v) for k, v in parts.items()} for name, parts in known if isinstance(parts, dict)}
