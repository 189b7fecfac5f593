"""Repulsion and constraints in one configuration of a path: value, gradient and curvature by the joints."""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from hrcjax.numerics import safe_divide
from hrcjax.plan.arm_potential import attraction_left
from hrcjax.plan.arm_task import ArmTask, Gaps, allowed_gaps, body_gaps
from hrcjax.plan.body import BodyMotion
from hrcjax.plan.hinge import hinge
from hrcjax.plan.potential import DistancesFn, d_factor, repulsive_potentials
from hrcjax.typing import Array, Float, Joints, Scalar, Vector3


class Terms(NamedTuple):
    """What repulsion and constraints add in one configuration."""

    ratio: Float[Array, ""]
    """Repulsion over attraction [1]."""
    penalty: Float[Array, ""]
    """Of the constraints [m^2]."""
    violation: Float[Array, ""]
    """Most that a constraint is missed by; negative: all are kept [m]."""
    gradient: Float[Array, "joint"]
    """Of ratio_weight ratio + stiffness penalty, by the joints."""
    curvature: Float[Array, "joint joint"]
    """Its positive semi-definite part."""


def gaps_and_normals(
    distances: DistancesFn, points: Float[Array, "point 3"]
) -> tuple[Float[Array, "point obstacle"], Float[Array, "3 point obstacle"]]:
    """Distances of points to all obstacles [m], and their gradients [1]."""

    def one(x: Vector3) -> tuple[Float[Array, "obstacle"], Float[Array, "3 obstacle"]]:
        return jax.vmap(lambda e: jax.jvp(distances, (x,), (e,)), out_axes=(None, 0))(jnp.eye(3, dtype=x.dtype))

    return jax.vmap(one, out_axes=(0, 1))(points)


def _repulsion(task: ArmTask, gaps: Array) -> tuple[Array, Array, Array]:
    """Repulsive potentials of all spheres and obstacles without d_factor, first and second derivative by the gap."""
    influence, one = task.potential.zeta * task.radius, jnp.ones((), gaps.dtype)
    weights = jnp.asarray(task.body.weights, gaps.dtype)[:, None]

    def value(gaps: Array) -> Array:
        return weights * jax.vmap(lambda rho: repulsive_potentials(task.potential, rho, influence, one))(gaps)

    def slope(gaps: Array) -> tuple[Array, Array]:
        return jax.jvp(value, (gaps,), (jnp.ones_like(gaps),))

    (energy, first), (_, second) = jax.jvp(slope, (gaps,), (jnp.ones_like(gaps),))
    return energy, first, second


def _sums(weights: Array, normal: Array) -> list[list[Array]]:
    """Entries of the sums over obstacles of weight n n^T, one 3 x 3 matrix per sphere."""
    upper = {(i, j): jnp.sum(weights * normal[i] * normal[j], axis=-1) for i in range(3) for j in range(i, 3)}
    return [[upper[min(i, j), max(i, j)] for j in range(3)] for i in range(3)]


def violation_of(gaps: Gaps, allowed: Gaps, beyond_range: Array) -> Float[Array, ""]:
    """Most that any gap is short of the allowed one [m]."""
    short = [jnp.max(a - jnp.minimum(g, 1e3), initial=-1e3) for g, a in zip(gaps, _finite(allowed), strict=True)]
    return jnp.max(jnp.stack([*short, jnp.max(beyond_range)]))


def _finite(gaps: Gaps) -> Gaps:
    return Gaps(*(jnp.where(jnp.isfinite(x), x, 0) for x in gaps))


def beyond_range(task: ArmTask, q: Joints) -> tuple[Array, Array]:
    """How far every joint is below its range and above it, as a length; negative: within [m]."""
    lever = jnp.asarray(task.path.lever, q.dtype)
    low, high = jnp.asarray(task.body.q_min, q.dtype), jnp.asarray(task.body.q_max, q.dtype)
    return lever * (low - q), lever * (q - high)


def terms(
    task: ArmTask, motion: BodyMotion, q: Joints, place: Scalar, ratio_weight: Scalar, stiffness: Scalar
) -> Terms:
    """Repulsion and constraints of one configuration.

    Gradients are exact. The curvature leaves out that of the obstacles' surfaces and of the arm's motion, and bounds that
    of pairs of spheres, so that it is never negative.

    Args:
        motion: of the body in this configuration.
        place: along the path, 0 at the start and 1 at the goal.
        ratio_weight: weight of the ratio.
        stiffness: weight of the penalty.
    """
    body, x, exposed = task.body, motion.points, task.body.exposed
    raw, normal = gaps_and_normals(task.distances, x[:exposed])
    obstacles = raw - jnp.asarray(body.radii[:exposed], x.dtype)[:, None]
    gaps = body_gaps(body, x, motion.tool, obstacles, task.lower, task.upper)
    allowed = _finite(allowed_gaps(task, place))
    spare = Gaps(*(g - a - task.path.margin for g, a in zip(gaps, allowed, strict=True)))
    kept = Gaps(*(hinge(s) for s in spare))

    def fade(tool: Vector3) -> Array:
        return d_factor(task.potential, tool, task.goal) / attraction_left(task.potential, tool, task.goal)

    faded, fade_slope = jax.value_and_grad(fade)(motion.tool)
    energy, first, second = _repulsion(task, obstacles)
    total = jnp.sum(energy)

    # obstacles, on the exposed spheres
    along = ratio_weight * faded * first - stiffness * kept.obstacles[1]
    f = [jnp.sum(along * normal[k], axis=-1) for k in range(3)]
    M = _sums(ratio_weight * faded * second + stiffness * kept.obstacles[2], normal)
    if body.floor is not None:
        f[2] = f[2] - stiffness * kept.floor[1]
        M[2][2] = M[2][2] + stiffness * kept.floor[2]
    rest = x.shape[0] - exposed
    f = [jnp.concatenate([e, jnp.zeros(rest, x.dtype)]) for e in f]
    M = [[jnp.concatenate([e, jnp.zeros(rest, x.dtype)]) for e in row] for row in M]
    penalty = jnp.sum(kept.obstacles[0]) + jnp.sum(kept.lower[0]) + jnp.sum(kept.upper[0])
    if body.floor is not None:
        penalty = penalty + jnp.sum(kept.floor[0])
    # spheres against each other: (v_a - v_b)^2 <= 2 v_a^2 + 2 v_b^2
    if body.apart.any():
        away = [x[:, None, k] - x[None, :, k] for k in range(3)]
        apart = gaps.spheres + jnp.asarray(body.apart, x.dtype)
        facing = jnp.asarray(body.apart > 0)
        unit = [jnp.where(facing, safe_divide(a, jnp.where(facing, apart, 1)), 0) for a in away]
        f = [f[k] - stiffness * jnp.sum(kept.spheres[1] * unit[k], axis=-1) for k in range(3)]
        S = _sums(2 * stiffness * kept.spheres[2], jnp.stack(unit))
        M = [[M[i][j] + S[i][j] for j in range(3)] for i in range(3)]
        penalty = penalty + jnp.sum(jnp.where(facing, kept.spheres[0], 0)) / 2
    # the tool point
    on_tool = ratio_weight * total * fade_slope + stiffness * (kept.upper[1] - kept.lower[1])
    held = stiffness * (kept.upper[2] + kept.lower[2])
    # ranges of the joints
    low, high = beyond_range(task, q)
    below, above = hinge(-low - task.path.margin), hinge(-high - task.path.margin)
    lever = jnp.asarray(task.path.lever, q.dtype)
    penalty = penalty + jnp.sum(below[0]) + jnp.sum(above[0])
    at_joints = stiffness * lever * (above[1] - below[1])
    held_joints = stiffness * lever * lever * (above[2] + below[2])

    J, J_tool = motion.J, motion.J_tool
    gradient = _pull(J, f) + jnp.sum(J_tool * on_tool[:, None], axis=0) + at_joints
    curvature = _pull_matrix(J, M) + jnp.diag(held_joints)
    curvature = curvature + jnp.sum(J_tool[:, :, None] * J_tool[:, None, :] * held[:, None, None], axis=0)
    return Terms(
        faded * total, penalty, violation_of(gaps, allowed, jnp.maximum(low, high)), gradient, curvature
    )  # fmt: skip


def _pull(J: Float[Array, "point 3 joint"], f: list[Array]) -> Float[Array, "joint"]:
    """Sum over the points of J^T f."""
    return jnp.stack([jnp.sum(sum(J[:, k, j] * f[k] for k in range(3))) for j in range(J.shape[2])])


def _pull_matrix(J: Float[Array, "point 3 joint"], M: list[list[Array]]) -> Float[Array, "joint joint"]:
    """Sum over the points of J^T M J, entry by entry: under `vmap` these are long vectors."""
    joints = range(J.shape[2])
    column = [[J[:, k, j] for k in range(3)] for j in joints]
    weighed = [[sum(M[k][m] * column[j][m] for m in range(3)) for k in range(3)] for j in joints]
    entry = {
        (i, j): jnp.sum(sum(column[i][k] * weighed[j][k] for k in range(3))) for i in joints for j in range(i, len(joints))
    }
    return jnp.stack([jnp.stack([entry[min(i, j), max(i, j)] for j in joints]) for i in joints])
