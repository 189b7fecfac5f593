"""The points of one image: means of its own occupied voxels, the nearest first."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from hrcjax.presence import VoxelLayout, initial_track, pack_columns, voxel_of
from hrcjax.presence.image_points import image_points

BOX = VoxelLayout((-0.4, -0.4, 0.0), (8, 8, 8), 0.1)


def test_points_are_means_of_the_cameras_own_voxels() -> None:
    points = np.array([[0.11, 0.12, 0.31], [0.13, 0.14, 0.33], [-0.33, 0.25, 0.65], [0.32, 0.35, 0.75]])
    voxel = np.asarray(voxel_of(BOX, jnp.asarray(points, jnp.float32)))
    assert voxel[0] == voxel[1]
    sums = np.zeros((2, BOX.count, 4), np.float32)
    for v, p in zip(voxel, points, strict=True):
        sums[1, v] += [1, *p]
    occupied = np.zeros(BOX.count, bool)
    occupied[voxel[:3]] = True  # the last is a point that nothing supports
    track = initial_track(BOX, 2, jnp.zeros(()))
    sets = track.occupied.at[1].set(pack_columns(BOX, jnp.asarray(occupied)))
    track = eqx.tree_at(lambda t: (t.sums, t.occupied), track, (jnp.asarray(sums), sets))
    cloud = image_points(BOX, track, jnp.asarray(1), 4)
    assert np.asarray(cloud.mask).tolist() == [True, True, False, False]
    np.testing.assert_allclose(cloud.points[:2], [points[:2].mean(0), points[2]], atol=1e-6)
    assert not np.asarray(image_points(BOX, track, jnp.asarray(0), 4).mask).any()
    np.testing.assert_allclose(image_points(BOX, track, jnp.asarray(1), 1).points, points[:2].mean(0)[None], atol=1e-6)
