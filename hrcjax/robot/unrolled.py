"""Vectors and matrices as tuples of scalars, written out when traced.

A scalar is a Python float (a constant of the arm) or an array of shape (). Products with the constants 0 and 1 vanish
while tracing, so that the right angles of an arm cost nothing, and `vmap` turns every scalar into one vector over the
batch: the layout a CPU is fast with.
"""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike

from hrcjax.typing import Array

Number = float | Array
Vector = tuple[Number, Number, Number]
Matrix = tuple[Vector, Vector, Vector]

ZERO: Vector = (0.0, 0.0, 0.0)


def constant_vector(values: np.ndarray) -> Vector:
    """Three Python floats."""
    x, y, z = np.asarray(values, np.float64).tolist()
    return x, y, z


def constant_matrix(values: np.ndarray) -> Matrix:
    """Three rows of three Python floats."""
    a, b, c = np.asarray(values, np.float64)
    return constant_vector(a), constant_vector(b), constant_vector(c)


@jax.custom_jvp
def cos_sin(angle: ArrayLike) -> tuple[Array, Array]:
    """Cosine and sine of an angle.

    Divided by the sum of their squares: a compiler that fuses takes a sine to be cheap and computes it anew in each of
    dozens of fusions, but keeps the result of a division that is used more than once. Worth a factor of 3.
    """
    c, s = jnp.cos(angle), jnp.sin(angle)
    one = c * c + s * s
    return c / one, s / one


@cos_sin.defjvp
def _cos_sin_jvp(
    primals: tuple[ArrayLike], tangents: tuple[ArrayLike]
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    c, s = cos_sin(primals[0])
    return (c, s), (-s * tangents[0], c * tangents[0])


def times(a: Number, b: Number) -> Number:
    """a b."""
    if isinstance(b, float):
        a, b = b, a
    if isinstance(a, float):
        if a == 0.0:
            return 0.0
        if a == 1.0:
            return b
        if a == -1.0:
            return -b
    return a * b


def plus(*terms: Number) -> Number:
    """Sum of the terms, from the left."""
    total: Number = 0.0
    for term in terms:
        if isinstance(term, float) and term == 0.0:
            continue
        total = term if isinstance(total, float) and total == 0.0 else total + term
    return total


def minus(a: Number, b: Number) -> Number:
    """a - b."""
    if isinstance(b, float) and b == 0.0:
        return a
    if isinstance(a, float) and a == 0.0:
        return -b
    return a - b


def add(*vectors: Vector) -> Vector:
    """Sum of vectors."""
    return plus(*(v[0] for v in vectors)), plus(*(v[1] for v in vectors)), plus(*(v[2] for v in vectors))


def scale(k: Number, v: Vector) -> Vector:
    """k v."""
    return times(k, v[0]), times(k, v[1]), times(k, v[2])


def dot(a: Vector, b: Vector) -> Number:
    """Scalar product."""
    return plus(times(a[0], b[0]), times(a[1], b[1]), times(a[2], b[2]))


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return (
        minus(times(a[1], b[2]), times(a[2], b[1])),
        minus(times(a[2], b[0]), times(a[0], b[2])),
        minus(times(a[0], b[1]), times(a[1], b[0])),
    )


def transpose(A: Matrix) -> Matrix:
    """The matrix whose rows are the columns of A."""
    (a, b, c), (d, e, f), (g, h, i) = A
    return (a, d, g), (b, e, h), (c, f, i)


def apply(A: Matrix, v: Vector) -> Vector:
    """A v."""
    return dot(A[0], v), dot(A[1], v), dot(A[2], v)


def product(A: Matrix, B: Matrix) -> Matrix:
    """A B."""
    columns = transpose(B)
    return transpose((apply(A, columns[0]), apply(A, columns[1]), apply(A, columns[2])))


def turn(cos: Number, sin: Number, v: Vector) -> Vector:
    """v turned about the z axis."""
    return minus(times(cos, v[0]), times(sin, v[1])), plus(times(sin, v[0]), times(cos, v[1])), v[2]


def spin(omega: Vector, alpha: Vector) -> Matrix:
    """The matrix A of a turning body for which A r = alpha x r + omega x (omega x r): acceleration of a point at r."""
    (x, y, z), (a, b, c) = omega, alpha
    xx, yy, zz = times(x, x), times(y, y), times(z, z)
    xy, xz, yz = times(x, y), times(x, z), times(y, z)
    return (
        (minus(0.0, plus(yy, zz)), minus(xy, c), plus(xz, b)),
        (plus(xy, c), minus(0.0, plus(xx, zz)), minus(yz, a)),
        (minus(xz, b), plus(yz, a), minus(0.0, plus(xx, yy))),
    )


def as_array(values: Sequence[Number], shape: tuple[int, ...], dtype: jnp.dtype) -> Array:
    """The scalars, row by row, as one array."""
    return jnp.stack([jnp.asarray(v, dtype) for v in values]).reshape(shape)
