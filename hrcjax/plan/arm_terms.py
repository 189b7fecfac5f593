"""Repulsion and constraints along a path: value, gradient and curvature by the joints of every configuration.

Configurations are the last axis of every array, so that sums over spheres and obstacles run over whole vectors.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike

from hrcjax.numerics import computed
from hrcjax.plan.arm_potential import arm_repulsions, attraction_left
from hrcjax.plan.arm_task import ArmTask, Gaps, allowed_gaps, body_gaps
from hrcjax.plan.body import BodyMotion, PlanBody
from hrcjax.plan.hinge import hinge
from hrcjax.plan.potential import DistancesFn, d_factor
from hrcjax.plan.stored import stored
from hrcjax.typing import Array, Float, Scalar, Vector3


class Terms(NamedTuple):
    """What repulsion and constraints add."""

    ratio: Float[Array, "sample"]
    """Repulsion over attraction [1]."""
    penalty: Float[Array, ""]
    """Of the constraints, summed over the samples [m^2]."""
    violation: Float[Array, ""]
    """Most that a constraint is missed by; negative: all are kept [m]."""
    gradient: Float[Array, "joint sample"]
    """Of sum ratio_weight ratio + stiffness penalty, by the joints."""
    curvature: Float[Array, "joint joint sample"]
    """Its positive semi-definite part; empty if not asked for."""


def motion_along(body: PlanBody, q: Float[Array, "sample joint"]) -> BodyMotion:
    """The body's motion in some configurations; they are the last axis."""
    return jax.vmap(body.motion, out_axes=-1)(q)


def gaps_and_normals(
    distances: DistancesFn, points: Float[Array, "point 3 sample"]
) -> tuple[Float[Array, "point obstacle sample"], Float[Array, "3 point obstacle sample"]]:
    """Distances of points to all obstacles [m], and their gradients [1]."""

    def one(x: Vector3) -> tuple[Float[Array, "obstacle"], Float[Array, "3 obstacle"]]:
        return jax.vmap(lambda e: jax.jvp(distances, (x,), (e,)), out_axes=(None, 0))(jnp.eye(3, dtype=x.dtype))

    return jax.vmap(jax.vmap(one, in_axes=-1, out_axes=-1), out_axes=(0, 1))(points)


def _repulsion(task: ArmTask, gaps: Array) -> tuple[Array, Array, Array]:
    """Repulsive potentials without the d_factor, with their first and second derivatives by the gaps."""
    one = jnp.ones_like(gaps)

    def value(gaps: Array) -> Array:
        return arm_repulsions(task.potential, task.body, gaps, task.radius)

    (energy, first), (_, second) = jax.jvp(lambda g: jax.jvp(value, (g,), (one,)), (gaps,), (one,))
    return energy, first, second


def _sums(weights: Array, normal: Array | list[Array], axis: int) -> list[list[Array]]:
    """Entries of the sums along an axis of weight n n^T, a 3 x 3 matrix."""
    return _symmetric(lambda i, j: jnp.sum(weights * normal[i] * normal[j], axis=axis), 3)


def _symmetric(entry: Callable[[int, int], Array], size: int) -> list[list[Array]]:
    """A symmetric matrix from the entries of its upper triangle."""
    upper = {(i, j): entry(i, j) for i in range(size) for j in range(i, size)}
    return [[upper[min(i, j), max(i, j)] for j in range(size)] for i in range(size)]


def violation_of(gaps: Gaps, allowed: Gaps) -> Float[Array, ""]:
    """Most that any gap is short of the allowed one; -1 at least [m]."""
    return jnp.max(jnp.stack([jnp.max(a - g, initial=-1.0) for g, a in zip(gaps, allowed, strict=True)]))


def beyond_range(task: ArmTask, q: Float[Array, "sample joint"]) -> tuple[Array, Array]:
    """How far every joint is below its range and above it, as a length; negative: within (joint sample) [m]."""
    lever = jnp.asarray(task.path.lever, q.dtype)
    low, high = jnp.asarray(task.body.q_min, q.dtype)[:, None], jnp.asarray(task.body.q_max, q.dtype)[:, None]
    return lever * (low - q.T), lever * (q.T - high)


def terms(
    task: ArmTask,
    motion: BodyMotion,
    q: Float[Array, "sample joint"],
    place: Float[Array, "sample"],
    ratio_weight: Float[Array, "sample"],
    stiffness: Scalar,
    curved: bool = True,
) -> Terms:
    """Repulsion and constraints along a path.

    Gradients are exact. The curvature leaves out that of the obstacles' surfaces and of the arm's motion, and bounds that
    of pairs of spheres, so that it is never negative.

    Args:
        motion: of the body, from `motion_along`.
        place: along the path, 0 at the start and 1 at the goal.
        ratio_weight: weight of the ratio.
        stiffness: weight of the penalty.
        curved: whether the curvature is asked for.
    """
    body, x, still, dtype = task.body, motion.points, task.body.still, q.dtype
    raw, normal = gaps_and_normals(task.distances, x[still:])
    obstacles = raw - jnp.asarray(body.radii[still:], dtype)[:, None, None]
    gaps = body_gaps(body, x, motion.tool, obstacles, task.lower, task.upper)
    allowed = allowed_gaps(task, place)
    each = [hinge(g - a - task.path.margin) for g, a in zip(gaps, allowed, strict=True)]
    value, push, held = (Gaps(*parts) for parts in zip(*each, strict=True))

    def fade(tool: Vector3) -> Array:
        return d_factor(task.potential, tool, task.goal) / attraction_left(task.potential, tool, task.goal)

    faded, fade_slope = jax.vmap(jax.value_and_grad(fade), in_axes=-1, out_axes=-1)(motion.tool)
    energy, first, second = _repulsion(task, obstacles)
    total = jnp.sum(energy, axis=(0, 1))
    penalty = jnp.sum(jnp.stack([jnp.sum(v) for v in value]))

    # obstacles and floor, on the spheres that move
    along = ratio_weight * faded * first - stiffness * push.obstacles
    bent = ratio_weight * faded * second + stiffness * held.obstacles
    along, bent, normal = stored(along), stored(bent), stored(normal)
    f = [jnp.sum(along * normal[k], axis=1) for k in range(3)]
    M = _sums(bent, normal, 1)
    if body.floor is not None:
        f[2] = f[2] - stiffness * push.floor
        M[2][2] = M[2][2] + stiffness * held.floor
    f = [_padded(e, still, 0) for e in f]
    M = [[_padded(e, still, 0) for e in row] for row in M]
    if body.pairs.rows:
        for on_f, on_M in _between_spheres(task, x, stiffness * push.spheres, 2 * stiffness * held.spheres):
            f = [f[k] + on_f[k] for k in range(3)]
            M = [[M[i][j] + on_M[i][j] for j in range(3)] for i in range(3)]
    f = [stored(e) for e in f]
    M = _symmetric(lambda i, j: stored(M[i][j]), 3)
    # the tool point, and ranges of the joints
    on_tool = stored(ratio_weight * total * fade_slope + stiffness * (push.upper - push.lower))
    on_tool_held = stored(stiffness * (held.upper + held.lower))
    low, high = beyond_range(task, q)
    below, above = hinge(-low - task.path.margin), hinge(-high - task.path.margin)
    lever = jnp.asarray(task.path.lever, dtype)
    penalty = penalty + jnp.sum(below[0]) + jnp.sum(above[0])
    at_joints = stiffness * lever * (above[1] - below[1])
    on_joints_held = stiffness * lever * lever * (above[2] + below[2])

    J, J_tool = motion.J, motion.J_tool
    joints = range(q.shape[1])
    gradient = [_dot(J[:, :, j], f) + jnp.sum(J_tool[:, j] * on_tool, axis=0) + at_joints[j] for j in joints]
    missed = jnp.maximum(violation_of(gaps, allowed), jnp.max(jnp.maximum(low, high)))
    if not curved:
        return Terms(faded * total, penalty, missed, jnp.stack(gradient), jnp.zeros((0, 0, 0), dtype))
    weighed = [[stored(sum(M[k][m] * J[:, m, j] for m in range(3))) for k in range(3)] for j in joints]

    def entry(i: int, j: int) -> Array:
        pulled = _dot(J[:, :, i], weighed[j]) + jnp.sum(J_tool[:, i] * J_tool[:, j] * on_tool_held, axis=0)
        return pulled + on_joints_held[i] if i == j else pulled

    curvature = jnp.stack([jnp.stack(row) for row in _symmetric(entry, len(joints))])
    return Terms(faded * total, penalty, missed, jnp.stack(gradient), curvature)


_OnSpheres = tuple[list[Array], list[list[Array]]]
"""A gradient and a curvature for every sphere and sample, by their entries."""


def _between_spheres(
    task: ArmTask, x: Float[Array, "point 3 sample"], push: ArrayLike, held: ArrayLike
) -> tuple[_OnSpheres, _OnSpheres]:
    """What self-collision adds on the first spheres of the pairs and on the second: (v_a - v_b)^2 <= 2 v_a^2 + 2 v_b^2."""
    rows, column, apart = task.body.pairs
    scale = jnp.asarray(np.where(apart > 0, 1 / np.where(apart > 0, apart, 1), 0), x.dtype)[..., None]
    normal = [(x[:rows, None, k] - x[None, column:, k]) * scale for k in range(3)]
    push, held = stored(jnp.asarray(push)), stored(jnp.asarray(held))
    after = x.shape[0] - rows
    on_rows = (
        [_padded(-jnp.sum(push * normal[k], axis=1), 0, after) for k in range(3)],
        [[_padded(e, 0, after) for e in row] for row in _sums(held, normal, 1)],
    )
    on_columns = (
        [_padded(jnp.sum(push * normal[k], axis=0), column, 0) for k in range(3)],
        [[_padded(e, column, 0) for e in row] for row in _sums(held, normal, 0)],
    )
    return on_rows, on_columns


def _padded(x: Float[Array, "some sample"], before: int, after: int) -> Float[Array, "point sample"]:
    return jnp.pad(computed(x), ((before, after), (0, 0)))


def _dot(J: Float[Array, "point 3 sample"], f: list[Array]) -> Float[Array, "sample"]:
    """Sum over the points of J . f."""
    return jnp.sum(J[:, 0] * f[0] + J[:, 1] * f[1] + J[:, 2] * f[2], axis=0)
