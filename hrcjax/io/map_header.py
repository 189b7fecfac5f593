"""The header of a map file: validation of layout and parameters."""

import dataclasses
import math
from typing import Any

from hrcjax.map import MapLayout, MapParams
from hrcjax.map.params import POSITIVE

KEYS = ("format", "version", "layout", "params")


def layout_of(header: dict[str, Any]) -> MapLayout:
    """The layout of a header.

    Raises:
        ValueError: an unknown or missing key, a value of the wrong type, a number that is not finite, invalid sizes.
    """
    values = _exactly("layout", header.get("layout"), tuple(field.name for field in dataclasses.fields(MapLayout)))
    made: dict[str, Any] = {}
    for name, value in values.items():
        kind = float if name in ("lower", "spacing") else int
        if name in ("lower", "shape"):
            if not (isinstance(value, list) and len(value) == 3):
                raise ValueError(f"layout.{name} {value!r} is not three numbers")
            made[name] = tuple(_number(f"layout.{name}", v, kind) for v in value)
        else:
            made[name] = _number(f"layout.{name}", value, kind)
    if not made["spacing"] > 0:
        raise ValueError(f"layout.spacing {made['spacing']:g} is not above 0")
    layout = MapLayout(**made)
    if layout.capacity != made["capacity"]:
        raise ValueError(f"layout.capacity {made['capacity']} is more than the blocks of the box")
    return layout


def params_of(header: dict[str, Any]) -> MapParams:
    """The parameters of a header.

    Raises:
        ValueError: an unknown or missing key, not a number, a number that is not finite or out of range.
    """
    values = _exactly("params", header.get("params"), tuple(field.name for field in dataclasses.fields(MapParams)))
    made = {name: _number(f"params.{name}", value, float) for name, value in values.items()}
    for name, value in made.items():
        if value < 0 or (value == 0 and name in POSITIVE):
            raise ValueError(f"params.{name} {value:g} is out of range")
    return MapParams(**made)


def check_keys(header: dict[str, Any]) -> None:
    """Refuses a header with other keys.

    Raises:
        ValueError: an unknown or missing key.
    """
    _exactly("the header", header, KEYS)


def _exactly(what: str, values: Any, names: tuple[str, ...]) -> dict[str, Any]:
    if not isinstance(values, dict):
        raise ValueError(f"{what} is missing")
    odd = sorted(set(values) ^ set(names))
    if odd:
        raise ValueError(f"{what}: {odd[0]} is {'missing' if odd[0] in names else 'not known'}")
    return values


def _number(name: str, value: Any, kind: type) -> Any:
    """A JSON number; integers are accepted as floats, booleans are not."""
    accepted = (int,) if kind is int else (int, float)
    if isinstance(value, bool) or not isinstance(value, accepted) or not math.isfinite(value):
        raise ValueError(f"{name} {value!r} is not {'an integer' if kind is int else 'a finite number'}")
    return kind(value)
