"""Pullback: a policy written for a task, brought to the joints."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.typing import Array, Float, Joints

TaskMap = Callable[[Joints], Float[Array, "task"]]
"""Joint positions -> task coordinates."""
Leaf = Callable[[Float[Array, "task"], Float[Array, "task"]], tuple[Float[Array, "task task"], Float[Array, "task"]]]
"""A policy in task coordinates: (x, xd) -> (metric M, desired acceleration a)."""


class Pulled(eqx.Module):
    """A policy at the joints, in natural form: it asks for the qdd of M qdd = f. Policies add."""

    M: Float[Array, "joint joint"]
    """Metric, symmetric and positive semi-definite [1]."""
    f: Float[Array, "joint"]
    """Metric times desired acceleration [rad/s^2]."""


def add(one: Pulled, other: Pulled) -> Pulled:
    """Both policies at once."""
    return Pulled(one.M + other.M, one.f + other.f)


def pullback(
    J: Float[Array, "task joint"],
    Jd_qd: Float[Array, "task"],
    M: Float[Array, "task task"],
    a: Float[Array, "task"],
) -> Pulled:
    """M_q = J^T M J and f_q = J^T M (a - Jd_qd), for one task.

    Args:
        J: Jacobian of the task by the joints.
        Jd_qd: its time derivative, times qd.
        M: symmetric metric of the task; only used, not checked.
        a: desired acceleration of the task.

    Source: the HRI paper's system, see docs/references.md.
    """
    return pullback_points(J[None], Jd_qd[None], M[None], a[None])


def pullback_points(
    J: Float[Array, "point task joint"],
    Jd_qd: Float[Array, "point task"],
    M: Float[Array, "point task task"],
    a: Float[Array, "point task"],
) -> Pulled:
    """The sum of the pullbacks of some points, each a task of its own with a symmetric metric.

    The entries of the upper triangle are written out one by one, each a sum over the points: under `vmap` these are
    long vectors. A contraction by `einsum` costs several times more on a CPU, and writing out the points too, ten
    times more and half a minute of compilation.
    """
    points, tasks, _ = J.shape
    if Jd_qd.shape != (points, tasks) or a.shape != (points, tasks) or M.shape != (points, tasks, tasks):
        raise ValueError(
            f"J {J.shape} wants Jd_qd and a of shape {(points, tasks)} and M of shape {(points, tasks, tasks)}; "
            f"got {Jd_qd.shape}, {a.shape} and {M.shape}"
        )
    return pullback_forces(J, M, weighed(M, a - Jd_qd))


def weighed(M: Float[Array, "point task task"], u: Float[Array, "point task"]) -> Float[Array, "point task"]:
    """M u of every point."""
    tasks = u.shape[1]
    return jnp.stack(
        [_dot([M[:, t, s] for s in range(tasks)], [u[:, s] for s in range(tasks)]) for t in range(tasks)], 1
    )


def pullback_forces(
    J: Float[Array, "point task joint"], M: Float[Array, "point task task"], force: Float[Array, "point task"]
) -> Pulled:
    """The pullback of points where several leaves act: of the sums of their metrics, and of M (a - Jd_qd).

    Args:
        J: Jacobians of the points.
        M: sum of the metrics at each point [1].
        force: sum of M (a - Jd_qd) over the leaves at each point.
    """
    return Pulled(*_pulled(J, M, force))


@jax.custom_jvp
def _pulled(J: Array, M: Array, force: Array) -> tuple[Array, Array]:
    """The sums over the points of J^T M J and J^T force."""
    _, tasks, joints = J.shape
    column = [[J[:, t, j] for t in range(tasks)] for j in range(joints)]
    half = [[_dot([M[:, t, u] for u in range(tasks)], column[j]) for t in range(tasks)] for j in range(joints)]
    pushed = [force[:, t] for t in range(tasks)]
    entry = {(i, j): jnp.sum(_dot(column[i], half[j])) for i in range(joints) for j in range(i, joints)}
    rows = [jnp.stack([entry[min(i, j), max(i, j)] for j in range(joints)]) for i in range(joints)]
    return jnp.stack(rows), jnp.stack([jnp.sum(_dot(column[j], pushed)) for j in range(joints)])


@_pulled.defjvp
def _pulled_jvp(
    primals: tuple[Array, ...], tangents: tuple[Array, ...]
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """By contractions: the transpose of the entries written out would compile and run several times longer."""
    J, M, force = primals
    dJ, dM, dforce = tangents
    half = jnp.einsum("pti,ptj->ij", dJ, jnp.einsum("ptu,puj->ptj", M, J))
    dM_q = half + half.T + jnp.einsum("pti,ptj->ij", J, jnp.einsum("ptu,puj->ptj", dM, J))
    df_q = jnp.einsum("ptj,pt->j", dJ, force) + jnp.einsum("ptj,pt->j", J, dforce)
    return _pulled(J, M, force), (dM_q, df_q)


def pullback_joints(m: Float[Array, "joint"], a: Float[Array, "joint"]) -> Pulled:
    """The pullback of one leaf per joint: metric m [1], desired acceleration a [rad/s^2]."""
    return Pulled(jnp.diag(m), m * a)


def pull(phi: TaskMap, leaf: Leaf, q: Joints, qd: Joints) -> Pulled:
    """The pullback of any leaf through any differentiable map, by automatic differentiation.

    The general definition, for leaves and maps of the user's own; slower than `pullback` with a Jacobian at hand.

    Args:
        phi: joint positions to task coordinates.
        leaf: the policy in task coordinates.
        q: joint positions [rad].
        qd: joint speeds [rad/s].
    """

    def velocity(q: Joints) -> tuple[Array, Array]:
        return jax.jvp(phi, (q,), (qd,))

    (x, xd), (_, Jd_qd) = jax.jvp(velocity, (q,), (qd,))
    M, a = leaf(x, xd)
    return pullback(jax.jacfwd(phi)(q), Jd_qd, M, a)


def _dot(a: list[Array], b: list[Array]) -> Array:
    total = a[0] * b[0]
    for one, other in zip(a[1:], b[1:], strict=True):
        total = total + one * other
    return total
