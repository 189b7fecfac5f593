"""Unit and up axis of a recorded body, inferred from its size and its posture."""

from collections.abc import Mapping
from pathlib import PurePath

import numpy as np

from hrcjax.io.motions.spec import AXES, UNITS
from hrcjax.lab.errors import UsageError
from hrcjax.typing import Float

Points = Mapping[str, Float[np.ndarray, "frame 3"]]
"""Joint of a person -> its positions."""

FOUND_UNITS = {**UNITS, "1/0.45 inch (CMU)": 0.0254 / 0.45}
"""Candidate units [m]; the last is that of the CMU motion capture database (mocap.cs.cmu.edu, its FAQ)."""
SIZE = (0.72, 1.5)
"""Smallest and largest length of trunk plus one arm: statures of 1.2 to 2.4 m. Units differ by more than the ratio of the
two, so at most one fits [m]."""
SEGMENTS = (
    (("hip", "neck"), (0.25, 0.85)),
    (("neck", "head"), (0.02, 0.45)),
    *(((f"{side}_upper_arm", f"{side}_forearm"), (0.15, 0.5)) for side in ("left", "right")),
    *(((f"{side}_forearm", f"{side}_hand"), (0.12, 0.45)) for side in ("left", "right")),
)
"""Joints, and the smallest and largest distance between them in a person [m]."""
CLEAR = 0.75
"""Least component of a unit direction along an axis to count as that axis: within 41 degrees [1]."""
LEANING = 0.3
"""Least component of the body's direction along the up axis: a person at work leans forward by up to 72 degrees [1]."""


def _last(name: str) -> str:
    return PurePath(name).name


def _length(points: Points, a: str, b: str) -> float:
    return float(np.median(np.linalg.norm(points[b] - points[a], axis=-1)))


def find_unit(points: Points, name: str) -> tuple[str, float]:
    """The unit in which the body has human size, and its length [m].

    Args:
        points: in the file's unit.
        name: of the file, for messages.

    Raises:
        UsageError: no unit fits.
    """
    arms = [_length(points, *pair) for pair, _ in SEGMENTS[2:]]
    size = _length(points, "hip", "neck") + sum(arms) / 2
    least, greatest = SIZE
    fits = [(unit, metres) for unit, metres in FOUND_UNITS.items() if least <= size * metres <= greatest]
    if len(fits) != 1:
        raise UsageError(
            f"{name}: hip to neck plus one arm is {size:.4g} of the file's units, which is no human size in any of "
            f"{', '.join(FOUND_UNITS)}: give the unit as in {_last(name)},unit=cm"
        )
    return fits[0]


def check_size(points: Points, name: str) -> None:
    """Refuses a body without human proportions.

    Args:
        points: positions of the joints [m].

    Raises:
        UsageError: names the two joints, their distance, and what is accepted.
    """
    for (a, b), (least, greatest) in SEGMENTS:
        length = _length(points, a, b)
        if not least <= length <= greatest:
            raise UsageError(
                f"{name}: {a} to {b} measures {length:.3g} m, accepted is {least:g} to {greatest:g} m: give the unit "
                f"({_last(name)},unit=cm) or the right joints ({_last(name)},names=FILE.toml)"
            )


def _direction(points: Points) -> Float[np.ndarray, "3"]:
    """Median direction from hip to neck, and from the feet, if known, to the head, of length 1; zeros if undefined."""
    way = points["neck"] - points["hip"]
    feet = [points[foot] for foot in ("left_foot", "right_foot") if foot in points]
    if feet:
        way = way + points["head"] - np.mean(feet, axis=0)
    along = np.median(way, axis=0)
    return along / max(float(np.linalg.norm(along)), 1e-9)


def find_up(points: Points, rest: Points, name: str) -> str:
    """The up axis of the file.

    People at work may lean all the time, so the motion alone is not sufficient. The axis of the rest pose is used if the body
    has some component along it, unless the motion points clearly along another axis along which the hip keeps its height too.

    Args:
        points: positions over time.
        rest: the rest pose, one frame; zeros if the file has none.
        name: of the file, for messages.

    Raises:
        UsageError: no axis is clearly up.
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
    """Points rotated so that y is up; never mirrored."""
    if up == "y":
        return points
    sign = -1.0 if up.startswith("-") else 1.0
    x, y, z = np.moveaxis(points, -1, 0)
    a, b, c = {"x": (y, z, x), "y": (z, x, y), "z": (x, y, z)}[up[-1]]  # c is along the axis; even permutations
    return np.stack([a, sign * c, -sign * b], axis=-1)
