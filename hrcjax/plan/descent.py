"""Descent of the potential field in unit steps, and the time to goal of the paper's tables."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.numerics import ldl_factor, ldl_solve, require_floating, safe_norm
from hrcjax.plan.params import PotentialParams
from hrcjax.plan.potential import (
    DistancesFn,
    attractive_potential,
    d_factor,
    force,
    limited,
    repulsive_potentials,
)
from hrcjax.typing import Array, Bool, Float, Int, Vector3

StepFn = Callable[[PotentialParams, Vector3, Vector3, DistancesFn, Float[Array, "obstacle"]], Vector3]
"""(params, q, goal, distances, radius) -> displacement of one step [m]."""

STEP_TIME = 1 / 30
"""Duration of one step in the paper's protocol, inferred from its tables [s]."""


class PotentialPath(eqx.Module):
    """What the descent did."""

    waypoints: Float[Array, "waypoint 3"]
    """Start and the point after each step [m]."""
    reached: Bool[Array, ""]
    """Whether the goal came within the arrival distance."""
    arrival: Int[Array, ""]
    """Number of the first step that ended there; the number of steps if none did."""


def unit_step(
    params: PotentialParams, q: Vector3, goal: Vector3, distances: DistancesFn, radius: Float[Array, "obstacle"]
) -> Vector3:
    """The force itself as displacement, q <- q + F, as in the paper; it swings where repulsion is stiff [m]."""
    return limited(force(params, q, goal, distances, radius), params.step_max)


def damped_step(
    params: PotentialParams, q: Vector3, goal: Vector3, distances: DistancesFn, radius: Float[Array, "obstacle"]
) -> Vector3:
    """The force divided by 1 + stiffness along the normals of the obstacles: one linearly implicit step [m].

    Equal to the unit step where repulsion is soft; does not swing where it is stiff, and slides along at full speed.
    """
    influence = params.zeta * radius
    rho, normals = jax.vmap(lambda e: jax.jvp(distances, (q,), (e,)), out_axes=(None, 0))(jnp.eye(3, dtype=q.dtype))

    def energy(q: Vector3, rho: Float[Array, "obstacle"]) -> Float[Array, ""]:
        repulsive = repulsive_potentials(params, rho, influence, d_factor(params, q, goal))
        return attractive_potential(params, q, goal) + jnp.sum(repulsive)

    (by_point, by_distance), (_, stiffness) = jax.jvp(
        jax.grad(energy, argnums=(0, 1)), (q, rho), (jnp.zeros_like(q), jnp.ones_like(rho))
    )
    forward = [-by_point[i] - jnp.sum(by_distance * normals[i]) for i in range(3)]
    system = [[float(i == j) + jnp.sum(stiffness * normals[i] * normals[j]) for j in range(i + 1)] for i in range(3)]
    return limited(jnp.stack(ldl_solve(*ldl_factor(system), forward)), params.step_max)


def potential_path(
    params: PotentialParams,
    start: Vector3,
    goal: Vector3,
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    steps: int,
    step: StepFn = damped_step,
) -> PotentialPath:
    """Points of the descent of the potential field from start, for a fixed number of steps.

    Args:
        radius: radius of each obstacle [m].
        step: rule of one step.

    Raises:
        ValueError: steps < 1.
    """
    require_floating("potential_path", start=start, goal=goal)
    if steps < 1:
        raise ValueError(f"steps is {steps}; accepted is 1 or more")

    def advance(q: Vector3, _: None) -> tuple[Vector3, Vector3]:
        q = q + step(params, q, goal, distances, radius)
        return q, q

    points = jax.lax.scan(jax.checkpoint(advance), start, None, length=steps)[1]
    there = safe_norm(points - goal) < params.arrival
    reached = jnp.any(there)
    arrival = jnp.where(reached, jnp.argmax(there) + 1, steps)
    return PotentialPath(jnp.concatenate([start[None], points]), reached, arrival.astype(jnp.int32))


def time_to_goal(
    params: PotentialParams,
    start: Vector3,
    goal: Vector3,
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    steps: int,
    step: StepFn = unit_step,
) -> Float[Array, ""]:
    """Time until the goal is within the arrival distance, in the paper's clock of 30 steps a second [s].

    Between the last two steps the logarithm of the distance is interpolated. Infinite if the steps do not suffice.
    """
    path = potential_path(params, start, goal, distances, radius, steps, step)
    tiny = jnp.finfo(start.dtype).tiny
    logs = jnp.log(jnp.maximum(safe_norm(path.waypoints - goal), tiny))
    before, after = logs[path.arrival - 1], logs[path.arrival]
    fall = jnp.where(path.reached, before - after, 1)
    part = jnp.where(path.reached, before - jnp.log(jnp.asarray(params.arrival, start.dtype)), 0) / fall
    time = (path.arrival.astype(start.dtype) - 1 + part) * STEP_TIME
    return jnp.where(
        path.reached, jnp.where(logs[0] <= jnp.log(jnp.asarray(params.arrival, start.dtype)), 0, time), jnp.inf
    )
