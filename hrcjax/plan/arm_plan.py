"""The planner of the whole arm: guesses, optimised side by side, the best one finished."""

from collections.abc import Callable

import jax
import jax.numpy as jnp

from hrcjax.numerics import require_floating
from hrcjax.plan.arm_optimise import Inner, path_cost, polished, ramped
from hrcjax.plan.arm_params import ArmPathParams, ArmPlanSizes
from hrcjax.plan.arm_path import ArmPath, judge_arm
from hrcjax.plan.arm_task import ArmTask, arm_task
from hrcjax.plan.body import PlanBody
from hrcjax.plan.guesses import guesses
from hrcjax.plan.params import PotentialParams
from hrcjax.plan.potential import DistancesFn
from hrcjax.typing import Array, Float, Int, Joints, Vector3

_SAME = 1e-6
"""Costs that differ by less than this share are equal: the first guess is then taken [1]."""


def plan_arm(
    path: ArmPathParams,
    potential: PotentialParams,
    body: PlanBody,
    q_start: Joints,
    q_goal: Joints,
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    lower: Vector3,
    upper: Vector3,
    sizes: ArmPlanSizes,
) -> ArmPath:
    """The path from one configuration to another that minimises length, bending energy and repulsion over attraction, and
    keeps its distances.

    Derivatives are those of the optimum that was found, by the implicit function theorem: exact where the last steps have
    converged, whichever guess and number of steps led there. Which guess wins has no derivative.

    Args:
        path: numbers of the optimiser.
        potential: numbers of the potential field; zeta also gives the distance (zeta - 1) radius that every obstacle is
            left.
        body: what moves.
        q_start, q_goal: first and last configuration [rad].
        distances: signed distances of a point to the surfaces of convex obstacles; an absent one is far away [m].
        radius: radius of each obstacle; 0: it does not repel, and must just not be touched [m].
        lower, upper: bounds of the tool point; infinite: none [m].
        sizes: of arrays, and numbers of iterations.

    Not finite if: start and goal coincide, omega1 and omega2 are both 0, or K_att is 0.

    Raises:
        ValueError: q_start or q_goal has not one number per joint of the body.
    """
    require_floating("plan_arm", q_start=q_start, q_goal=q_goal)
    for name, q in (("q_start", q_start), ("q_goal", q_goal)):
        if q.shape != (body.size,):
            raise ValueError(f"{name} has shape {q.shape}; accepted: ({body.size},), one number per joint")
    task = arm_task(path, potential, body, q_start, q_goal, distances, radius, lower, upper)

    def search(_: object, nowhere: Inner) -> tuple[Inner, Float[Array, "2"]]:
        found, reached = guesses(task, sizes)
        found = jax.vmap(lambda inner: ramped(task, inner, sizes))(found)
        guess = best_guess(task, found, sizes)
        return polished(task, found[guess], sizes), jnp.stack([reached.astype(jnp.int32), guess]).astype(q_start.dtype)

    def slope(inner: Inner) -> Inner:
        return path_cost(task, inner, path.penalty, sizes.samples, curved=False).gradient

    nowhere = jnp.zeros((sizes.control - 2, body.size), q_start.dtype)
    inner, facts = jax.lax.custom_root(slope, nowhere, search, _solve_symmetric, has_aux=True)
    # facts that are no numbers: the rule of derivatives wants floats
    return judge_arm(task, inner, sizes, facts[0] > 0, facts[1].astype(jnp.int32))


def _solve_symmetric(times: Callable[[Inner], Inner], b: Inner) -> Inner:
    """The x of H x = b, H symmetric and given by its products."""

    def solve(times: Callable[[Inner], Inner], b: Inner) -> Inner:
        columns = jax.vmap(times)(jnp.eye(b.size, dtype=b.dtype).reshape(b.size, *b.shape))
        return jnp.linalg.solve(columns.reshape(b.size, b.size).T, b.reshape(-1)).reshape(b.shape)

    return jax.lax.custom_linear_solve(times, b, solve, symmetric=True)


def best_guess(task: ArmTask, found: Float[Array, "guess inner joint"], sizes: ArmPlanSizes) -> Int[Array, ""]:
    """Index of the best path: one that keeps its distances before one that does not, then the least cost; of equal ones the
    first."""
    costs = jax.vmap(lambda inner: path_cost(task, inner, task.path.penalty, sizes.samples, curved=False)[:2])(found)
    cost = jnp.where(jnp.isfinite(costs[0]), costs[0], jnp.inf)
    fails = ~(costs[1] <= task.path.tolerance)
    rank = jnp.where(fails, 1, 0)
    eligible = rank == jnp.min(rank)
    least = jnp.min(jnp.where(eligible, cost, jnp.inf))
    return jnp.argmax(eligible & (cost <= least * (1 + _SAME))).astype(jnp.int32)
