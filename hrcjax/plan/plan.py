"""The planner: descend the potential field, then optimise the path found."""

import jax.numpy as jnp

from hrcjax.plan.descent import StepFn, damped_step, potential_path
from hrcjax.plan.optimise import PathResult, optimise_path
from hrcjax.plan.params import PlanParams, PlanSizes
from hrcjax.plan.potential import DistancesFn
from hrcjax.plan.resample import resample
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

    If the descent ends short of the goal, a straight line joins them before optimisation, and the status says so.

    Args:
        distances: signed distances to the surfaces of convex obstacles; an absent one is far away [m].
        radius: radius of each obstacle [m].
        lower: lower bounds of the path [m].
        upper: upper bounds of the path [m].
        step: rule of one step of the descent.

    Not finite if: start and goal coincide.
    """
    descent = potential_path(params.potential, start, goal, distances, radius, sizes.steps, step)
    guess = resample(jnp.concatenate([descent.waypoints, goal[None]]), sizes.waypoints)
    return optimise_path(params, guess, distances, radius, lower, upper, sizes.iterations, descent.reached)
