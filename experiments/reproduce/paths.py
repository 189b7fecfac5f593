"""Paths by every planner of the library in the scene of table I with all obstacles, and the variants that the figures show."""

import functools
import time
from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.geom.bending_energy import bending_energy
from hrcjax.plan import PathResult, PlanParams, PlanSizes, damped_step, plan, potential_path
from hrcjax.typing import Array, Float
from hrcjax.world.scene import COLUMN, Scene, obstacle_distances

from .printed import TIMES
from .readings import row_scene
from .times import STEPS, improved_params

SCENE = next(row for row in TIMES if row.key == "I.4")
"""The row of the common scene: four obstacles of 3 cm, zeta 4."""
SIZES = PlanSizes(iterations=20)
POINTS = SIZES.waypoints
"""Equally spaced points by which a path's bending energy is measured: those of a planned path."""
ZETAS = (1.0, 2.0, 3.0, 4.0)
"""Distance from centres and axes that planned paths keep, the first outside the obstacle, the last the paper's [radii]."""
BENDING_WEIGHTS = (1e-4, 1e-2, 1e-1)
"""omega2 of table VIII's counterparts: the shortest path, the default, the straightest [m]."""
REPEATS = 5
"""Plans of each setting that are timed."""
DEFAULT = 1
"""The default's place among them."""


class Measured(NamedTuple):
    """What every path is measured by."""

    length: float
    """[m]."""
    bending: float
    """Bending energy of the path at `POINTS` equally spaced points [1/m]."""
    clearance: float
    """Least distance to the surface of an obstacle; negative: through it [m]."""


def even(path: NDArray, count: int) -> NDArray:
    """Points at equal distances along the broken line through the points of a path; repeated points are harmless [m]."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    new = np.concatenate([[True], np.diff(way) > 1e-9])
    at = np.linspace(0.0, way[-1], count)
    return np.stack([np.interp(at, way[new], path[new, axis]) for axis in range(3)], axis=1)


def clearance(points: NDArray, scene: Scene) -> float:
    """Least distance of points to the surfaces of balls and columns; infinite without obstacles [m]."""
    least = np.inf
    for kind, center, size in zip(
        *(np.asarray(x)[np.asarray(scene.mask)] for x in (scene.kind, scene.center, scene.size)), strict=True
    ):
        if kind == COLUMN:
            across = np.linalg.norm(points[:, :2] - center[:2], axis=1) - size[0]
            along = np.abs(points[:, 2] - center[2]) - size[2]
            gap = np.hypot(np.maximum(across, 0), np.maximum(along, 0)) + np.minimum(np.maximum(across, along), 0)
        else:
            gap = np.linalg.norm(points - center, axis=1) - size[0]
        least = min(least, float(gap.min()))
    return least


@functools.cache
def _bending() -> Any:
    return jax.jit(bending_energy)


def measured(path: NDArray, scene: Scene) -> Measured:
    """A path of any points, measured in double precision."""
    total = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    with jax.enable_x64(True):
        bending = float(_bending()(jnp.asarray(even(path, POINTS), jnp.float64)))
    return Measured(total, bending, clearance(even(path, 20 * POINTS), scene))


def to_goal(path: NDArray, steps: int) -> NDArray:
    """The points of a descent up to the step that came within 1 cm of the goal, and the goal [m]."""
    return np.concatenate([path[: steps + 1], np.array([GOAL_M])])


GOAL_M = (0.7, 0.3, 0.05)
"""q_goal [m]."""


def _descended(scene: Scene) -> Float[Array, "point 3"]:
    """Points of the damped descent of the improved field, with the goal at the end [m]."""

    def distances(x: Float[Array, "3"]) -> Float[Array, "obstacle"]:
        return obstacle_distances(scene, x)

    path = potential_path(improved_params(SCENE), scene.start, scene.goal, distances, scene.radius, STEPS, damped_step)
    return jnp.concatenate([path.waypoints, scene.goal[None]])


def _planned(scene: Scene, zeta: Array, omega2: Array) -> PathResult:
    """The library's plan: descent, then length and bending energy, zeta radii away from the centres of obstacles."""
    params = jax.tree.map(lambda x: jnp.asarray(x, jnp.float64), PlanParams())
    params = eqx.tree_at(lambda p: (p.potential.zeta, p.path.omega2), params, (zeta, omega2))

    def distances(x: Float[Array, "3"]) -> Float[Array, "obstacle"]:
        return obstacle_distances(scene, x)

    return plan(params, scene.start, scene.goal, distances, scene.radius, scene.lower, scene.upper, SIZES)


def paths_case(reading: str) -> Mapping[str, Any]:
    """Damped descent; the planned path for every zeta (of `ZETAS`) and weight (of `BENDING_WEIGHTS`), whether it is clear, and the
    time of each plan once compiled [s]; for every zeta the path without bending energy, omega2 0."""
    with jax.enable_x64(True):
        scene = row_scene(reading, SCENE)
        one = jax.jit(_planned)
        jax.block_until_ready(one(scene, jnp.asarray(ZETAS[0]), jnp.asarray(BENDING_WEIGHTS[0])))  # compiles
        plans, seconds = [], []
        for zeta in ZETAS:
            for weight in BENDING_WEIGHTS:
                some = []
                for _ in range(REPEATS):
                    begin = time.perf_counter()
                    some.append(jax.block_until_ready(one(scene, jnp.asarray(zeta), jnp.asarray(weight))))
                    seconds.append(time.perf_counter() - begin)
                plans.append(some[-1])
        shape = len(ZETAS), len(BENDING_WEIGHTS)
        return {
            "damped": np.asarray(jax.jit(_descended)(scene)),
            "planned": np.stack([plan.waypoints for plan in plans]).reshape(*shape, -1, 3),
            "clear": np.reshape([bool(plan.clear & plan.inside) for plan in plans], shape),
            "seconds": np.reshape(seconds, (*shape, REPEATS)),
            "unbent": np.stack([one(scene, jnp.asarray(zeta), jnp.asarray(0.0)).waypoints for zeta in ZETAS]),
        }
