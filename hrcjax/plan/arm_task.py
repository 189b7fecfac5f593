"""A planning problem of the arm with everything that stays the same over the iterations."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from hrcjax.numerics import safe_norm
from hrcjax.plan.arm_params import ArmPathParams
from hrcjax.plan.arm_potential import places_along, surface_gaps
from hrcjax.plan.body import PlanBody
from hrcjax.plan.half_spaces import attainable_gap
from hrcjax.plan.params import PotentialParams
from hrcjax.plan.potential import DistancesFn
from hrcjax.typing import Array, Float, Joints, Vector3


class Gaps(NamedTuple):
    """What is kept free in some configurations [m]. The configuration is the last axis, so that sums over spheres and
    obstacles run over whole vectors."""

    obstacles: Float[Array, "exposed obstacle sample"]
    """Between surfaces."""
    floor: Float[Array, "exposed sample"]
    """Infinite where a sphere may be below it."""
    spheres: Float[Array, "row column sample"]
    """Between the surfaces of two spheres of the body, to first order; infinite for pairs that may touch."""
    lower: Float[Array, "3 sample"]
    upper: Float[Array, "3 sample"]


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
    at_ends: Gaps
    """At start and goal."""
    straight: Float[Array, ""]
    """Length of the straight way between the ends of z [m]."""


def body_gaps(
    body: PlanBody,
    points: Float[Array, "point 3 sample"],
    tool: Float[Array, "3 sample"],
    obstacles: Float[Array, "exposed obstacle sample"],
    lower: Vector3,
    upper: Vector3,
) -> Gaps:
    """The gaps of configurations whose spheres have these distances from obstacles."""
    dtype = points.dtype
    floor = -jnp.inf if body.floor is None else body.floor
    above = points[body.still :, 2] - jnp.asarray(body.radii[body.still :] + floor, dtype)[:, None]
    rows, column, apart = body.pairs
    away = [points[:rows, None, k] - points[None, column:, k] for k in range(3)]
    squared = away[0] * away[0] + away[1] * away[1] + away[2] * away[2]
    facing = (apart > 0)[..., None]
    needed = jnp.asarray(np.where(facing, apart[..., None], 1), dtype)
    between = squared / (2 * needed) - needed / 2  # (d^2 - a^2) / 2a = d - a, to first order
    return Gaps(
        obstacles=obstacles,
        floor=jnp.where(jnp.asarray(body.above_floor)[:, None], above, jnp.inf),
        spheres=jnp.where(jnp.asarray(facing), between, jnp.inf),
        lower=tool - lower[:, None],
        upper=upper[:, None] - tool,
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
    q = jnp.stack([q_start, q_goal])
    ends = places_along(body, q)
    obstacles = surface_gaps(body, ends.points, distances)
    gaps = body_gaps(body, ends.points, ends.tool, obstacles, lower, upper)
    z = z_curve(path, ends.tool.T, q)
    return ArmTask(
        path, potential, body, q_start, q_goal, ends.tool[:, 1], distances, radius, lower, upper, gaps, safe_norm(z[1] - z[0])
    )  # fmt: skip


def allowed_gaps(task: ArmTask, place: Float[Array, "sample"]) -> Gaps:
    """What must be kept free at places along the path, 0 at the start and 1 at the goal [m].

    Where less is free at an end, it opens from there with the distance along the straight way.
    """
    zeta, dtype = task.potential.zeta, place.dtype
    required = Gaps(
        (zeta - 1) * task.radius,
        jnp.zeros(1, dtype),
        jnp.asarray(task.path.self_gap, dtype),
        *[jnp.zeros(1, dtype)] * 2,
    )

    inner = 1 - 2 * jnp.asarray(task.path.opening_from, dtype)
    inside = jnp.clip((place - task.path.opening_from) / inner, 0, 1)

    def attainable(required: Array, ends: Array) -> Array:
        asked = jnp.broadcast_to(required, ends.shape[:-1])
        return attainable_gap(asked, ends[..., 0], ends[..., 1], task.path.opening, task.straight * inner, inside)

    return Gaps(*(attainable(*both) for both in zip(required, task.at_ends, strict=True)))
