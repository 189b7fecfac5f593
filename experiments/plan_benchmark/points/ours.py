"""The planners of the library: descents of potentials, the optimiser after a descent, and many starts."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.plan import (
    GradientDescentParams,
    PathResult,
    PlanParams,
    PlanSizes,
    PotentialParams,
    PotentialPath,
    damped_step,
    force,
    gradient_descent_path,
    plan,
    plan_multi_start,
    plan_with_slack,
    potential_path,
)
from hrcjax.plan.potential import limited
from hrcjax.typing import Array, Bool, Float, Vector3
from hrcjax.world import Scene, obstacle_distances

from .found import Found
from .scenes import CLEARANCE, PointScene

ZETA = 2.0
"""Safety factor: with the clearance as radius, the optimiser keeps (zeta - 1) CLEARANCE, and repulsion begins at twice this [radii]."""
STEPS = 3000
"""Steps of a descent alone; the printed gains need 640 without obstacles."""
SIZES = PlanSizes()
STARTS = 16
"""Guesses of the planner with many starts."""
SLACK = 0.01
"""Part of the length that `multi_start_slack` may spend on less bending [1]."""

Planned = tuple[Float[Array, "point 3"], Bool[Array, ""]]


def _params() -> PlanParams:
    found = eqx.tree_at(lambda p: p.potential.zeta, PlanParams(), ZETA)
    return jax.tree.map(jnp.float32, found)


def _grown(scene: Scene) -> Callable[[Vector3], Array]:
    """Distances to the obstacles grown by the clearance: a descent that stays outside of them keeps it."""
    return lambda x: obstacle_distances(scene, x) - CLEARANCE


def _broken_line(path: PotentialPath, goal: Vector3) -> Planned:
    """The descent up to its arrival, then straight to the goal."""
    before = jnp.arange(path.waypoints.shape[0], dtype=path.arrival.dtype) <= path.arrival
    return jnp.where(before[:, None], path.waypoints, goal), path.reached


def gradient_descent(scene: Scene) -> Planned:
    """The paper's baseline with its printed numbers."""
    params = jax.tree.map(jnp.float32, GradientDescentParams())
    path = gradient_descent_path(params, scene.start, scene.goal, _grown(scene), scene.radius, STEPS)
    return _broken_line(path, scene.goal)


def _unscaled_step(
    p: PotentialParams, q: Vector3, goal: Vector3, distances: Callable[[Vector3], Array], radius: Array
) -> Vector3:
    return limited(force(p, q, goal, distances, radius, scaled=False), p.step_max)


def _potential(scene: Scene, step: Any) -> Planned:
    """Descent among the grown obstacles; repulsion begins as far from the real ones as in the planner."""
    params = _params().potential
    radius = scene.radius * (ZETA - 1) / ZETA
    path = potential_path(params, scene.start, scene.goal, _grown(scene), radius, STEPS, step)
    return _broken_line(path, scene.goal)


def plain_apf(scene: Scene) -> Planned:
    """The same potential as `iapf` without the factor that fades repulsion at the goal, in unit steps."""
    return _potential(scene, _unscaled_step)


def iapf(scene: Scene) -> Planned:
    """Descent of the improved potential by the library's damped steps."""
    return _potential(scene, damped_step)


def iapf_optimised(scene: Scene) -> Planned:
    """The library's planner: descent, then the optimiser; an arch if that fails."""
    found = plan(
        _params(), scene.start, scene.goal, lambda x: obstacle_distances(scene, x), scene.radius, scene.lower, scene.upper, SIZES,
    )  # fmt: skip
    return found.waypoints, found.clear & found.inside


def multi_start(scene: Scene) -> Planned:
    """The optimiser from many starts, weights as by default."""
    return _many(scene, plan_multi_start)


def multi_start_slack(scene: Scene) -> Planned:
    """The same for several weights of bending: the straightest path at most 1 % longer than the shortest of them."""
    return _many(scene, partial(plan_with_slack, slack=jnp.float32(SLACK)))


def _many(scene: Scene, planner: Callable[..., PathResult]) -> Planned:
    found = planner(
        _params(), scene.start, scene.goal, lambda x: obstacle_distances(scene, x), scene.radius, scene.lower, scene.upper, SIZES,
        count=STARTS,
    )  # fmt: skip
    return found.waypoints, found.clear & found.inside


OURS: dict[str, Callable[[Scene], Planned]] = {
    f.__name__: f for f in (gradient_descent, plain_apf, iapf, iapf_optimised, multi_start, multi_start_slack)
}
"""Planners by name, each for one scene."""


def compiled_planner(name: str, example: PointScene) -> tuple[Callable[[PointScene], Found], float]:
    """One of the library's planners for one scene after the other, in float32, and how long it took to compile [s]."""
    begin = time.perf_counter()
    program = jax.jit(OURS[name]).lower(example.for_library()).compile()
    seconds = time.perf_counter() - begin

    def run(scene: PointScene) -> Found:
        given = jax.block_until_ready(scene.for_library())
        begin = time.perf_counter()
        points, claimed = jax.block_until_ready(program(given))
        taken = time.perf_counter() - begin
        line = np.asarray(points, float)
        line = line if np.isfinite(line).all() else np.stack([scene.start, scene.goal])
        line = np.concatenate([scene.start[None], line[1:-1], scene.goal[None]])  # the ends as they are in float64
        return Found(line, bool(claimed), taken)

    return run, seconds
