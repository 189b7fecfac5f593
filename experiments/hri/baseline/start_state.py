"""A start that is in the padding of an obstacle is moved out of it, as MoveIt's adapter for start states does."""

import numpy as np
from numpy.typing import NDArray

from .collision import FAR, CollisionScene
from .settings import BaselineSettings

ATTEMPTS = 100
"""Random configurations near the start that are tried."""
SPREAD = 0.3
"""Largest change of a joint in them [rad]."""


def freed_start(settings: BaselineSettings, scene: CollisionScene, start: NDArray, seed: int) -> NDArray | None:
    """The start itself if it keeps the planner's gap; else the nearest of some random configurations about it that does, and
    to which no configuration on the straight way is nearer to an obstacle than the start; None: there is none, or the start
    is not only in the padding but in the obstacle."""
    if scene.free(start[None], settings.plan_gap)[0]:
        return start
    now = float(scene.clearance(scene.spheres.centres(start[None]))[0])
    if now <= 0:
        return None
    draw = np.random.default_rng(seed)
    near = start + draw.uniform(-SPREAD, SPREAD, (ATTEMPTS, len(start))) * np.linspace(0.1, 1, ATTEMPTS)[:, None]
    for q in near[scene.free(near, settings.plan_gap)]:
        count = max(int(np.ceil(np.abs(q - start).max() / settings.step)), 2)
        way = start + np.linspace(0, 1, count + 1)[1:, None] * (q - start)
        if (scene.clearance(scene.spheres.centres(way)) >= now - 0.002).all() and scene.free(way, -FAR).all():
            return q
    return None
