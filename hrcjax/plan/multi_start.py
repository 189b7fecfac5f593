"""The planner of a point with many starts: guesses are optimised side by side, and the best is taken."""

import equinox as eqx
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
from hrcjax.typing import Array, Bool, Float, Int, Scalar, Vector3

_OUTSIDE = 10.0
"""Violation that leaving the bounds counts as: more than any of a distance [m]."""
FACTORS = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
"""Of omega2, from which `plan_with_slack` chooses [1]."""


def best_path(params: PathParams, paths: PathResult) -> Int[Array, ""]:
    """Which of several paths is the best: of those that keep distances and bounds the one of least cost omega1 length +
    omega2 bending energy (eq. 5a); if none does, the one of least violation. Of equals the first.

    Args:
        paths: with a leading axis; one that is not finite is never taken unless all are.
    """
    cost = params.omega1 * paths.length + params.omega2 * paths.bending_energy
    return _least(paths, cost)


def straightest_path(paths: PathResult, slack: Scalar) -> Int[Array, ""]:
    """Which of several paths bends least, of those that keep distances and bounds and are at most `slack` longer than the
    shortest of these; if none does, the one of least violation. Of equals the first.

    Args:
        paths: with a leading axis; one that is not finite is never taken unless all are, and no measure of length.
        slack: part of the length, 0 or more [1].
    """
    kept = _kept(paths)
    shortest = jnp.min(jnp.where(kept, paths.length, jnp.inf))
    short = paths.length <= (1 + slack) * shortest
    return _least(paths, jnp.where(short | ~jnp.any(kept), paths.bending_energy, jnp.inf))


def _finite(paths: PathResult) -> Bool[Array, "path"]:
    """Whether every number that decides is finite."""
    return jnp.isfinite(paths.length) & jnp.isfinite(paths.bending_energy) & jnp.isfinite(paths.violation)


def _kept(paths: PathResult) -> Bool[Array, "path"]:
    """Whether distances and bounds are kept, by a path that is finite."""
    return paths.clear & paths.inside & _finite(paths)


def _least(paths: PathResult, cost: Float[Array, "path"]) -> Int[Array, ""]:
    kept = _kept(paths)
    missed = jnp.where(_finite(paths), paths.violation + jnp.where(paths.inside, 0, _OUTSIDE), jnp.inf)
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
    guesses, reached = _guesses(params, start, goal, distances, radius, lower, upper, sizes, count, step)
    return optimise_best(params, guesses, distances, radius, lower, upper, sizes.iterations, reached)


def plan_with_slack(
    params: PlanParams,
    start: Vector3,
    goal: Vector3,
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    lower: Vector3,
    upper: Vector3,
    sizes: PlanSizes,
    slack: Scalar = 0.01,
    count: int = 16,
    step: StepFn = damped_step,
) -> PathResult:
    """The straightest path that is hardly longer than the shortest: `plan_multi_start` for omega2 times each of FACTORS, and
    of their paths the one of least bending energy among those at most `slack` longer than the shortest.

    So the trade of length against bending is stated as a length, and not as weights that mean another one in every scene.

    Args:
        slack: part of the length that may be spent on less bending [1].
        count: number of guesses for each weight.
        Others as for `plan_multi_start`.

    Not finite if: start and goal coincide.

    Raises:
        ValueError: fewer than 3 guesses.
    """
    guesses, reached = _guesses(params, start, goal, distances, radius, lower, upper, sizes, count, step)

    def weighed(factor: Scalar) -> PathResult:
        asked = eqx.tree_at(lambda p: p.path.omega2, params, params.path.omega2 * factor)
        return optimise_best(asked, guesses, distances, radius, lower, upper, sizes.iterations, reached)

    found = jax.vmap(weighed)(jnp.asarray(FACTORS, start.dtype))
    best = straightest_path(found, slack)
    return jax.tree.map(lambda x: x[best], found)


def _guesses(
    params: PlanParams,
    start: Vector3,
    goal: Vector3,
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    lower: Vector3,
    upper: Vector3,
    sizes: PlanSizes,
    count: int,
    step: StepFn,
) -> tuple[Float[Array, "guess waypoint 3"], Bool[Array, ""]]:
    """All guesses, and whether the descent reached the goal."""
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
    return guesses, descent.reached
