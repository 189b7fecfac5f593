"""The planner of a point with many starts: guesses are optimised side by side, and the best is taken."""

import jax
import jax.numpy as jnp

from hrcjax.geom.resample import resample_path
from hrcjax.plan.descent import StepFn, damped_step, potential_path
from hrcjax.plan.optimise import optimise_path
from hrcjax.plan.params import PathParams, PlanParams, PlanSizes
from hrcjax.plan.path_result import PathResult
from hrcjax.plan.plan import arch
from hrcjax.plan.point_guesses import detour_guesses, detours
from hrcjax.plan.potential import DistancesFn
from hrcjax.typing import Array, Bool, Float, Int, Vector3

_OUTSIDE = 10.0
"""Violation that leaving the bounds counts as: more than any of a distance [m]."""


def best_path(params: PathParams, paths: PathResult) -> Int[Array, ""]:
    """Which of several paths is the best: of those that keep distances and bounds the one of least cost omega1 length +
    omega2 bending energy (eq. 5a); if none does, the one of least violation. Of equals the first.

    Args:
        paths: with a leading axis; one that is not finite is never taken unless all are.
    """
    cost = params.omega1 * paths.length + params.omega2 * paths.bending_energy
    finite = jnp.isfinite(cost) & jnp.isfinite(paths.violation)
    kept = paths.clear & paths.inside & finite
    missed = jnp.where(finite, paths.violation + jnp.where(paths.inside, 0, _OUTSIDE), jnp.inf)
    return jnp.argmin(jnp.where(jnp.any(kept), jnp.where(kept, cost, jnp.inf), missed))


def optimise_best(
    params: PlanParams,
    guesses: Float[Array, "guess waypoint 3"],
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    lower: Vector3,
    upper: Vector3,
    iterations: int,
    reached: Bool[Array, ""] | None = None,
) -> PathResult:
    """The best of the paths to which the optimiser takes the guesses, as `optimise_path` for each.

    Differentiable by unrolling; the choice itself has no derivative.

    Raises:
        ValueError: fewer than 4 waypoints, or negative iterations.
    """

    def optimised(guess: Float[Array, "waypoint 3"]) -> PathResult:
        return optimise_path(params, guess, distances, radius, lower, upper, iterations, reached)

    found = jax.vmap(optimised)(guesses)
    best = best_path(params.path, found)
    return jax.tree.map(lambda x: x[best], found)


def plan_multi_start(
    params: PlanParams,
    start: Vector3,
    goal: Vector3,
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    lower: Vector3,
    upper: Vector3,
    sizes: PlanSizes,
    count: int = 16,
    step: StepFn = damped_step,
) -> PathResult:
    """The path from start to goal as of `plan`, by more guesses: those of `plan`, which are the descent of the potential
    and the arch over the obstacles, then the straight line, bows all round it, and seeded detours.

    Where `plan` keeps distances and bounds, so does this, at no more cost.

    Args:
        distances: signed distances to the surfaces of convex obstacles; an absent one is far away [m].
        radius: radius of each obstacle [m].
        lower: lower bounds of the path [m].
        upper: upper bounds of the path [m].
        count: number of guesses.
        step: rule of one step of the descent.

    Not finite if: start and goal coincide.

    Raises:
        ValueError: fewer than 3 guesses.
    """
    if count < 3:
        raise ValueError(f"{count} guesses; accepted are 3 or more")
    descent = potential_path(params.potential, start, goal, distances, radius, sizes.steps, step)
    descended = resample_path(jnp.concatenate([descent.waypoints, goal[None]]), sizes.waypoints)
    aside = jnp.asarray(detours(count - 2), start.dtype)
    guesses = jnp.concatenate([
        descended[None],
        arch(start, goal, upper, sizes.waypoints)[None],
        detour_guesses(start, goal, lower, upper, aside, sizes.waypoints),
    ])  # fmt: skip
    return optimise_best(params, guesses, distances, radius, lower, upper, sizes.iterations, descent.reached)
