"""The voxels in which a person is followed: indices, middles, and growing by one voxel."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from hrcjax.typing import Array, Bool, Float, Int, UInt

Columns = UInt[Array, "x y"]
"""A set of voxels: one number a column, bit z for the voxel at height z. Growing and joining work on whole columns."""
HIGHEST = 32
"""Voxels of a column, at most."""


@dataclass(frozen=True)
class VoxelLayout:
    """A box of cubic voxels."""

    lower: tuple[float, float, float]
    """Corner with the least coordinates [m]."""
    shape: tuple[int, int, int]
    """Voxels along x, y and z."""
    edge: float
    """Edge of a voxel [m]."""

    def __post_init__(self) -> None:
        """Refuses boxes that are too high.

        Raises:
            ValueError: more than 32 voxels along z, fewer than 4 along an edge, or an odd number.
        """
        if self.shape[2] > HIGHEST or min(self.shape) < 4 or any(n % 2 for n in self.shape):
            raise ValueError(
                f"{self}: accepted are even numbers of at least 4 voxels along each edge, and at most {HIGHEST} along z"
            )

    @property
    def count(self) -> int:
        """Number of voxels."""
        return self.shape[0] * self.shape[1] * self.shape[2]


CELL_VOXELS = VoxelLayout((-2.0, -2.0, 0.0), (80, 80, 28), 0.05)
"""The surroundings of an arm: everything within 2 m of its base, up to 1.4 m above the table."""


def centres(layout: VoxelLayout, dtype: jnp.dtype | type) -> Float[Array, "voxel 3"]:
    """Middles of the voxels, x slowest [m]."""
    axes = [layout.lower[a] + layout.edge * (jnp.arange(layout.shape[a]).astype(dtype) + 0.5) for a in range(3)]
    grid = jnp.meshgrid(*(jnp.asarray(v, dtype) for v in axes), indexing="ij")
    return jnp.stack([v.reshape(-1) for v in grid], axis=-1)


def voxel_of(layout: VoxelLayout, points: Float[Array, "*n 3"]) -> Int[Array, "*n"]:
    """Index of the voxel that holds each point; `layout.count`: none."""
    cell = jnp.floor((points - jnp.asarray(layout.lower, points.dtype)) / layout.edge)
    shape = jnp.asarray(layout.shape, points.dtype)
    inside = jnp.all((cell >= 0) & (cell < shape), axis=-1)
    i = jnp.where(inside[..., None], cell, 0).astype(jnp.int32)
    _, ny, nz = layout.shape
    return jnp.where(inside, (i[..., 0] * ny + i[..., 1]) * nz + i[..., 2], layout.count)


def pack_columns(layout: VoxelLayout, filled: Bool[Array, "voxel"]) -> Columns:
    """A set of voxels in bits."""
    bits = filled.reshape(layout.shape).astype(jnp.uint32) << jnp.arange(layout.shape[2], dtype=jnp.uint32)
    return jnp.sum(bits, axis=-1, dtype=jnp.uint32)


def unpack_columns(layout: VoxelLayout, columns: Columns) -> Bool[Array, "voxel"]:
    """A set of voxels, one by one."""
    bits = columns[..., None] >> jnp.arange(layout.shape[2], dtype=jnp.uint32)
    return ((bits & 1) == 1).reshape(-1)


def all_voxels(layout: VoxelLayout) -> Columns:
    """Every voxel of the box."""
    return jnp.full(layout.shape[:2], (1 << layout.shape[2]) - 1, jnp.uint32)


def count_voxels(columns: Columns) -> Int[Array, ""]:
    """Number of voxels of a set."""
    return jnp.sum(jax.lax.population_count(columns), dtype=jnp.uint32).astype(jnp.int32)


def _shifted(columns: Columns, axis: int) -> tuple[Columns, Columns]:
    """The set moved by one voxel up and down along x or y; what leaves the box is lost, nothing enters."""
    none = jnp.zeros_like(jax.lax.slice_in_dim(columns, 0, 1, axis=axis))
    before, after = jax.lax.slice_in_dim(columns, 0, -1, axis=axis), jax.lax.slice_in_dim(columns, 1, None, axis=axis)
    return jnp.concatenate([none, before], axis=axis), jnp.concatenate([after, none], axis=axis)


def grow(layout: VoxelLayout, columns: Columns, steps: int = 1) -> Columns:
    """The set with all voxels within some steps, over corners too."""

    def step(_: int | Int[Array, ""], known: Columns) -> Columns:
        known = (known | (known << 1) | (known >> 1)) & all_voxels(layout)
        for axis in (0, 1):
            up, down = _shifted(known, axis)
            known = known | up | down
        return known

    return jax.lax.fori_loop(0, steps, step, columns)  # a loop: unrolled, XLA would compute every step many times


def beside(layout: VoxelLayout, columns: Columns) -> Columns:
    """The set with the six neighbours of its voxels."""
    more = columns | (((columns << 1) | (columns >> 1)) & all_voxels(layout))
    for axis in (0, 1):
        up, down = _shifted(columns, axis)
        more = more | up | down
    return more


def within(layout: VoxelLayout, columns: Columns) -> Columns:
    """The voxels all of whose six neighbours in the box are in the set too."""
    everything = all_voxels(layout)
    outside = everything & ~columns
    beside = (outside << 1) | (outside >> 1)
    for axis in (0, 1):
        up, down = _shifted(outside, axis)
        beside = beside | up | down
    return columns & ~beside


def inside_box(layout: VoxelLayout, box: tuple[Float[Array, "3"], Float[Array, "3"]]) -> Bool[Array, "voxel"]:
    """True where the middle of a voxel lies between two corners [m]."""
    x = centres(layout, box[0].dtype)
    return jnp.all((x > box[0]) & (x < box[1]), axis=-1)
