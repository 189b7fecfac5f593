"""A planning problem of the arm with everything that stays the same over the iterations."""

from typing import NamedTuple

import jax.numpy as jnp

from hrcjax.numerics import safe_norm
from hrcjax.plan.arm_params import ArmPathParams
from hrcjax.plan.arm_potential import surface_gaps
from hrcjax.plan.body import PlanBody
from hrcjax.plan.params import PotentialParams
from hrcjax.plan.potential import DistancesFn
from hrcjax.typing import Array, Float, Joints, Scalar, Vector3


class Gaps(NamedTuple):
    """What is kept free in one configuration [m]."""

    obstacles: Float[Array, "exposed obstacle"]
    floor: Float[Array, "exposed"]
    spheres: Float[Array, "point point"]
    """Between centres, over what two spheres need."""
    lower: Float[Array, "3"]
    upper: Float[Array, "3"]


class ArmTask(NamedTuple):
    """A problem: from one configuration to another among obstacles."""

    path: ArmPathParams
    potential: PotentialParams
    body: PlanBody
    q_start: Joints
    q_goal: Joints
    goal: Vector3
    """Tool point at the goal [m]."""
    distances: DistancesFn
    radius: Float[Array, "obstacle"]
    lower: Vector3
    upper: Vector3
    at_start: Gaps
    at_goal: Gaps
    straight: Float[Array, ""]
    """Length of the straight way between the ends of z [m]."""

    @property
    def required(self) -> Gaps:
        """What must be kept free, away from the ends [m]."""
        dtype = self.q_start.dtype
        zero = jnp.zeros(3, dtype)
        return Gaps(
            obstacles=jnp.broadcast_to((self.potential.zeta - 1) * self.radius, self.at_start.obstacles.shape),
            floor=jnp.zeros_like(self.at_start.floor),
            spheres=jnp.broadcast_to(jnp.asarray(self.path.self_gap, dtype), self.at_start.spheres.shape),
            lower=zero,
            upper=zero,
        )


def body_gaps(
    body: PlanBody, points: Float[Array, "point 3"], tool: Vector3, obstacles: Array, lower: Vector3, upper: Vector3
) -> Gaps:
    """The gaps of a configuration whose spheres have these distances from obstacles."""
    dtype = points.dtype
    floor = -jnp.inf if body.floor is None else body.floor
    above = points[: body.exposed, 2] - jnp.asarray(body.radii[: body.exposed] + floor, dtype)
    apart = jnp.asarray(body.apart, dtype)
    between = safe_norm(points[:, None] - points[None]) - apart
    return Gaps(
        obstacles=obstacles,
        floor=jnp.where(jnp.asarray(body.above_floor[: body.exposed]), above, jnp.inf),
        spheres=jnp.where(apart > 0, between, jnp.inf),
        lower=tool - lower,
        upper=upper - tool,
    )


def z_curve(path: ArmPathParams, tool: Float[Array, "*k 3"], q: Float[Array, "*k joint"]) -> Float[Array, "*k dim"]:
    """The points whose curve is measured: weighted tool points and joints [m]."""
    return jnp.concatenate([path.tool_weight * tool, path.joint_weight * q], axis=-1)


def arm_task(
    path: ArmPathParams,
    potential: PotentialParams,
    body: PlanBody,
    q_start: Joints,
    q_goal: Joints,
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    lower: Vector3,
    upper: Vector3,
) -> ArmTask:
    """The problem; arguments as `hrcjax.plan.arm_plan.plan_arm`."""
    first, last = body.places(q_start), body.places(q_goal)
    gaps = [
        body_gaps(body, at.points, at.tool, surface_gaps(body, at.points, distances), lower, upper) for at in (first, last)
    ]
    ends = z_curve(path, jnp.stack([first.tool, last.tool]), jnp.stack([q_start, q_goal]))
    straight = safe_norm(ends[1] - ends[0])
    return ArmTask(
        path, potential, body, q_start, q_goal, last.tool, distances, radius, lower, upper, *gaps, straight
    )  # fmt: skip


def allowed_gaps(task: ArmTask, place: Scalar) -> Gaps:
    """What must be kept free at a place along the path, 0 at the start and 1 at the goal [m].

    Where less is free at an end, it opens from there with the distance along the straight way.
    """
    grown = task.path.opening * task.straight * place
    whole = task.path.opening * task.straight

    def attainable(required: Array, start: Array, goal: Array) -> Array:
        return jnp.minimum(required, jnp.minimum(start + grown, goal + whole - grown))

    return Gaps(*(attainable(*three) for three in zip(task.required, task.at_start, task.at_goal, strict=True)))
