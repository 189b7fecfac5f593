"""A distance field sampled on a regular grid: an interpolating tricubic B-spline, with continuous second derivatives.

For surfaces that do not move: the field is sampled once, and a query reads 64 coefficients, whatever the number of points
that it was made of. Exact for cubic polynomials; elsewhere the error falls with the fourth power of the spacing, but a
distance has a kink at surfaces and midway between them, where it is rounded within a spacing or so.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero

from hrcjax.numerics import require_floating
from hrcjax.typing import Array, Float, Vector3

LEAST_NODES = 4
"""Nodes along an edge that the conditions at the ends need."""


@dataclass(frozen=True)
class GridLayout:
    """Where the nodes of a grid lie."""

    lower: tuple[float, float, float]
    """The node with the least coordinates [m]."""
    shape: tuple[int, int, int]
    """Nodes along x, y and z."""
    spacing: float
    """From one node to the next [m]."""

    def __post_init__(self) -> None:
        """Refuses grids that no spline can be fitted to.

        Raises:
            ValueError: fewer than 4 nodes along an edge, a spacing that is not positive, a corner that is not finite.
        """
        placed = all(math.isfinite(v) for v in (*self.lower, self.spacing))
        if min(self.shape) < LEAST_NODES or not placed or self.spacing <= 0:
            raise ValueError(
                f"{self}: accepted are at least {LEAST_NODES} nodes along each edge and a positive spacing"
            )

    @property
    def upper(self) -> tuple[float, float, float]:
        """The node with the greatest coordinates [m]."""
        x, y, z = (low + self.spacing * (n - 1) for low, n in zip(self.lower, self.shape, strict=True))
        return x, y, z


class GridField(eqx.Module):
    """An interpolated distance field."""

    coefficients: Float[Array, "x y z"]
    """Of the B-splines at the nodes, and at one more at either end of each edge [m]."""
    layout: GridLayout = eqx.field(static=True)
    """Where the nodes lie."""


def grid_nodes(layout: GridLayout, dtype: jnp.dtype | type = jnp.float32) -> Float[Array, "node 3"]:
    """All nodes, those along z adjacent: in the order of the values of `fit_grid`, flattened [m]."""
    axes = [low + layout.spacing * np.arange(n) for low, n in zip(layout.lower, layout.shape, strict=True)]
    return jnp.asarray(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3), dtype)


def _interpolation(nodes: int) -> np.ndarray:
    """The matrix that takes values at the nodes of an edge to coefficients, (nodes + 2, nodes).

    The cubic spline through the values whose third derivative is continuous at the second and the last node but one
    ("not a knot"; de Boor, A Practical Guide to Splines, ch. IV), as cubic polynomials have it.
    """
    conditions = np.zeros((nodes + 2, nodes + 2))
    for i in range(nodes):
        conditions[i, i : i + 3] = np.array([1, 4, 1]) / 6
    conditions[nodes, :5] = conditions[nodes + 1, -5:] = [1, -4, 6, -4, 1]
    return np.linalg.inv(conditions)[:, :nodes]


def fit_grid(layout: GridLayout, values: Float[Array, "x y z"]) -> GridField:
    """The spline through the values at the nodes.

    Not finite if: a value is not; then most of the field is not.

    Raises:
        ValueError: the values are not those of the nodes, or of integers.
    """
    require_floating("fit_grid", values=values)
    if values.shape != layout.shape:
        raise ValueError(f"fit_grid: values {values.shape}; accepted: one for each node, {layout.shape}")
    a, b, c = (jnp.asarray(_interpolation(n), values.dtype) for n in layout.shape)
    highest = jax.lax.Precision.HIGHEST
    return GridField(jnp.einsum("ai,bj,ck,ijk->abc", a, b, c, values, precision=highest), layout)


def _basis(t: Float[Array, ""]) -> tuple[list[Array], list[Array], list[Array]]:
    """The four B-splines that are not 0 at the share t of a cell, and their first and second derivatives by t [1]."""
    s = 1.0 - t
    value = [s**3 / 6, 2 / 3 - t**2 + t**3 / 2, 2 / 3 - s**2 + s**3 / 2, t**3 / 6]
    return value, [-(s**2) / 2, t * (1.5 * t - 2), -s * (1.5 * s - 2), t**2 / 2], [s, 3 * t - 2, 3 * s - 2, t]


def _mixed(c: Array, weight: list[Array]) -> Array:
    """Weighted sum over the leading axis; written out, so that the trailing axes stay vectors."""
    return c[0] * weight[0] + c[1] * weight[1] + c[2] * weight[2] + c[3] * weight[3]


class _Cell(NamedTuple):
    """The cell that a query reads, axis by axis: scalars, which `vmap` turns into vectors."""

    coefficients: Float[Array, "4 4 4"]
    """Of the B-splines that are not 0 in the cell [m]."""
    t: list[Array]
    """Position in the cell [1]."""
    way: list[Array]
    """From the nearest place in the grid to the query [m]."""


def _cell_at(field: GridField, x: Vector3) -> _Cell:
    """The cell of the nearest place in the grid."""
    layout = field.layout
    cell, t, way = [], [], []
    for a, (low, high, nodes) in enumerate(zip(layout.lower, layout.upper, layout.shape, strict=True)):
        place = jnp.where(x[a] < low, low, jnp.where(x[a] > high, high, x[a]))  # its derivative at the border is 1
        u = (place - low) / layout.spacing
        index = jnp.clip(jax.lax.stop_gradient(u).astype(jnp.int32), 0, nodes - 2)
        cell.append(index)
        t.append(u - index.astype(x.dtype))
        way.append(x[a] - place)
    return _Cell(jax.lax.dynamic_slice(field.coefficients, cell, (4, 4, 4)), t, way)


def _length(way: list[Array]) -> tuple[Array, Array]:
    """Length of a way [m] and its inverse [1/m]; 0 and 1 where it is 0, not a number and 0 where it is infinite."""
    square = way[0] ** 2 + way[1] ** 2 + way[2] ** 2
    inverse = 1.0 / jnp.sqrt(jnp.where(square > 0, square, 1.0))
    return square * inverse, inverse


def grid_distance(field: GridField, x: Vector3) -> Float[Array, ""]:
    """The distance at x [m]. NaN at a query that is not finite: it must not read as free space.

    Outside the grid the distance at the nearest place in it and the way there are added: continuous, with a kink at the
    border, and too far rather than too near.

    Raises:
        ValueError: x is of integers.
    """
    require_floating("grid_distance", x=x)
    near, t, way = _cell_at(field, x)
    for share in t:
        near = _mixed(near, _basis(share)[0])
    return near + _length(way)[0]


def grid_distance_and_gradient(field: GridField, x: Vector3) -> tuple[Float[Array, ""], Vector3]:
    """`grid_distance` and its gradient at x in one pass [m], [1]. Their derivatives by x are gradient and Hessian in closed form.

    Raises:
        ValueError: x is of integers.
    """
    require_floating("grid_distance_and_gradient", x=x)
    return _read(field, x)


@jax.custom_jvp
def _read(field: GridField, x: Vector3) -> tuple[Float[Array, ""], Vector3]:
    near, t, way = _cell_at(field, x)
    d, slopes = _inside(near, t)
    length, inverse = _length(way)
    out = length * inverse**2  # the inverse again, but 0 inside
    g = [jnp.where(v == 0, slope / field.layout.spacing, 0.0) + v * out for v, slope in zip(way, slopes, strict=True)]
    return d + length, jnp.stack(g)


def _inside(near: Float[Array, "4 4 4"], t: list[Array]) -> tuple[Array, list[Array]]:
    """The spline and its derivatives by the shares of the cell [m]."""
    (wx, dx, _), (wy, dy, _), (wz, dz, _) = (_basis(share) for share in t)
    plane = _mixed(near, wx)
    line = _mixed(plane, wy)
    slopes = [_mixed(_mixed(_mixed(near, dx), wy), wz), _mixed(_mixed(plane, dy), wz), _mixed(line, dz)]
    return _mixed(line, wz), slopes


def _curved(near: Float[Array, "4 4 4"], t: list[Array]) -> list[list[Array]]:
    """The second derivatives of the spline by the shares of the cell [m]."""
    (wx, dx, ex), (wy, dy, ey), (wz, dz, ez) = (_basis(share) for share in t)
    plane, tilted = _mixed(near, wx), _mixed(near, dx)
    xx, yy = _mixed(_mixed(_mixed(near, ex), wy), wz), _mixed(_mixed(plane, ey), wz)
    line = _mixed(tilted, wy)
    xy, xz, yz = _mixed(_mixed(tilted, dy), wz), _mixed(line, dz), _mixed(_mixed(plane, dy), dz)
    zz = _mixed(_mixed(plane, wy), ez)
    return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]


def _read_jvp(primals, tangents):
    field, x = primals
    field_dot, x_dot = tangents
    d, g = _read(field, x)
    near, t, way = _cell_at(field, x)
    spacing = field.layout.spacing
    d_dot, g_dot = jnp.zeros_like(d), jnp.zeros_like(g)
    if not isinstance(x_dot, SymbolicZero):
        length, inverse = _length(way)
        out = length * inverse**2
        within = [v == 0 for v in way]
        second = _curved(near, t)
        rows = []
        for i in range(3):
            row = jnp.where(within[i], 0.0, out * x_dot[i])
            for j in range(3):
                spline = jnp.where(within[i] & within[j], second[i][j] / spacing**2, 0.0)
                row = row + (spline - way[i] * way[j] * out**3) * x_dot[j]
            rows.append(row)
        d_dot, g_dot = jnp.sum(g * x_dot), jnp.stack(rows)
    if not isinstance(field_dot.coefficients, SymbolicZero):  # linear in them
        change, _, _ = _cell_at(GridField(field_dot.coefficients, field.layout), x)
        more, slopes = _inside(change, t)
        d_dot = d_dot + more
        g_dot = g_dot + jnp.stack([jnp.where(v == 0, s / spacing, 0.0) for v, s in zip(way, slopes, strict=True)])
    return (d, g), (d_dot, g_dot)


_read.defjvp(_read_jvp, symbolic_zeros=True)
