"""Forces and accelerations of a chain: recursive Newton-Euler, composite bodies, and a solve written out.

All in the frames of the links, so that the right angles of an arm cost nothing. Method: R. Featherstone, Rigid Body
Dynamics Algorithms (2008), chapters 5 and 6, with three-vectors instead of spatial ones. The oracle is MuJoCo.
"""

from collections.abc import Sequence
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike

from hrcjax.numerics import ldl_factor
from hrcjax.robot.chain import Chain
from hrcjax.robot.unrolled import (
    ZERO,
    Matrix,
    Number,
    Vector,
    add,
    apply,
    as_array,
    constant_matrix,
    constant_vector,
    cos_sin,
    cross,
    dot,
    minus,
    plus,
    scale,
    spin,
    times,
    transpose,
    turn,
)
from hrcjax.typing import Array, Float, Joints


class _Links:
    """The constants of a chain as scalars, and the way between neighbouring joint frames at q."""

    def __init__(self, chain: Chain, q: Joints) -> None:
        self.size = chain.size
        self.cos, self.sin = zip(*(cos_sin(q[i]) for i in range(self.size)), strict=True)
        self.pos = [constant_vector(v) for v in chain.pos]
        self.rotation = [constant_matrix(A) for A in chain.rotation]
        self.mass: list[float] = chain.mass.tolist()
        moment = chain.mass[:, None] * chain.com
        self.moment = [constant_vector(v) for v in moment]  # mass times centre of mass
        square = np.sum(chain.com * moment, axis=1)[:, None, None] * np.eye(3)
        about_origin = chain.inertia + square - moment[:, :, None] * chain.com[:, None, :]
        self.inertia = [constant_matrix(A) for A in about_origin]

    def outward(self, i: int, v: Vector) -> Vector:
        """A vector in the axes of joint frame i - 1 in those of frame i."""
        return turn(self.cos[i], -self.sin[i], apply(transpose(self.rotation[i]), v))

    def inward(self, i: int, v: Vector) -> Vector:
        """A vector in the axes of joint frame i in those of frame i - 1."""
        return apply(self.rotation[i], turn(self.cos[i], self.sin[i], v))


def _newton_euler(links: _Links, gravity: Vector, qd: Sequence[Number], qdd: Sequence[Number] | None) -> list[Number]:
    """Torques about the joints' axes that give qdd (None: zero), without friction and rotors."""
    omega, alpha, a = ZERO, ZERO, scale(-1.0, gravity)  # gravity as an acceleration of the world upwards
    forces: list[Vector] = []
    torques: list[Vector] = []
    for i in range(links.size):
        a = links.outward(i, add(a, apply(spin(omega, alpha), links.pos[i])))
        omega, alpha = links.outward(i, omega), links.outward(i, alpha)
        alpha = (  # + omega x (z qd) + z qdd
            plus(alpha[0], times(omega[1], qd[i])),
            minus(alpha[1], times(omega[0], qd[i])),
            alpha[2] if qdd is None else plus(alpha[2], qdd[i]),
        )
        omega = (omega[0], omega[1], plus(omega[2], qd[i]))
        m, h, I = links.mass[i], links.moment[i], links.inertia[i]  # noqa: E741  the inertia's usual name
        forces.append(add(scale(m, a), apply(spin(omega, alpha), h)))
        torques.append(add(apply(I, alpha), cross(omega, apply(I, omega)), cross(h, a)))
    tau: list[Number] = [0.0] * links.size
    for i in reversed(range(links.size)):
        tau[i] = torques[i][2]
        if i > 0:
            f = links.inward(i, forces[i])
            forces[i - 1] = add(forces[i - 1], f)
            torques[i - 1] = add(torques[i - 1], links.inward(i, torques[i]), cross(links.pos[i], f))
    return tau


def _moved(links: _Links, i: int, m: float, h: Vector, I: Matrix) -> tuple[Vector, Matrix]:  # noqa: E741
    """First moment and inertia about the origin of frame i, taken to the origin and the axes of frame i - 1."""
    h = links.inward(i, h)
    half = (links.inward(i, I[0]), links.inward(i, I[1]), links.inward(i, I[2]))  # I R^T
    columns = transpose(half)
    I = transpose((links.inward(i, columns[0]), links.inward(i, columns[1]), links.inward(i, columns[2])))  # noqa: E741
    t = links.pos[i]
    # about a point that is t away: I + 2 (t.h) 1 - t h^T - h t^T + m (t.t 1 - t t^T), with g = h + m t / 2
    g = add(h, scale(0.5 * m, t))
    trace = times(2.0, dot(t, g))
    rows: list[list[Number]] = [[0.0] * 3 for _ in range(3)]
    for r in range(3):
        for c in range(r + 1):
            entry = minus(I[r][c], plus(times(t[r], g[c]), times(g[r], t[c])))
            rows[r][c] = rows[c][r] = plus(entry, trace) if r == c else entry
    a, b, c = ((x, y, z) for x, y, z in rows)
    return add(h, scale(m, t)), (a, b, c)


def _composite(links: _Links, armature: Sequence[float]) -> list[list[Number]]:
    """Lower triangle of the mass matrix."""
    n = links.size
    rows: list[list[Number]] = [[0.0] * (i + 1) for i in range(n)]
    m, h, I = 0.0, ZERO, (ZERO, ZERO, ZERO)  # noqa: E741
    for i in reversed(range(n)):
        if i + 1 < n:
            h, I = _moved(links, i + 1, m, h, I)  # noqa: E741
        m, h = m + links.mass[i], add(h, links.moment[i])
        J = links.inertia[i]
        I = (add(I[0], J[0]), add(I[1], J[1]), add(I[2], J[2]))  # noqa: E741
        f, torque = (minus(0.0, h[1]), h[0], 0.0), (I[0][2], I[1][2], I[2][2])  # for a unit turn about z
        rows[i][i] = plus(torque[2], armature[i])
        for j in reversed(range(i)):
            f = links.inward(j + 1, f)
            torque = add(links.inward(j + 1, torque), cross(links.pos[j + 1], f))
            rows[i][j] = torque[2]
    return rows


def _check(chain: Chain, **joints: Joints) -> None:
    for name, value in joints.items():
        if value.shape != (chain.size,):
            raise ValueError(
                f"{name} has shape {value.shape}; accepted: ({chain.size},), one entry per joint of the chain"
            )


def mass_matrix(chain: Chain, q: Joints) -> Float[Array, "joint joint"]:
    """Inertia of the chain as seen at its joints, rotors included [kg m^2].

    Raises:
        ValueError: q has not one entry per joint.
    """
    _check(chain, q=q)
    rows = _composite(_Links(chain, q), chain.armature.tolist())
    n = chain.size
    return as_array([rows[max(i, j)][min(i, j)] for i in range(n) for j in range(n)], (n, n), q.dtype)


def bias_force(chain: Chain, q: Joints, qd: Joints) -> Joints:
    """Torques that hold the chain at qdd = 0: weight, centrifugal and Coriolis forces, without friction [N m].

    The same quantity as MuJoCo's `qfrc_bias`.

    Raises:
        ValueError: q or qd has not one entry per joint.
    """
    _check(chain, q=q, qd=qd)
    speeds = [qd[i] for i in range(chain.size)]
    tau = _newton_euler(_Links(chain, q), constant_vector(chain.gravity), speeds, None)
    return as_array(tau, (chain.size,), q.dtype)


def inverse_dynamics(chain: Chain, q: Joints, qd: Joints, qdd: Joints) -> Joints:
    """Motor torques that give the accelerations qdd: M qdd + bias + damping qd [N m].

    Args:
        q: joint positions [rad].
        qd: joint speeds [rad/s].
        qdd: joint accelerations [rad/s^2].

    Raises:
        ValueError: an argument has not one entry per joint.
    """
    _check(chain, q=q, qd=qd, qdd=qdd)
    n = chain.size
    speeds, accelerations = [qd[i] for i in range(n)], [qdd[i] for i in range(n)]
    tau = _newton_euler(_Links(chain, q), constant_vector(chain.gravity), speeds, accelerations)
    damping, armature = chain.damping.tolist(), chain.armature.tolist()
    tau = [plus(tau[i], times(damping[i], speeds[i]), times(armature[i], accelerations[i])) for i in range(n)]
    return as_array(tau, (n,), q.dtype)


def forward_dynamics(chain: Chain, q: Joints, qd: Joints, tau: Joints) -> Joints:
    """Joint accelerations under motor torques: M^-1 (tau - bias - damping qd) [rad/s^2].

    Its derivative is that of inverse dynamics, solved with the same factors: d qdd = M^-1 (d tau - d ID(q, qd, qdd)).
    This compiles and runs far faster than the derivative of the solve, in both modes.

    Args:
        q: joint positions [rad].
        qd: joint speeds [rad/s].
        tau: torques about the joints [N m].

    Not finite if: the mass matrix is singular (a massless last link without armature).

    Raises:
        ValueError: an argument has not one entry per joint.
    """
    _check(chain, q=q, qd=qd, tau=tau)
    return _accelerations(chain, q, qd, tau)


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _accelerations(chain: Chain, q: Array, qd: Array, tau: Array) -> Array:
    return _accelerate(chain, q, qd, tau)[0]


@_accelerations.defjvp
def _accelerations_jvp(
    chain: Chain, primals: tuple[ArrayLike, ...], tangents: tuple[ArrayLike, ...]
) -> tuple[Array, Array]:
    q, qd, tau = (jnp.asarray(v) for v in primals)
    d_q, d_qd, d_tau = (jnp.asarray(v) for v in tangents)
    qdd, factors = _accelerate(chain, q, qd, tau)
    _, d_id = jax.jvp(lambda q, qd: inverse_dynamics(chain, q, qd, qdd), (q, qd), (d_q, d_qd))
    rest = d_tau - d_id
    return qdd, jnp.stack(_solve(factors, [rest[i] for i in range(chain.size)]))


_Factors = tuple[list[list[Array]], list[Array]]


def _accelerate(chain: Chain, q: Array, qd: Array, tau: Array) -> tuple[Array, _Factors]:
    """The accelerations, and the factors of the mass matrix. Scalars from end to end: an array between would cost."""
    n = chain.size
    links = _Links(chain, q)
    speeds, damping = [qd[i] for i in range(n)], chain.damping.tolist()
    rows = _composite(links, chain.armature.tolist())
    factors = ldl_factor([[jnp.asarray(entry, q.dtype) for entry in row] for row in rows])
    bias = _newton_euler(links, constant_vector(chain.gravity), speeds, None)
    rest = [minus(minus(tau[i], bias[i]), times(damping[i], speeds[i])) for i in range(n)]
    return jnp.stack(_solve(factors, rest)), factors


def _solve(factors: _Factors, b: Sequence[Number]) -> list[Array]:
    """The x of L D L^T x = b. The division comes last, for the reason given at `cos_sin`."""
    lower, diagonal = factors
    n = len(diagonal)
    x = [jnp.asarray(entry, diagonal[0].dtype) for entry in b]
    for i in range(n):
        for k in range(i):
            x[i] = x[i] - lower[i][k] * x[k]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            x[i] = x[i] - diagonal[i] * lower[k][i] * x[k]
        x[i] = x[i] / diagonal[i]
    return x
