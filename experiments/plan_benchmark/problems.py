"""The problems: a UR5 among boxes, with the reference path of each."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.lab.errors import UsageError
from hrcjax.plan.rounded_boxes import RoundedBoxes
from hrcjax.robot import Arm, load_arm

THINNER = 0.01
"""The arm's capsules are this much thinner than the project's: with those, every sixth reference path collides [m]."""
TIGHT = (("forearm", "wrist 2"),)
"""Capsules that overlap in half of the reference paths, by up to 5 mm, and so do not count."""
KEYS = ("start", "goal", "box_center", "box_half_extents", "n_boxes", "path", "path_offset")


@dataclass(frozen=True)
class Problems:
    """Some problems."""

    start: NDArray
    """(problem joint) [rad]"""
    goal: NDArray
    """(problem joint) [rad]"""
    center: NDArray
    """(problem box 3) of the boxes [m]"""
    half: NDArray
    """(problem box 3) half extents [m]"""
    boxes: NDArray
    """(problem) number of boxes that exist"""
    reference: tuple[NDArray, ...]
    """(waypoint joint) of a free path, each [rad]"""
    grown: NDArray | None = None
    """(problem box) radius by which boxes are grown; None: by nothing [m]"""
    rotation: NDArray | None = None
    """(problem box 3 3) axes of the boxes as columns; None: those of the world"""

    def __len__(self) -> int:
        return len(self.start)

    @property
    def radius(self) -> NDArray:
        """(problem box) radius of the rounded boxes, -1 where there is none [m]"""
        grown = np.zeros(self.center.shape[:2]) if self.grown is None else self.grown
        return np.where(np.arange(self.center.shape[1]) < self.boxes[:, None], grown, -1.0)

    def solids(self, which: NDArray) -> RoundedBoxes:
        """The obstacles of some problems, single precision."""
        arrays = (self.center, self.half, self.radius, *([] if self.rotation is None else [self.rotation]))
        return RoundedBoxes(*(jnp.asarray(x[which], jnp.float32) for x in arrays))

    def taken(self, index: NDArray) -> "Problems":
        """Some of them."""
        return Problems(
            self.start[index], self.goal[index], self.center[index], self.half[index], self.boxes[index],
            tuple(self.reference[k] for k in index), *(x if x is None else x[index] for x in (self.grown, self.rotation)),
        )  # fmt: skip


def read_problems(path: Path, count: int) -> Problems:
    """Problems of a file, `count` of them spread evenly; 0: all.

    Raises:
        UsageError: the file has another format, or too few problems.
    """
    try:
        with np.load(path) as file:
            data = {key: file[key] for key in KEYS}
    except (OSError, ValueError, KeyError) as error:
        raise UsageError(
            f"{path} holds no planning problems ({error}); expected are arrays {', '.join(KEYS)}"
        ) from error
    offsets = data["path_offset"]
    paths = tuple(data["path"][a:b].astype(float) for a, b in pairwise(offsets))
    every = Problems(
        data["start"].astype(float), data["goal"].astype(float), data["box_center"].astype(float),
        data["box_half_extents"].astype(float), data["n_boxes"].astype(int), paths,
    )  # fmt: skip
    if not 0 <= count <= len(every):
        raise UsageError(f"--count {count}: {path} holds {len(every)} problems; 0 takes all")
    return every.taken(drawn_evenly(len(every), count)) if count else every


def joined(parts: Sequence[Problems]) -> Problems:
    """Problems of several kinds as one list, with places for as many obstacles as any of them has."""
    most = max(part.center.shape[1] for part in parts)

    def padded(x: NDArray) -> NDArray:
        return np.concatenate([x, np.zeros((len(x), most - x.shape[1], *x.shape[2:]))], axis=1)

    def whole(name: str) -> NDArray:
        return np.concatenate([getattr(part, name) for part in parts])

    grown = [np.zeros(part.center.shape[:2]) if part.grown is None else part.grown for part in parts]
    turned = [
        np.tile(np.eye(3), (*part.center.shape[:2], 1, 1)) if part.rotation is None else part.rotation for part in parts
    ]
    axes = None if all(part.rotation is None for part in parts) else np.concatenate([padded(x) for x in turned])
    return Problems(
        whole("start"), whole("goal"), np.concatenate([padded(part.center) for part in parts]), np.concatenate([padded(part.half) for part in parts]),
        whole("boxes"), tuple(path for part in parts for path in part.reference), np.concatenate([padded(x) for x in grown]), axes,
    )  # fmt: skip


def drawn_evenly(every: int, count: int) -> NDArray:
    """Indices of `count` out of `every`, spread evenly."""
    return np.linspace(0, every - 1, count).astype(int)


def thin_arm() -> Arm:
    """The UR5 of the problems."""
    arm = load_arm("ur5")
    return replace(arm, capsule_radii=arm.capsule_radii - THINNER)


def joint_length(path: NDArray) -> float:
    """Length of a path in the joints [rad]."""
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
