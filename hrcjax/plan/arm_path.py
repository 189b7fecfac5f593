"""A path of the arm, what it costs, and which of its constraints it keeps."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.bending_energy import bending_energy
from hrcjax.geom.length import length
from hrcjax.numerics import safe_divide, safe_norm
from hrcjax.plan.arm_optimise import Inner
from hrcjax.plan.arm_params import ArmPlanSizes
from hrcjax.plan.arm_potential import arm_repulsions, attraction_left, places_along, surface_gaps
from hrcjax.plan.arm_task import ArmTask, allowed_gaps, body_gaps, z_curve
from hrcjax.plan.arm_terms import beyond_range
from hrcjax.plan.joint_spline import joint_spline
from hrcjax.plan.potential import d_factor
from hrcjax.typing import Array, Bool, Float, Int, Vector3


class ArmPath(eqx.Module):
    """A path of the arm and what can be said of it."""

    joints: Float[Array, "*batch waypoint joint"]
    """Configurations, equally spaced in z, start and goal among them [rad]."""
    tool: Float[Array, "*batch waypoint 3"]
    """Tool point at these [m]."""
    length: Float[Array, "*batch"]
    """Length of the tool's path [m]."""
    bending_energy: Float[Array, "*batch"]
    """Bending energy of the tool's path [1/m]."""
    clearance: Float[Array, "*batch"]
    """Smallest distance of any sphere from any obstacle; negative inside [m]."""
    violation: Float[Array, "*batch"]
    """Most that the distance required from an obstacle, or attainable, is missed by; 0 if kept [m]."""
    ratio: Float[Array, "*batch waypoint"]
    """Repulsion over attraction at the waypoints [1]."""
    reached: Bool[Array, "*batch"]
    """Whether the descent of the potential alone reached the goal."""
    clear: Bool[Array, "*batch"]
    """Whether the distances required by zeta, and the floor, are kept."""
    inside: Bool[Array, "*batch"]
    """Whether the tool stays within the bounds, and the joints within their ranges."""
    free: Bool[Array, "*batch"]
    """Whether no two links touch that are not neighbours."""
    cost: Float[Array, "*batch"]
    """omega1 length + omega2 bending energy + omega3 integral of the ratio of the curve z, without penalties [m]."""
    guess: Int[Array, "*batch"]
    """Which of the first guesses led to it."""

    @property
    def status(self) -> Int[Array, "*batch"]:
        """Bits: 1 the descent reached the goal, 2 the required distances are kept, 4 within the bounds, 8 free of
        self-collision; 14 and 15 are success."""
        bits = [self.reached, self.clear, self.inside, self.free]
        return sum((bit.astype(jnp.int32) << k for k, bit in enumerate(bits)), jnp.zeros_like(bits[0], jnp.int32))


def even_waypoints(
    task: ArmTask, inner: Inner, count: int
) -> tuple[Float[Array, "count joint"], Float[Array, "count"]]:
    """Configurations at equal lengths of z along the spline [rad], and their places on it, 0 to 1."""
    spline = joint_spline(jnp.concatenate([task.q_start[None], inner, task.q_goal[None]]))
    fine = jnp.linspace(0, 1, 4 * (count - 1) + 1, dtype=inner.dtype)
    q = jax.vmap(spline)(fine)
    lengths = safe_norm(jnp.diff(z_curve(task.path, jax.vmap(task.body.places)(q).tool, q), axis=0))
    ends = jnp.cumsum(lengths)
    at = ends[-1] * jnp.linspace(0, 1, count, dtype=inner.dtype)[1:-1]
    index = jnp.minimum(jnp.sum(ends[None, :] <= at[:, None], axis=1), lengths.shape[0] - 1)
    part = safe_divide(at - (ends[index] - lengths[index]), lengths[index])
    places = jnp.pad((index.astype(inner.dtype) + part) / (fine.shape[0] - 1), 1).at[-1].set(1)
    joints = jax.vmap(spline)(places)
    return joints.at[0].set(task.q_start).at[-1].set(task.q_goal), places


def judge_arm(
    task: ArmTask, inner: Inner, sizes: ArmPlanSizes, reached: Bool[Array, ""], guess: Int[Array, ""]
) -> ArmPath:
    """What can be said of a path; distances are measured at the waypoints and midway between them."""
    path, potential, body = task.path, task.potential, task.body
    every = 2 * sizes.waypoints - 1
    q, places = even_waypoints(task, inner, every)

    at = places_along(body, q)
    obstacles = surface_gaps(body, at.points, task.distances)
    gaps = body_gaps(body, at.points, at.tool, obstacles, task.lower, task.upper)
    allowed = allowed_gaps(task, places)
    short = jnp.maximum(
        jnp.max(allowed.obstacles - gaps.obstacles, initial=0.0), jnp.max(allowed.floor - gaps.floor, initial=0.0)
    )
    outside = jnp.maximum(jnp.max(-gaps.lower), jnp.max(-gaps.upper))
    touching = jnp.max(jnp.minimum(allowed.spheres, 0) - gaps.spheres, initial=0.0)

    def fading(tool: Vector3) -> tuple[Array, Array]:
        return d_factor(potential, tool, task.goal), attraction_left(potential, tool, task.goal)

    tool = at.tool.T
    factor, attraction = jax.vmap(fading)(tool)
    ratio = factor * jnp.sum(arm_repulsions(potential, body, obstacles, task.radius), axis=(0, 1)) / attraction
    z = z_curve(path, tool, q)
    steps = safe_norm(jnp.diff(z, axis=0))
    line = jnp.sum(steps * (ratio[1:] + ratio[:-1]) / 2)
    return ArmPath(
        joints=q[::2],
        tool=tool[::2],
        length=length(tool),
        bending_energy=bending_energy(tool[::2]),
        clearance=jnp.min(obstacles, initial=jnp.inf),
        violation=short,
        ratio=ratio[::2],
        reached=reached,
        clear=short <= path.tolerance,
        inside=jnp.maximum(outside, jnp.max(jnp.stack(beyond_range(task, q)))) <= path.tolerance,
        free=touching <= path.tolerance,
        cost=path.omega1 * length(z) + path.omega2 * bending_energy(z[::2]) + path.omega3 * line,
        guess=guess,
    )
