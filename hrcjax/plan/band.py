"""Symmetric positive definite systems with one 3 x 3 block per waypoint, coupled to the next two waypoints.

Every entry is a scalar of the program, so that `vmap` turns it into one vector over the batch; the waypoints are a
scan.
"""

import jax
import jax.numpy as jnp

from hrcjax.typing import Array, Float, Scalar

Vec = list[Array]
Mat = list[list[Array]]


def band_product(
    diagonal: Float[Array, "waypoint 3 3"], off: Float[Array, "pair 3 3"], far: Scalar, x: Float[Array, "waypoint 3"]
) -> Float[Array, "waypoint 3"]:
    """The product of the matrix of `band_solve` with x."""
    product = _times(diagonal, x)
    product = product.at[:-1].add(_times(off, x[1:])).at[1:].add(_times(off, x[:-1]))
    return product.at[:-2].add(far * x[2:]).at[2:].add(far * x[:-2])


def band_solve(
    diagonal: Float[Array, "waypoint 3 3"],
    off: Float[Array, "pair 3 3"],
    far: Scalar,
    b: Float[Array, "waypoint 3"],
) -> Float[Array, "waypoint 3"]:
    """The x of A x = b, by block elimination; derivatives by the same elimination once more.

    Args:
        diagonal: symmetric blocks A[j, j].
        off: symmetric blocks A[j, j + 1] = A[j + 1, j].
        far: the number f of the blocks A[j, j + 2] = f I.

    Not finite if: A is singular.
    """

    def solve(_: object, b: Float[Array, "waypoint 3"]) -> Float[Array, "waypoint 3"]:
        return _eliminate(diagonal, off, jnp.asarray(far, b.dtype), b)

    return jax.lax.custom_linear_solve(lambda x: band_product(diagonal, off, far, x), b, solve, symmetric=True)


def _times(blocks: Float[Array, "waypoint 3 3"], x: Float[Array, "waypoint 3"]) -> Float[Array, "waypoint 3"]:
    return jnp.sum(blocks * x[:, None, :], axis=-1)


def _eliminate(
    diagonal: Float[Array, "waypoint 3 3"], off: Float[Array, "pair 3 3"], far: Array, b: Float[Array, "waypoint 3"]
) -> Float[Array, "waypoint 3"]:
    """Block L D L^T: pivots S[j] with inverses P[j], and G[j] = L[j, j-1] S[j-1]."""
    zero3, zero33 = _vec(jnp.zeros_like(b[0])), _mat(jnp.zeros_like(diagonal[0]))
    before = jnp.concatenate([jnp.zeros_like(off[:1]), off])

    def forward(carry: tuple[Mat, Mat, Mat, Vec, Vec], row: tuple[Array, Array, Array]):
        P1, P2, G1, y1, y2 = carry  # of the waypoints one and two back
        D, E, r = _mat(row[0]), _mat(row[1]), _vec(row[2])
        G = [[E[i][j] - far * _dot(P2[i], G1[j]) for j in range(3)] for i in range(3)]
        GP = [[_dot(G[i], P1[j]) for j in range(3)] for i in range(3)]  # P1 is symmetric
        S = [[D[i][j] - _dot(GP[i], G[j]) - far * far * P2[i][j] for j in range(3)] for i in range(3)]
        P = _inverse(S)
        y = [r[i] - _dot(GP[i], y1) - far * _dot(P2[i], y2) for i in range(3)]
        return (P, P1, G, y, y1), (_array(P), _array(G), jnp.stack(y))

    # the first row has no waypoint before it, the second none two before it: zero inverses leave their terms out
    _, (P, G, y) = jax.lax.scan(forward, (zero33, zero33, zero33, zero3, zero3), (diagonal, before, b))
    after = jnp.concatenate([G[1:], jnp.zeros_like(G[:1])])

    def backward(carry: tuple[Vec, Vec], row: tuple[Array, Array, Array]):
        x1, x2 = carry  # of the waypoints one and two ahead
        P, G, y = _mat(row[0]), _mat(row[1]), _vec(row[2])
        rest = [y[i] - _dot([G[k][i] for k in range(3)], x1) - far * x2[i] for i in range(3)]
        x = [_dot(P[i], rest) for i in range(3)]
        return (x, x1), jnp.stack(x)

    return jax.lax.scan(backward, (zero3, zero3), (P, after, y), reverse=True)[1]


def _vec(x: Array) -> Vec:
    return [x[i] for i in range(3)]


def _mat(x: Array) -> Mat:
    return [[x[i, j] for j in range(3)] for i in range(3)]


def _array(x: Mat) -> Array:
    return jnp.stack([jnp.stack(row) for row in x])


def _dot(a: Vec, b: Vec) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _inverse(S: Mat) -> Mat:
    """Inverse of a symmetric 3 x 3 matrix by cofactors."""
    a, b, c, d, e, f = S[0][0], S[0][1], S[0][2], S[1][1], S[1][2], S[2][2]
    A, B, C = d * f - e * e, c * e - b * f, b * e - c * d
    scale = 1 / (a * A + b * B + c * C)
    D, E, F = a * f - c * c, b * c - a * e, a * d - b * b
    return [[scale * x for x in row] for row in ((A, B, C), (B, D, E), (C, E, F))]
