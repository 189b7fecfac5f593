"""The improved artificial potential field: one scalar, whose gradient is the force.

Source: Robotica 2025, section 2.3. Misprints corrected here: the far branch of eq. 2e is continuous only at d* = 1 as
printed; the factor of eq. 3a is printed with the start, a constant, where the current configuration belongs (Ge and
Cui 2000); eqs. 2c, 3c and 3f, the forces, need no correction because they are taken as the gradient.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp

from hrcjax.numerics import require_floating, safe_divide, safe_norm, safe_sqrt
from hrcjax.plan.params import PotentialParams
from hrcjax.typing import Array, Float, Scalar, Vector3

DistancesFn = Callable[[Vector3], Float[Array, "obstacle"]]
"""Signed distances to the surfaces of all obstacles: point [m] -> distances [m]; an absent obstacle is far away."""


def inverse_distance(rho: Float[Array, "obstacle"], rho_min: Scalar) -> Float[Array, "obstacle"]:
    """1 / rho, continued by its tangent below rho_min: it keeps growing with depth inside an obstacle [1/m].

    Not finite if: rho_min is 0.
    """
    rho_min = jnp.asarray(rho_min, rho.dtype)
    near = rho < rho_min
    return jnp.where(near, 2 / rho_min - rho / (rho_min * rho_min), 1 / jnp.where(near, rho_min, rho))


def attractive_potential(params: PotentialParams, q: Vector3, goal: Vector3) -> Float[Array, ""]:
    """Potential of the goal: quadratic near it, linear beyond d_star, smooth between [m^2/step]."""
    offset = q - goal
    squared = jnp.sum(offset * offset)
    d_star = jnp.asarray(params.d_star, q.dtype)
    linear = d_star * safe_norm(offset) - d_star * d_star / 2
    return params.k_att * jnp.where(squared <= d_star * d_star, squared / 2, linear)  # eq. 2e


def d_factor(params: PotentialParams, q: Vector3, goal: Vector3, scaled: bool = True) -> Float[Array, ""]:
    """Factor |q - goal|^n that fades repulsion at the goal; 1 if not scaled (the paper's flag) [m^n]."""
    offset = q - goal
    squared = jnp.sum(offset * offset)
    away = squared > 0
    power = jnp.where(away, squared, 1) ** (jnp.asarray(params.exponent, q.dtype) / 2)
    return jnp.where(away, power, 0) if scaled else jnp.ones((), q.dtype)  # eq. 3a


def repulsive_potentials(
    params: PotentialParams,
    rho: Float[Array, "obstacle"],
    influence: Float[Array, "obstacle"],
    factor: Float[Array, ""],
) -> Float[Array, "obstacle"]:
    """Potential of each obstacle [m^2/step].

    Args:
        rho: signed surface distances [m].
        influence: surface distance where repulsion begins; 0 is never [m].
        factor: the d_factor [m^n].
    """
    excess = inverse_distance(rho, params.rho_min) - safe_divide(jnp.ones_like(influence), influence)
    return jnp.where(rho < influence, params.k_rep * excess * excess * factor / 2, 0)  # eq. 3b


def potential(
    params: PotentialParams,
    q: Vector3,
    goal: Vector3,
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    scaled: bool = True,
) -> Float[Array, ""]:
    """Potential of goal and obstacles at q; minus its gradient is the displacement of one step [m^2/step].

    Args:
        radius: radius of each obstacle; it repels within zeta times this of its surface [m].
        scaled: False leaves out the d_factor.
    """
    require_floating("potential", q=q, goal=goal)
    factor = d_factor(params, q, goal, scaled)
    repulsive = repulsive_potentials(params, distances(q), params.zeta * radius, factor)
    return attractive_potential(params, q, goal) + jnp.sum(repulsive)  # eq. 1b


def force(
    params: PotentialParams,
    q: Vector3,
    goal: Vector3,
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    scaled: bool = True,
) -> Vector3:
    """Minus the gradient of the potential: the displacement of one step [m/step]."""
    return -jax.grad(potential, argnums=1)(params, q, goal, distances, radius, scaled)  # eqs. 2f, 3d-3g, 4a


def limited(step: Vector3, longest: Scalar) -> Vector3:
    """The step, shortened to the longest allowed [m]."""
    squared = jnp.sum(step * step)
    longest = jnp.asarray(longest, step.dtype)
    long = squared > longest * longest
    return step * jnp.where(long, longest / safe_sqrt(jnp.where(long, squared, 1)), 1)
