"""The potential field of a whole arm in its configurations: attraction of the tool, repulsion of every sphere.

Source: Robotica 2025, section 2.3, which defines U(q) for a robot's configuration q. The point robot of its tables is the
case of one sphere of radius 0.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from hrcjax.plan.body import BodyPlaces, PlanBody
from hrcjax.plan.params import PotentialParams
from hrcjax.plan.potential import DistancesFn, attractive_potential, d_factor, repulsive_potentials
from hrcjax.robot.ik import LEVER, rotation_error
from hrcjax.typing import Array, Float, Joints, Matrix3, Vector3


class PlacesAlong(NamedTuple):
    """Where a body is in some configurations; the configuration is the last axis."""

    points: Float[Array, "point 3 sample"]
    """Centres of its spheres [m]."""
    tool: Float[Array, "3 sample"]
    """Tool points [m]."""


def places_along(body: PlanBody, q: Float[Array, "sample joint"]) -> PlacesAlong:
    """Where a body is in some configurations."""
    return PlacesAlong(*jax.vmap(body.places, out_axes=-1)(q))


def surface_gaps(
    body: PlanBody, points: Float[Array, "point 3 sample"], distances: DistancesFn
) -> Float[Array, "exposed obstacle sample"]:
    """Distance of the surface of every exposed sphere to every obstacle [m]."""
    radii = jnp.asarray(body.radii[body.still :], points.dtype)
    over_samples = jax.vmap(distances, in_axes=-1, out_axes=-1)
    return jax.vmap(over_samples)(points[body.still :]) - radii[:, None, None]


def arm_repulsions(
    params: PotentialParams,
    body: PlanBody,
    gaps: Float[Array, "exposed obstacle sample"],
    radius: Float[Array, "obstacle"],
) -> Float[Array, "exposed obstacle sample"]:
    """Repulsive potentials of all spheres and obstacles, without the d_factor [m^(2-n)/step].

    Every sphere counts by the length of link that it stands for, so that their sum does not depend on how densely a link is
    covered: 10 cm of link repel as one point does.

    Args:
        gaps: surface distances [m].
        radius: of the obstacles; each repels within zeta times this [m].
    """
    influence = jnp.broadcast_to((params.zeta * radius)[:, None], gaps.shape).reshape(-1)
    each = repulsive_potentials(params, gaps.reshape(-1), influence, jnp.ones((), gaps.dtype))  # eq. 3b
    return jnp.asarray(body.weights, gaps.dtype)[:, None, None] * each.reshape(gaps.shape)


def _repulsion(
    params: PotentialParams,
    body: PlanBody,
    places: BodyPlaces,
    goal: Vector3,
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    scaled: bool = True,
) -> Float[Array, ""]:
    """Repulsion of one configuration [m^2/step]."""
    gaps = surface_gaps(body, places.points[..., None], distances)
    return d_factor(params, places.tool, goal, scaled) * jnp.sum(arm_repulsions(params, body, gaps, radius))


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
    return attraction + _repulsion(params, body, places, goal, distances, radius, scaled)  # eq. 1b


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
    repulsion = _repulsion(params, body, places, goal, distances, radius)
    return repulsion / attraction_left(params, places.tool, goal)
