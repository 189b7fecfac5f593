"""Whether the robot is where its joints put it: whether the frames measure it there, or see what lies behind.

Asked at places along the axes of the robot's moving capsules, whose depth a frame either confirms, or contradicts by measuring
farther. What is nearer says nothing: it hides the robot.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial import KDTree

from hrcjax.io.recordings.frame import InputFrame

from .exclusions import BASES, Exclusions

MOST = 12
"""Frames that are asked."""
PLACES = 9
"""Along the axis of a capsule."""
MARGIN = 0.05
"""Of noise, pose and shape [m]."""
ANGLE = 0.01
"""Between the ray to a place and the nearest ray of a cloud, at most [rad]."""
LEAST = 30
"""Places that must be seen before anything is said."""
HARDLY, WELL = 0.5, 0.8
"""Shares of the places seen that are confirmed: below the first it is told, and another reading is named above the second."""
FAR_BETTER = 3
"""Another reading is also named if it confirms so many times as many places: those hidden say nothing."""
BY_ALPHABET = (2, 1, 0, 3, 4, 5)
"""Columns of joints in the order of the alphabet (elbow, shoulder lift, shoulder pan, wrist ...) from the base to the flange."""


class BodyCheck:
    """Asks some frames, for the joints as given and for other readings of them."""

    def __init__(self, exclusions: Exclusions) -> None:
        self.exclusions = exclusions
        other = BASES[1 - BASES.index(exclusions.base)]
        ordered = tuple(range(len(BY_ALPHABET)))
        bases = {exclusions.base: "", other: f"--arm-base {other}"}
        orders = (
            {ordered: ""} if exclusions.named else {ordered: "", BY_ALPHABET: "joints in the order of the alphabet"}
        )
        self.readings = {
            (base, order): " and ".join(filter(None, (said, words)))
            for base, said in bases.items()
            for order, words in orders.items()
        }
        self.found = {reading: np.zeros(2, int) for reading in self.readings}
        """Places confirmed, and contradicted."""
        self.asked = 0
        self._bodies = {base: jax.jit(exclusions.with_base(base).body_at) for base in bases}

    def add(self, frame: InputFrame) -> None:
        """Asks a frame whose joints are known."""
        q = self.exclusions.q_at(frame.stamp)
        if q is None or self.asked >= MOST or not np.isfinite(q).all():
            return
        depth_at = _depth_at(frame)
        self.asked += 1
        for (base, order), found in self.found.items():
            body = self._bodies[base](q[jnp.asarray(order)])
            assert body is not None
            a, b, radius = (
                np.asarray(v, np.float64)[1:] for v in (body.a, body.b, body.radius)
            )  # the base stands still
            share = np.linspace(0, 1, PLACES)[:, None, None]
            places = ((1 - share) * a + share * b).reshape(-1, 3)
            own, measured = depth_at((places - frame.position) @ frame.rotation)
            r = np.tile(radius, PLACES)
            there = measured > 0
            found[0] += np.sum(there & (np.abs(measured - (own - r / 2)) <= 1.5 * r + MARGIN))
            found[1] += np.sum(there & (measured > own + r + MARGIN))

    def share(self, reading: tuple[str, tuple[int, ...]]) -> float:
        """Of the places seen those that are confirmed; NaN: too few are seen."""
        confirmed, against = self.found[reading]
        return confirmed / (confirmed + against) if confirmed + against >= LEAST else np.nan

    def best(self) -> tuple[str, tuple[int, ...]] | None:
        """The reading that confirms most places, if hardly any are contradicted; None: there is none."""
        reading = max(self.found, key=lambda reading: self.found[reading][0])
        return reading if self.share(reading) > WELL else None

    def line(self) -> str:
        """What is to be said; "": nothing."""
        given, best = next(iter(self.readings)), self.best()
        here = self.share(given)
        far_better = best is not None and self.found[best][0] > FAR_BETTER * self.found[given][0]
        if not (here < HARDLY or far_better):
            return ""
        text = (
            f"robot: where --joints puts the arm {self.found[given][0]} places are seen to be the arm, and at {self.found[given][1]} "
            "what lies behind is seen: the base frame (--arm-base), the order of the joints (joint_names in the file) or their "
            "clock may be another"
        )
        if best is not None and best != given:
            confirmed, against = self.found[best]
            text += f"; {confirmed} and {against} with {self.readings[best]}"
        return text


def _depth_at(frame: InputFrame) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Places in the sensor's axes (place, 3) [m] -> how far they are, and how far the frame measured in their direction; 0:
    nothing. Along the axis of a camera, along the ray of a cloud [m]."""

    def in_image(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        assert frame.depth is not None and frame.intrinsics is not None
        camera, (x, y, z) = frame.intrinsics, places.T
        safe = np.where(z > 0.05, z, 1.0)
        u, v = np.rint(x / safe * camera.fx + camera.cx), np.rint(y / safe * camera.fy + camera.cy)
        inside = (z > 0.05) & (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
        at = np.where(inside, v, 0).astype(int), np.where(inside, u, 0).astype(int)
        return z, np.where(inside, frame.depth[at], 0.0)

    if frame.depth is not None:
        return in_image
    assert frame.cloud is not None
    ranges = np.linalg.norm(frame.cloud, axis=1)
    rays = KDTree(frame.cloud / ranges[:, None])

    def in_cloud(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        own = np.linalg.norm(places, axis=1)
        apart, nearest = rays.query(places / np.maximum(own, 1e-9)[:, None])
        return own, np.where(apart < ANGLE, ranges[nearest], 0.0)

    return in_cloud
