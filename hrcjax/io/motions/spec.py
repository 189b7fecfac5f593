"""Recorded people on a command line: a BVH file, with settings that the file does not have after commas."""

import json
import math
import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrcjax.lab.errors import UsageError, one_line

UNITS = {"mm": 0.001, "cm": 0.01, "inch": 0.0254, "ft": 0.3048, "m": 1.0}
"""Units of length [m]."""
AXES = ("x", "y", "z", "-x", "-y", "-z")
FORMS = "FILE.bvh[,unit=mm|cm|m|inch|ft|METRES][,up=x|y|z|-x|-y|-z][,names=FILE.toml]"


@dataclass(frozen=True)
class MotionSpec:
    """A motion file with the user's settings for it."""

    path: Path
    unit: float | None = None
    """Length of the file's unit [m]; None: inferred from the body's size."""
    up: str | None = None
    """The file's up axis; None: inferred from the body."""
    names: Path | None = None
    """TOML or JSON file: required joint -> its name in the motion file."""

    @property
    def files(self) -> list[Path]:
        """All files that determine the motion."""
        return [self.path] if self.names is None else [self.path, self.names]


def motion_spec(text: str) -> MotionSpec | None:
    """The motion of a command-line value; None if it is not a motion file.

    Raises:
        UsageError: a setting that is unknown, given twice or invalid.
    """
    found = re.fullmatch(r"(.*?\.bvh)((?:,\w*=.*)?)", text, re.IGNORECASE | re.DOTALL)
    if text.lower().endswith(".bvh") and (found is None or Path(text).is_file()):
        return MotionSpec(Path(text))
    if found is None:
        return None
    settings: dict[str, Any] = {}
    for part in re.split(r",(?=\w*=)", found[2])[1:]:
        key, _, value = part.partition("=")
        if key not in _READ or key in settings or not value:
            raise UsageError(f"{text}: {part!r} is unknown, empty or given twice; accepted is {FORMS}")
        settings[key] = _READ[key](text, value)
    return MotionSpec(Path(found[1]), **settings)


def _unit(text: str, value: str) -> float:
    try:
        unit = UNITS[value.lower()] if value.lower() in UNITS else float(value)
    except ValueError:
        unit = math.nan
    if not 0 < unit < math.inf:
        raise UsageError(f"{text}: unit={value}; accepted: {', '.join(UNITS)}, or the unit's length in metres")
    return unit


def _up(text: str, value: str) -> str:
    if value.lower() not in AXES:
        raise UsageError(f"{text}: up={value}; accepted: {', '.join(AXES)}")
    return value.lower()


_READ: dict[str, Callable[[str, str], Any]] = {"unit": _unit, "up": _up, "names": lambda _, value: Path(value)}


def read_names(path: Path) -> dict[str, str]:
    """Joint -> name in the motion file, from a TOML file, or a JSON file if its name ends in .json.

    Raises:
        UsageError: no such file, or not a table of strings.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
        found = json.loads(text) if path.suffix.lower() == ".json" else tomllib.loads(text)
    except (OSError, ValueError) as error:
        raise UsageError(f"names={path} cannot be read: {one_line(error)}") from error
    if not (isinstance(found, dict) and all(isinstance(name, str) for name in found.values())):
        raise UsageError(f'names={path}: accepted are lines such as left_hand = "Hand L"')
    return found


def people_of(name: str) -> list[str]:
    """The names of several people in the cell at once, joined by "+", such as "reach_in+pass_by"; a file name may contain
    a plus."""
    spec = motion_spec(name)
    return [name] if "+" not in name or (spec and spec.path.is_file()) else name.split("+")
