"""First guesses of a path in joint space: several at once, as which side of an obstacle is the right one is not known."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.numerics import safe_divide, safe_norm
from hrcjax.plan.arm_optimise import Inner, no_longer
from hrcjax.plan.arm_params import ArmPlanSizes
from hrcjax.plan.arm_potential import arm_repulsions
from hrcjax.plan.arm_task import ArmTask, z_curve
from hrcjax.plan.arm_terms import gaps_and_normals
from hrcjax.plan.joint_spline import control_places, fit_matrix
from hrcjax.plan.potential import attractive_potential, d_factor
from hrcjax.typing import Array, Bool, Float, Joints, Vector3

_FRACTION = 0.15
"""Part of the way to the goal that one step of the descent covers where nothing repels [1]."""
_LEAST_EXTENT = 0.5
"""Detours are in proportion to the straight line's length, or to this if it is longer [rad]."""


class Descent(NamedTuple):
    """What the descent of the potential found."""

    joints: Float[Array, "waypoint joint"]
    reached: Bool[Array, ""]
    """Whether the tool came within the arrival distance of the goal."""


def descend(task: ArmTask, steps: int) -> Descent:
    """Configurations of the descent of U(q) from the start, in damped steps.

    The direction is that of the field; the step is that of a linearly implicit one, in which attraction alone covers a
    fixed part of the way, so that K_att does not decide how far it gets. The joints are drawn to the goal as the tool is,
    by their weight in z.
    """
    p, path, body, dtype = task.potential, task.path, task.body, task.q_start.dtype
    n = body.size
    tool_weight, joint_weight = jnp.asarray(path.tool_weight, dtype) ** 2, jnp.asarray(path.joint_weight, dtype) ** 2

    def advance(q: Joints, _: None) -> tuple[Joints, tuple[Joints, Array]]:
        motion = body.motion(q)
        J = motion.J[body.still :]
        raw, normal = gaps_and_normals(task.distances, motion.points[body.still :, :, None])
        gaps = raw - jnp.asarray(body.radii[body.still :], dtype)[:, None, None]
        normal = normal[..., 0]

        def energy(tool: Vector3, gaps: Array) -> Array:
            repulsive = d_factor(p, tool, task.goal) * jnp.sum(arm_repulsions(p, body, gaps, task.radius))
            return (attractive_potential(p, tool, task.goal) + repulsive) / p.k_att

        (by_tool, by_gap), (_, stiff) = jax.jvp(
            jax.grad(energy, argnums=(0, 1)), (motion.tool, gaps), (jnp.zeros(3, dtype), jnp.ones_like(gaps))
        )
        force = -by_tool @ motion.J_tool - joint_weight * (q - task.q_goal)
        force = force - jnp.einsum("po,kpo,pkj->j", by_gap[..., 0], normal, J)
        along = jnp.einsum("kpo,pkj->poj", normal, J)
        metric = tool_weight * motion.J_tool.T @ motion.J_tool + joint_weight * jnp.eye(n, dtype=dtype)
        metric = metric + jnp.einsum("po,poi,poj->ij", stiff[..., 0], along, along)
        grown = metric + 1e-6 * jnp.trace(metric) * jnp.eye(n, dtype=dtype)
        step = _FRACTION * jax.scipy.linalg.cho_solve(jax.scipy.linalg.cho_factor(grown), force)
        move = z_curve(path, motion.J_tool @ step, step)
        long = safe_norm(move)
        step = step * jnp.minimum(1, safe_divide(jnp.asarray(p.step_max, dtype), long, 1.0))
        q = q + step
        return q, (q, body.places(q).tool)

    _, (joints, tools) = jax.lax.scan(advance, task.q_start, None, length=steps)
    reached = jnp.any(safe_norm(tools - task.goal) < p.arrival)
    return Descent(joints, reached)


def fitted(task: ArmTask, joints: Float[Array, "waypoint joint"], sizes: ArmPlanSizes) -> Inner:
    """Control points of the spline nearest to a path: spread by length in z [rad]."""
    z = z_curve(task.path, jax.vmap(task.body.places)(joints).tool, joints)
    lengths = safe_norm(jnp.diff(z, axis=0))
    ends = jnp.cumsum(lengths)
    at = ends[-1] * jnp.linspace(0, 1, sizes.samples, dtype=joints.dtype)
    index = jnp.minimum(jnp.sum(ends[None, :] < at[:, None], axis=1), lengths.shape[0] - 1)
    part = jnp.clip(safe_divide(at - (ends[index] - lengths[index]), lengths[index]), 0, 1)[:, None]
    even = joints[index] + part * (joints[index + 1] - joints[index])
    return jnp.asarray(fit_matrix(sizes.control, np.linspace(0, 1, sizes.samples)), joints.dtype) @ even


def descent_guess(task: ArmTask, sizes: ArmPlanSizes) -> tuple[Inner, Bool[Array, ""]]:
    """The descent of the potential, closed to the goal by a straight line, and whether it got there by itself."""
    found = descend(task, sizes.descent)
    closing = jnp.linspace(0, 1, 8, dtype=task.q_start.dtype)[1:, None]
    last = found.joints[-1]
    joints = jnp.concatenate([task.q_start[None], found.joints, last + closing * (task.q_goal - last)])
    return fitted(task, joints, sizes), found.reached


def _lifted(task: ArmTask, direction: Vector3, height: Array) -> Joints:
    """How the middle of the straight line must move so that the tool is lifted: damped least squares [rad]."""
    middle = (task.q_start + task.q_goal) / 2
    target = task.body.places(middle).tool + height * direction
    dtype = middle.dtype

    def step(q: Joints, _: None) -> tuple[Joints, None]:
        at = task.body.motion(q)
        J = at.J_tool
        grown = J @ J.T + 1e-3 * jnp.eye(3, dtype=dtype)
        move = J.T @ jnp.linalg.solve(grown, target - at.tool)
        return q + no_longer(move[None], 0.4)[0], None

    q = jax.lax.scan(step, middle, None, length=6)[0]
    low, high = jnp.asarray(task.body.q_min, dtype), jnp.asarray(task.body.q_max, dtype)
    return jnp.clip(q, low, high) - middle


def arches(task: ArmTask) -> Float[Array, "3 joint"]:
    """Changes of the middle configuration that lift the tool, or take it to the left or to the right [rad]."""
    start = task.body.places(task.q_start).tool
    along = task.goal - start
    dtype = along.dtype
    height = jnp.maximum(safe_norm(along) / 2, jnp.asarray(0.15, dtype))
    up = jnp.asarray([0.0, 0.0, 1.0], dtype)
    flat = jnp.asarray([1.0, 1.0, 0.0], dtype) * along
    across = jnp.cross(up, safe_divide(flat, safe_norm(flat)))
    room = jnp.maximum(task.upper[2] - jnp.maximum(start[2], task.goal[2]), 0)
    heights = jnp.stack([jnp.minimum(height, jnp.minimum(room, 10)), height, height])
    return jax.vmap(lambda d, h: _lifted(task, d, h))(jnp.stack([up, across, -across]), heights)


def straight_guess(task: ArmTask, sizes: ArmPlanSizes) -> Inner:
    """Control points of the straight line in the joints [rad]."""
    places = jnp.asarray(control_places(sizes.control)[1:-1], task.q_start.dtype)[:, None]
    return task.q_start + places * (task.q_goal - task.q_start)


def detours(count: int, size: int, control: int, seed: int = 0) -> np.ndarray:
    """Random smooth detours as changes of control points, (count inner joint): a half and a whole wave in every joint, of
    standard deviation 1 and 0.5."""
    rng = np.random.default_rng(seed)
    places = control_places(control)[1:-1]
    waves = np.stack([np.sin(np.pi * places), np.sin(2 * np.pi * places)])
    sizes = rng.standard_normal((count, 2, size)) * np.array([1.0, 0.5])[None, :, None]
    return np.einsum("cwj,wp->cpj", sizes, waves)


def detour_guesses(
    task: ArmTask, sizes: ArmPlanSizes, detours: Float[Array, "guess inner joint"]
) -> Float[Array, "guess inner joint"]:
    """The straight line with random detours in proportion to its length, within the ranges of the joints [rad]."""
    dtype = task.q_start.dtype
    extent = jnp.maximum(safe_norm(task.q_goal - task.q_start), jnp.asarray(_LEAST_EXTENT, dtype))
    low, high = jnp.asarray(task.body.q_min, dtype), jnp.asarray(task.body.q_max, dtype)
    return jnp.clip(straight_guess(task, sizes) + extent / task.body.size**0.5 * detours, low, high)


def guesses(task: ArmTask, sizes: ArmPlanSizes) -> tuple[Float[Array, "guess inner joint"], Bool[Array, ""]]:
    """Control points of all guesses [rad], and whether the descent of the potential reached the goal.

    In this order: straight line, descent, arch over the middle, arches to both sides, random detours.
    """
    dtype = task.q_start.dtype
    straight = straight_guess(task, sizes)
    descended, reached = descent_guess(task, sizes)
    found = [straight[None], descended[None]]
    if sizes.guesses > 2:
        hump = jnp.asarray(np.sin(np.pi * control_places(sizes.control)[1:-1]), dtype)[:, None]
        found.append(straight + hump * arches(task)[:, None, :])
    if sizes.guesses > 5:
        random = detours(sizes.guesses - 5, task.body.size, sizes.control)
        found.append(detour_guesses(task, sizes, jnp.asarray(random, dtype)))
    return jnp.concatenate(found)[: sizes.guesses], reached
