"""The paper's baseline: gradient descent of the plain potential field (Robotica 2025, section 3)."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.plan.descent import PotentialPath, potential_path
from hrcjax.plan.params import PotentialParams
from hrcjax.plan.potential import DistancesFn, force, limited
from hrcjax.typing import Array, Float, Vector3


class GradientDescentParams(eqx.Module):
    """Gradient descent with the numbers printed in the paper, which are in centimetres."""

    k_att: float = 1 / 150
    """Attraction [1/step]."""
    k_rep: float = 900e-8
    """Repulsion: 900 cm^4 a step [m^4/step]."""
    d0: float = 0.04
    """Surface distance where repulsion begins [m]."""
    rho_min: float = 0.005
    """Surface distance below which 1/rho is continued by its tangent [m]."""
    step_max: float = 0.05
    """Longest step [m]."""
    arrival: float = 0.01
    """Distance to the goal that counts as arrived [m]."""


def plain_potential(params: GradientDescentParams) -> PotentialParams:
    """The field that it descends, for obstacles of radius 1 and without the d_factor: quadratic attraction, repulsion within d0."""
    return eqx.tree_at(
        lambda p: (p.k_att, p.k_rep, p.zeta, p.d_star, p.rho_min, p.step_max, p.arrival),
        PotentialParams(),
        (params.k_att, params.k_rep, params.d0, 1e3, params.rho_min, params.step_max, params.arrival),
    )


def gradient_descent_path(
    params: GradientDescentParams,
    start: Vector3,
    goal: Vector3,
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    steps: int,
) -> PotentialPath:
    """Points of the descent with quadratic attraction, and a repulsion within d0 that does not fade at the goal.

    The paper's times for it, 7.5 s whatever K_att, do not follow from these numbers at its 30 steps a second.

    Args:
        radius: as the planner takes it; only its size counts here.

    Raises:
        ValueError: steps < 1.
    """

    def step(
        p: PotentialParams, q: Vector3, goal: Vector3, distances: DistancesFn, radius: Float[Array, "obstacle"]
    ) -> Vector3:
        return limited(force(p, q, goal, distances, jnp.ones_like(radius), scaled=False), p.step_max)

    return potential_path(plain_potential(params), start, goal, distances, radius, steps, step)
