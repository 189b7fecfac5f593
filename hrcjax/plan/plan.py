"""The planner: descend the potential field, then optimise the path found."""

import jax
import jax.numpy as jnp

from hrcjax.geom.resample import resample_path
from hrcjax.numerics import safe_norm
from hrcjax.plan.descent import StepFn, damped_step, potential_path
from hrcjax.plan.optimise import optimise_path
from hrcjax.plan.params import PlanParams, PlanSizes
from hrcjax.plan.path_result import PathResult
from hrcjax.plan.potential import DistancesFn
from hrcjax.typing import Array, Float, Vector3


def plan(
    params: PlanParams,
    start: Vector3,
    goal: Vector3,
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    lower: Vector3,
    upper: Vector3,
    sizes: PlanSizes,
    step: StepFn = damped_step,
) -> PathResult:
    """The path from start to goal: the potential field chooses the side of each obstacle, the optimiser the course.

    If the descent ends short of the goal, a straight line joins them before optimisation, and the status says so. If
    this path cannot keep its distances, an arch over the obstacles is optimised in its place, and taken if it is
    better.

    Args:
        distances: signed distances to the surfaces of convex obstacles; an absent one is far away [m].
        radius: radius of each obstacle [m].
        lower: lower bounds of the path [m].
        upper: upper bounds of the path [m].
        step: rule of one step of the descent.

    Not finite if: start and goal coincide.
    """
    descent = potential_path(params.potential, start, goal, distances, radius, sizes.steps, step)
    descended = resample_path(jnp.concatenate([descent.waypoints, goal[None]]), sizes.waypoints)

    def optimised(guess: Float[Array, "waypoint 3"]) -> PathResult:
        return optimise_path(params, guess, distances, radius, lower, upper, sizes.iterations, descent.reached)

    both = jax.vmap(optimised)(jnp.stack([descended, arch(start, goal, upper, sizes.waypoints)]))
    failed = ~(both.clear & both.inside)
    over = failed[0] & (~failed[1] | (both.violation[1] < both.violation[0]))
    return jax.tree.map(lambda x: jnp.where(over, x[1], x[0]), both)


def arch(start: Vector3, goal: Vector3, upper: Vector3, count: int) -> Float[Array, "count 3"]:
    """A parabola from start to goal, half as high as it is long but below the upper bound [m]."""
    height = jnp.minimum(safe_norm(goal - start) / 2, jnp.maximum(upper[2] - jnp.maximum(start[2], goal[2]), 0))
    t = jnp.linspace(0, 1, count, dtype=start.dtype)[:, None]
    return resample_path(
        start + t * (goal - start) + 4 * t * (1 - t) * height * jnp.asarray([0, 0, 1], start.dtype), count
    )
