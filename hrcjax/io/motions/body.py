"""Unit and up axis of a recorded body, found from its size and from where its head is."""

from collections.abc import Mapping
from pathlib import PurePath

import numpy as np

from hrcjax.io.motions.spec import AXES, UNITS
from hrcjax.lab.errors import UsageError
from hrcjax.typing import Float

Points = Mapping[str, Float[np.ndarray, "frame 3"]]
"""Joint of a person -> its positions."""

FOUND_UNITS = {**UNITS, "1/0.45 inch (CMU)": 0.0254 / 0.45}
"""Units that are looked for [m]; the last is that of the CMU motion capture database (mocap.cs.cmu.edu, its FAQ)."""
SIZE = (0.72, 1.5)
"""Least and greatest length of trunk and one arm together: statures of 1.2 to 2.4 m. Units differ by more than the ratio
of the two, so at most one fits [m]."""
SEGMENTS = (
    (("hip", "neck"), (0.25, 0.85)),
    (("neck", "head"), (0.02, 0.45)),
    *(((f"{side}_upper_arm", f"{side}_forearm"), (0.15, 0.5)) for side in ("left", "right")),
    *(((f"{side}_forearm", f"{side}_hand"), (0.12, 0.45)) for side in ("left", "right")),
)
"""Joints, and the least and greatest distance between them in a person [m]."""
CLEAR = 0.75
"""Share of a direction along an axis from which on it is that axis: within 41 degrees."""
LEANING = 0.3
"""Least share of the body's direction along the up axis of a person at work, who leans forward by up to 72 degrees."""


def _last(name: str) -> str:
    return PurePath(name).name


def _length(points: Points, a: str, b: str) -> float:
    return float(np.median(np.linalg.norm(points[b] - points[a], axis=-1)))


def find_unit(points: Points, name: str) -> tuple[str, float]:
    """The unit in which the body is of human size, and its length [m].

    Args:
        points: in the file's unit.
        name: of the file, for messages.

    Raises:
        UsageError: none.
    """
    arms = [_length(points, *pair) for pair, _ in SEGMENTS[2:]]
    size = _length(points, "hip", "neck") + sum(arms) / 2
    least, greatest = SIZE
    fits = [(unit, metres) for unit, metres in FOUND_UNITS.items() if least <= size * metres <= greatest]
    if len(fits) != 1:
        raise UsageError(
            f"{name}: hip to neck and one arm measure {size:.4g} of the file's units, which is a person in none of "
            f"{', '.join(FOUND_UNITS)}: give the unit as in {_last(name)},unit=cm"
        )
    return fits[0]


def check_size(points: Points, name: str) -> None:
    """Refuses a body whose parts are not those of a person.

    Args:
        points: of the joints [m].

    Raises:
        UsageError: names the two joints, what they measure, and what is accepted.
    """
    for (a, b), (least, greatest) in SEGMENTS:
        length = _length(points, a, b)
        if not least <= length <= greatest:
            raise UsageError(
                f"{name}: {a} to {b} measures {length:.3g} m, accepted is {least:g} to {greatest:g} m: give the unit "
                f"({_last(name)},unit=cm) or the right joints ({_last(name)},names=FILE.toml)"
            )


def _direction(points: Points) -> Float[np.ndarray, "3"]:
    """From hip to neck, and from the feet, if known, to the head: the median, of length 1; zeros if it has none."""
    way = points["neck"] - points["hip"]
    feet = [points[foot] for foot in ("left_foot", "right_foot") if foot in points]
    if feet:
        way = way + points["head"] - np.mean(feet, axis=0)
    along = np.median(way, axis=0)
    return along / max(float(np.linalg.norm(along)), 1e-9)


def find_up(points: Points, rest: Points, name: str) -> str:
    """The axis of the file along which the body stands.

    People at work may lean all the time, so the motion alone does not tell. The axis of the rest pose counts if the body
    has some share of it, unless the motion points clearly along another axis along which the hip keeps its height as well.

    Args:
        points: the motion.
        rest: the rest pose, one frame; zeros where the file has none.
        name: of the file, for messages.

    Raises:
        UsageError: no axis stands out.
    """
    moving, resting = _direction(points), _direction(rest)
    best, first = int(np.argmax(np.abs(moving))), int(np.argmax(np.abs(resting)))
    low, high = np.percentile(points["hip"], (5, 95), axis=0)
    agrees = abs(resting[first]) >= CLEAR and moving[first] * np.sign(resting[first]) >= LEANING
    steadier = high[first] - low[first] < 0.5 * (high[best] - low[best])
    if agrees and (steadier or abs(moving[best]) < CLEAR):
        best = first
    elif abs(moving[best]) < CLEAR:
        shown = ", ".join(f"{v:.2f}" for v in moving)
        raise UsageError(
            f"{name}: the body points along ({shown}), no axis is clearly up: give it as in {_last(name)},up=y"
        )
    return AXES[best + (3 if moving[best] < 0 else 0)]


def turned_up(points: Float[np.ndarray, "*n 3"], up: str) -> Float[np.ndarray, "*n 3"]:
    """Points turned so that y is up; never mirrored."""
    if up == "y":
        return points
    sign = -1.0 if up.startswith("-") else 1.0
    x, y, z = np.moveaxis(points, -1, 0)
    a, b, c = {"x": (y, z, x), "y": (z, x, y), "z": (x, y, z)}[up[-1]]  # c is along the axis; even permutations
    return np.stack([a, sign * c, -sign * b], axis=-1)
