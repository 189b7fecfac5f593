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


def _basis(t: Float[Array, ""]) -> tuple[list[Array], list[Array]]:
    """The four B-splines that are not 0 at the share t of a cell, and their derivatives by t [1]."""
    s = 1.0 - t
    value = [s**3 / 6, 2 / 3 - t**2 + t**3 / 2, 2 / 3 - s**2 + s**3 / 2, t**3 / 6]
    return value, [-(s**2) / 2, t * (1.5 * t - 2), -s * (1.5 * s - 2), t**2 / 2]


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
    """`grid_distance` and its gradient at x in one pass [m], [1].

    Raises:
        ValueError: x is of integers.
    """
    require_floating("grid_distance_and_gradient", x=x)
    near, t, way = _cell_at(field, x)
    (wx, dx), (wy, dy), (wz, dz) = (_basis(share) for share in t)
    plane = _mixed(near, wx)
    line = _mixed(plane, wy)
    slopes = _mixed(_mixed(_mixed(near, dx), wy), wz), _mixed(_mixed(plane, dy), wz), _mixed(line, dz)
    length, inverse = _length(way)
    out = length * inverse**2  # the inverse again, but 0 inside
    g = [jnp.where(v == 0, slope / field.layout.spacing, 0.0) + v * out for v, slope in zip(way, slopes, strict=True)]
    return _mixed(line, wz) + length, jnp.stack(g)
