"""The potential field of a whole arm in its configurations: attraction of the tool, repulsion of every sphere.

Source: Robotica 2025, section 2.3, which defines U(q) for a robot's configuration q. The point robot of its tables is the
case of one sphere of radius 0.
"""

import jax
import jax.numpy as jnp

from hrcjax.plan.body import PlanBody
from hrcjax.plan.params import PotentialParams
from hrcjax.plan.potential import DistancesFn, attractive_potential, d_factor, repulsive_potentials
from hrcjax.robot.ik import LEVER, rotation_error
from hrcjax.typing import Array, Float, Joints, Matrix3, Vector3


def surface_gaps(body: PlanBody, points: Float[Array, "point 3"], distances: DistancesFn) -> Float[Array, "exposed obstacle"]:
    """Distance of the surface of every exposed sphere to every obstacle [m]."""
    radii = jnp.asarray(body.radii[: body.exposed], points.dtype)
    return jax.vmap(distances)(points[: body.exposed]) - radii[:, None]


def arm_repulsion(
    params: PotentialParams,
    body: PlanBody,
    gaps: Float[Array, "exposed obstacle"],
    radius: Float[Array, "obstacle"],
    factor: Float[Array, ""],
) -> Float[Array, ""]:
    """Sum of the repulsive potentials of all spheres [m^2/step].

    Every sphere counts by the length of link that it stands for, so that the sum does not depend on how densely a link is
    covered: 10 cm of link repel as one point does.

    Args:
        gaps: surface distances [m].
        radius: of the obstacles; each repels within zeta times this [m].
        factor: the d_factor [m^n].
    """
    each = jax.vmap(lambda rho: repulsive_potentials(params, rho, params.zeta * radius, factor))(gaps)  # eq. 3b
    return jnp.sum(jnp.asarray(body.weights, gaps.dtype)[:, None] * each)


def arm_potential(
    params: PotentialParams,
    body: PlanBody,
    q: Joints,
    goal: Vector3,
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    scaled: bool = True,
    goal_axes: Matrix3 | None = None,
) -> Float[Array, ""]:
    """U(q): potential of goal and obstacles [m^2/step].

    Args:
        q: configuration [rad].
        goal: of the tool point [m].
        radius: radius of each obstacle [m].
        scaled: False leaves out the d_factor.
        goal_axes: axes of the tool at the goal: turned away by an angle a it is attracted as from LEVER a; None: any will do.

    Raises:
        ValueError: axes are given, and the body has none.
    """
    places = body.places(q)
    attraction = attractive_potential(params, places.tool, goal)
    if goal_axes is not None:
        if body.rotation is None:
            raise ValueError("goal_axes are given, and the tool of this body has no axes; leave them out")
        error = LEVER * rotation_error(goal_axes, body.rotation(q))
        attraction = attraction + params.k_att * jnp.sum(error * error) / 2
    gaps = surface_gaps(body, places.points, distances)
    return attraction + arm_repulsion(params, body, gaps, radius, d_factor(params, places.tool, goal, scaled))  # eq. 1b


def arm_force(
    params: PotentialParams,
    body: PlanBody,
    q: Joints,
    goal: Vector3,
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    scaled: bool = True,
    goal_axes: Matrix3 | None = None,
) -> Joints:
    """Minus the gradient of U by q [m^2/(step rad)]."""
    return -jax.grad(arm_potential, argnums=2)(params, body, q, goal, distances, radius, scaled, goal_axes)


def attraction_left(params: PotentialParams, tool: Vector3, goal: Vector3) -> Float[Array, ""]:
    """Attraction, and that of the arrival distance, so that it is nowhere 0 [m^2/step]."""
    arrival = jnp.asarray(params.arrival, tool.dtype)
    return attractive_potential(params, tool, goal) + params.k_att * arrival * arrival / 2


def repulsion_ratio(
    params: PotentialParams,
    body: PlanBody,
    q: Joints,
    goal: Vector3,
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
) -> Float[Array, ""]:
    """Repulsion over attraction, U_rep / (U_att + K_att arrival^2 / 2): what slows and bends the path here [1]."""
    places = body.places(q)
    gaps = surface_gaps(body, places.points, distances)
    repulsion = arm_repulsion(params, body, gaps, radius, d_factor(params, places.tool, goal))
    return repulsion / attraction_left(params, places.tool, goal)
