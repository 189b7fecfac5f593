"""Consistency of joints and frames: whether the frames measure the robot where its joint positions put it.

Tested at points along the axes of the robot's moving capsules. A frame confirms a point if it measures the capsule's depth, and
contradicts it if it measures a surface behind. A nearer surface occludes the robot and says nothing.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial import KDTree

from hrcjax.io.recordings.frame import InputFrame

from .exclusions import BASES, Exclusions

MOST = 12
"""Frames that are tested."""
PLACES = 9
"""Test points along the axis of a capsule."""
MARGIN = 0.05
"""Tolerance for noise, pose and shape [m]."""
ANGLE = 0.01
"""Largest angle between the ray to a test point and the nearest ray of a cloud [rad]."""
LEAST = 30
"""Test points needed for a result."""
HARDLY, WELL = 0.5, 0.8
"""Shares of confirmed test points: below the first there is a warning; it names another reading that is above the second [1]."""
FAR_BETTER = 3
"""Another reading is also named if it confirms this many times as many test points [1]."""
BY_ALPHABET = (2, 1, 0, 3, 4, 5)
"""Columns of joints in alphabetical order (elbow, shoulder lift, shoulder pan, wrist ...), reordered from base to flange."""


class BodyCheck:
    """Tests some frames against the joints as given, and against other base frames and joint orders."""

    def __init__(self, exclusions: Exclusions) -> None:
        self.exclusions = exclusions
        other = BASES[1 - BASES.index(exclusions.base)]
        ordered = tuple(range(len(BY_ALPHABET)))
        bases = {exclusions.base: "", other: f"--arm-base {other}"}
        orders = {ordered: ""} if exclusions.named else {ordered: "", BY_ALPHABET: "joints in alphabetical order"}
        self.readings = {
            (base, order): " and ".join(filter(None, (said, words)))
            for base, said in bases.items()
            for order, words in orders.items()
        }
        self.found = {reading: np.zeros(2, int) for reading in self.readings}
        """Test points confirmed, and contradicted."""
        self.asked = 0
        self._bodies = {base: jax.jit(exclusions.with_base(base).body_at) for base in bases}

    def add(self, frame: InputFrame) -> None:
        """Tests a frame whose joints are known."""
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
            )  # without the base, which does not move
            share = np.linspace(0, 1, PLACES)[:, None, None]
            places = ((1 - share) * a + share * b).reshape(-1, 3)
            own, measured = depth_at((places - frame.position) @ frame.rotation)
            r = np.tile(radius, PLACES)
            there = measured > 0
            found[0] += np.sum(there & (np.abs(measured - (own - r / 2)) <= 1.5 * r + MARGIN))
            found[1] += np.sum(there & (measured > own + r + MARGIN))

    def share(self, reading: tuple[str, tuple[int, ...]]) -> float:
        """Share of confirmed test points [1]; NaN: too few were observed."""
        confirmed, against = self.found[reading]
        return confirmed / (confirmed + against) if confirmed + against >= LEAST else np.nan

    def best(self) -> tuple[str, tuple[int, ...]] | None:
        """The reading that confirms most test points, if it contradicts few; None: there is none."""
        reading = max(self.found, key=lambda reading: self.found[reading][0])
        return reading if self.share(reading) > WELL else None

    def line(self) -> str:
        """The warning; "": none."""
        given, best = next(iter(self.readings)), self.best()
        here = self.share(given)
        far_better = best is not None and self.found[best][0] > FAR_BETTER * self.found[given][0]
        if not (here < HARDLY or far_better):
            return ""
        text = (
            f"robot: the frames do not match --joints: {self.found[given][0]} points of the arm are confirmed, at "
            f"{self.found[given][1]} a surface behind the arm is measured. Check the base frame (--arm-base), the order of the "
            "joints (joint_names in the file) and their clock"
        )
        if best is not None and best != given:
            confirmed, against = self.found[best]
            text += f"; {confirmed} confirmed and {against} contradicted with {self.readings[best]}"
        return text


def _depth_at(frame: InputFrame) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Points in the sensor's axes (place, 3) [m] -> their depth, and the depth measured in their direction, 0: none [m]. Depth is
    along the optical axis for images, along the ray for clouds."""

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
