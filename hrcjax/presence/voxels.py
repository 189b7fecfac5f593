"""The voxels in which a person is followed: indices, middles, and growing by one voxel."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from hrcjax.typing import Array, Bool, Float, Int


@dataclass(frozen=True)
class VoxelLayout:
    """A box of cubic voxels."""

    lower: tuple[float, float, float]
    """Corner with the least coordinates [m]."""
    shape: tuple[int, int, int]
    """Voxels along x, y and z."""
    edge: float
    """Edge of a voxel [m]."""

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


def grow(layout: VoxelLayout, filled: Bool[Array, "voxel"]) -> Bool[Array, "voxel"]:
    """The set with all 26 neighbours of its voxels."""
    grid = filled.reshape(layout.shape)
    for axis in range(3):
        before = jax.lax.slice_in_dim(grid, 0, -1, axis=axis)
        after = jax.lax.slice_in_dim(grid, 1, None, axis=axis)
        edge = jnp.zeros_like(jax.lax.slice_in_dim(grid, 0, 1, axis=axis))
        grid = grid | jnp.concatenate([edge, before], axis=axis) | jnp.concatenate([after, edge], axis=axis)
    return grid.reshape(-1)


def within(layout: VoxelLayout, filled: Bool[Array, "voxel"]) -> Bool[Array, "voxel"]:
    """The voxels all of whose six neighbours in the box are in the set too."""
    grid = filled.reshape(layout.shape)
    inner = grid
    for axis in range(3):
        before = jax.lax.slice_in_dim(grid, 0, -1, axis=axis)
        after = jax.lax.slice_in_dim(grid, 1, None, axis=axis)
        edge = jnp.ones_like(jax.lax.slice_in_dim(grid, 0, 1, axis=axis))
        inner = inner & jnp.concatenate([edge, before], axis=axis) & jnp.concatenate([after, edge], axis=axis)
    return inner.reshape(-1)


def inside_box(
    layout: VoxelLayout, box: tuple[Float[Array, "3"], Float[Array, "3"]]
) -> Bool[Array, "voxel"]:
    """True where the middle of a voxel lies between two corners [m]."""
    x = centres(layout, box[0].dtype)
    return jnp.all((x > box[0]) & (x < box[1]), axis=-1)
