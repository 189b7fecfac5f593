"""The path optimiser of the whole arm: Gauss-Newton steps on the control points of a spline in joint space."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.plan.arm_params import ArmPlanSizes
from hrcjax.plan.arm_task import ArmTask, z_curve
from hrcjax.plan.arm_terms import motion_along, terms
from hrcjax.plan.joint_spline import spline_matrix
from hrcjax.plan.objective import length_and_bending
from hrcjax.typing import Array, Float, Scalar

Inner = Float[Array, "inner joint"]
"""Control points between start and goal [rad]."""


class PathCost(NamedTuple):
    """The cost of a path with its derivatives by the control points between the ends."""

    cost: Float[Array, ""]
    """omega1 L + omega2 B + omega3 integral of the ratio + penalties."""
    violation: Float[Array, ""]
    """Most that a constraint is missed by at a sample [m]."""
    gradient: Float[Array, "inner joint"]
    matrix: Float[Array, "unknown unknown"]
    """Gauss-Newton's, positive semi-definite; empty if not asked for."""


def samples_of(task: ArmTask, inner: Inner, samples: int) -> Float[Array, "sample joint"]:
    """Configurations along the path, its ends among them [rad]."""
    control = jnp.concatenate([task.q_start[None], inner, task.q_goal[None]])
    S = spline_matrix(control.shape[0], np.linspace(0, 1, samples))
    return jnp.asarray(S, inner.dtype) @ control


def path_cost(task: ArmTask, inner: Inner, stiffness: Scalar, samples: int, curved: bool = True) -> PathCost:
    """The cost of a path.

    Args:
        stiffness: of the penalties [1/m].
        samples: number of configurations.
        curved: whether the matrix is asked for.
    """
    path, dtype = task.path, inner.dtype
    control = inner.shape[0] + 2
    S = jnp.asarray(spline_matrix(control, np.linspace(0, 1, samples))[:, 1:-1], dtype)
    q = samples_of(task, inner, samples)
    motion = motion_along(task.body, q)
    z = z_curve(path, motion.tool.T, q)
    length, bending, length_gradient, bending_gradient = length_and_bending(z)

    # trapezoidal rule: the ends count half
    share = jnp.asarray(np.r_[0.5, np.ones(samples - 2), 0.5] / (samples - 1), dtype)
    places = jnp.asarray(np.linspace(0, 1, samples), dtype)
    found = terms(task, motion, q, places, path.omega3 * length * share, stiffness / samples, curved)
    mean_ratio = jnp.sum(share * found.ratio)
    cost = (path.omega1 + path.omega3 * mean_ratio) * length + path.omega2 * bending
    cost = cost + stiffness / samples * found.penalty

    # gradient by z, then by q, then by the control points
    by_z = (path.omega1 + path.omega3 * mean_ratio - 3 * path.omega2 * bending / length) * length_gradient
    by_z = jnp.pad(by_z + path.omega2 * bending_gradient, ((1, 1), (0, 0)))
    by_tool = path.tool_weight * jnp.sum(by_z[:, :3].T[:, None] * motion.J_tool, axis=0)
    by_q = found.gradient + by_tool + path.joint_weight * by_z[:, 3:].T
    gradient = (by_q @ S).T

    if not curved:
        return PathCost(cost, found.violation, gradient, jnp.zeros((0, 0), dtype))
    steps = samples - 1
    a = (path.omega1 + path.omega3 * mean_ratio) * steps / length
    b = 2 * path.omega2 * steps**3 / length**3
    matrix = _curve_matrix(task, motion.J_tool, a, b, S) + _sample_matrix(found.curvature, S)
    return PathCost(cost, found.violation, gradient, matrix.reshape(inner.size, inner.size))


def _curve_matrix(
    task: ArmTask, J_tool: Float[Array, "3 joint sample"], a: Array, b: Array, S: Float[Array, "sample inner"]
) -> Float[Array, "inner joint inner joint"]:
    """Second derivatives of a |first differences of z|^2 / 2 + b |second differences of z|^2 / 2, z linear in the joints."""
    path, n, inner = task.path, J_tool.shape[1], S.shape[1]
    rows = path.tool_weight * J_tool[:, :, None] * S.T
    first = jnp.diff(rows, axis=-1)
    second = jnp.diff(first, axis=-1)
    wide = jnp.concatenate([jnp.sqrt(a) * first, jnp.sqrt(b) * second], axis=-1)  # (3 joint inner difference)
    wide = wide.transpose(2, 1, 0, 3).reshape(inner * n, -1)
    tool = (wide @ wide.T).reshape(inner, n, inner, n)
    D = jnp.diff(S, axis=0)
    E = jnp.diff(D, axis=0)
    joints = path.joint_weight**2 * (a * (D.T @ D) + b * (E.T @ E))
    return tool + joints[:, None, :, None] * jnp.eye(n, dtype=S.dtype)[:, None, :]


def _sample_matrix(
    curvature: Float[Array, "joint joint sample"], S: Float[Array, "sample inner"]
) -> Float[Array, "inner joint inner joint"]:
    """The curvatures of the samples, brought to the control points."""
    samples, inner, n = *S.shape, curvature.shape[0]
    pairs = (S[:, :, None] * S[:, None, :]).reshape(samples, inner * inner)
    both = curvature.reshape(n * n, samples) @ pairs
    return both.reshape(n, n, inner, inner).transpose(2, 0, 3, 1)


def damped_solve(matrix: Array | None, gradient: Inner, damping: Scalar) -> Inner:
    """Minus the inverse of the matrix, with its diagonal grown, times the gradient [rad]."""
    if matrix is None:
        raise ValueError("a cost without its matrix; accepted: one that was asked for with `curved`")
    size = matrix.shape[0]
    diagonal = jnp.diagonal(matrix)
    grown = matrix + jnp.diag(damping * (diagonal + 1e-6 * jnp.max(diagonal)))
    factor = jnp.linalg.cholesky(grown)
    half = jax.scipy.linalg.solve_triangular(factor, gradient.reshape(size), lower=True)
    return -jax.scipy.linalg.solve_triangular(factor, half, lower=True, trans=1).reshape(gradient.shape)


def no_longer(move: Inner, longest: Scalar) -> Inner:
    """The move, scaled down so that no control point moves farther than the longest allowed [rad]."""
    squared = jnp.max(jnp.sum(move * move, axis=-1))
    longest = jnp.asarray(longest, move.dtype)
    far = squared > longest * longest
    return move * jnp.where(far, longest / jnp.sqrt(jnp.where(far, squared, 1)), 1)


def ramped(task: ArmTask, inner: Inner, sizes: ArmPlanSizes) -> Inner:
    """Gauss-Newton steps from a guess while the penalty stiffens to its last value [rad]."""
    path, dtype = task.path, inner.dtype
    part = jnp.minimum(jnp.linspace(0, 1.25, sizes.iterations, dtype=dtype), 1)
    stiffness = path.penalty * jnp.asarray(path.penalty_first, dtype) ** (1 - part)

    def step(inner: Inner, stiffness: Array) -> tuple[Inner, None]:
        found = path_cost(task, inner, stiffness, sizes.samples)
        move = damped_solve(found.matrix, found.gradient, path.damping)
        return inner + no_longer(move, path.move_max), None

    return jax.lax.scan(step, inner, stiffness)[0]


def _is_better(there: PathCost, at: PathCost) -> Array:
    """Less cost or, where costs are equal to rounding, a smaller gradient: cost alone tells the optimum to half the digits."""
    rounding = 64 * jnp.finfo(at.cost.dtype).eps * jnp.abs(at.cost)
    flatter = jnp.sum(there.gradient**2) < jnp.sum(at.gradient**2)
    return (there.cost < at.cost - rounding) | ((there.cost <= at.cost + rounding) & flatter)


def polished(task: ArmTask, inner: Inner, sizes: ArmPlanSizes) -> Inner:
    """Levenberg-Marquardt steps at the last stiffness, until they are as small as rounding: a step that does not help is not taken
    [rad]. A path that is off by 1e-5 rad has a cost off by 1e-10, but its change with the parameters is off by some 1e-2."""
    path, samples = task.path, sizes.samples

    def evaluate(inner: Inner) -> PathCost:
        return path_cost(task, inner, path.penalty, samples)

    rounding = 16 * jnp.finfo(inner.dtype).eps

    def going(carry: tuple[Array, Array, Inner, PathCost, Array]) -> Array:
        return (carry[0] < sizes.polish) & (carry[1] > rounding)

    def step(carry: tuple[Array, Array, Inner, PathCost, Array]) -> tuple[Array, Array, Inner, PathCost, Array]:
        count, _, inner, at, damping = carry
        move = no_longer(damped_solve(at.matrix, at.gradient, damping), path.move_max)
        tried = inner + move
        there = evaluate(tried)
        better = _is_better(there, at)
        damping = jnp.clip(jnp.where(better, damping / 5, damping * 5), 1e-9, 1e3)
        kept = jax.tree.map(lambda new, old: jnp.where(better, new, old), (tried, there), (inner, at))
        return count + 1, jnp.max(jnp.abs(move)), *kept, damping

    start = (
        jnp.asarray(0),
        jnp.asarray(jnp.inf, inner.dtype),
        inner,
        evaluate(inner),
        jnp.asarray(path.damping, inner.dtype),
    )
    return jax.lax.while_loop(going, step, start)[2]
