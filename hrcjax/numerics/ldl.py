"""L D L^T of a small symmetric positive definite matrix, written out entry by entry.

Unrolled at trace time, so that `vmap` turns every scalar into one vector over the batch: far faster on a CPU than a
batched LAPACK call on 6 x 6 matrices. The oracle is `jnp.linalg.solve`.
"""

from collections.abc import Sequence

import jax
import jax.numpy as jnp

from hrcjax.typing import Array, Float


def ldl_factor(rows: Sequence[Sequence[Array]]) -> tuple[list[list[Array]], list[Array]]:
    """Unit lower triangle L and diagonal D of A = L D L^T.

    Args:
        rows: the lower triangle of A as scalars, rows[i][j] for j <= i.

    Not finite if: A is singular.
    """
    n = len(rows)
    lower: list[list[Array]] = [[] for _ in range(n)]
    diagonal: list[Array] = []
    for i in range(n):
        scaled: list[Array] = []  # L[i][j] D[j]
        for j in range(i):
            entry = rows[i][j]
            for k in range(j):
                entry = entry - scaled[k] * lower[j][k]
            scaled.append(entry)
            lower[i].append(entry / diagonal[j])
        pivot = rows[i][i]
        for k in range(i):
            pivot = pivot - scaled[k] * lower[i][k]
        diagonal.append(pivot)
    return lower, diagonal


def ldl_solve(lower: Sequence[Sequence[Array]], diagonal: Sequence[Array], b: Sequence[Array]) -> list[Array]:
    """The x of L D L^T x = b, as scalars."""
    n = len(diagonal)
    x = list(b)
    for i in range(n):
        for k in range(i):
            x[i] = x[i] - lower[i][k] * x[k]
    x = [x[i] / diagonal[i] for i in range(n)]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            x[i] = x[i] - lower[k][i] * x[k]
    return x


@jax.custom_jvp
def solve_spd(A: Float[Array, "n n"], b: Float[Array, "n"]) -> Float[Array, "n"]:
    """The x of A x = b for a small symmetric positive definite A; only its lower triangle is read.

    Its derivative is solved with the same factors: dx = A^-1 (db - dA x), which compiles far faster than the derivative
    of the factorisation.

    Not finite if: A is singular.
    """
    return _solve_spd(A, b)[0]


_Factors = tuple[list[list[Array]], list[Array]]


def _solve_spd(A: Array, b: Array) -> tuple[Array, _Factors]:
    n = A.shape[0]
    factors = ldl_factor([[A[i, j] for j in range(i + 1)] for i in range(n)])
    return jnp.stack(ldl_solve(*factors, [b[i] for i in range(n)])), factors


@solve_spd.defjvp
def _solve_spd_jvp(primals: tuple[Array, Array], tangents: tuple[Array, Array]) -> tuple[Array, Array]:
    dA, db = tangents
    x, factors = _solve_spd(*primals)
    lower = jnp.tril(dA)
    rest = db - (lower @ x + jnp.tril(dA, -1).T @ x)
    return x, jnp.stack(ldl_solve(*factors, [rest[i] for i in range(x.shape[0])]))
