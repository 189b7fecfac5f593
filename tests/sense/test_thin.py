"""Thinning against a NumPy dictionary of voxels."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.geom.cloud import Cloud
from hrcjax.sense.thin import thin

_thin = jax.jit(thin, static_argnums=2)


def _voxels(points, voxel, least=1):
    groups = {}
    for p in points:
        groups.setdefault(tuple(np.floor(p / voxel).astype(int)), []).append(p)
    return np.array([np.mean(g, axis=0) for g in groups.values() if len(g) >= least]).reshape(-1, 3)


def _ordered(points, centre):
    return points[np.argsort(np.linalg.norm(points - centre, axis=-1))]


@pytest.mark.parametrize("least", [1, 2])
@pytest.mark.parametrize("centre", [(0.0, 0.0, 0.0), (0.5, -0.3, 0.21)])
def test_means_of_voxels_nearest_first(least, centre, dtype):
    rng = np.random.default_rng(0)
    points = rng.normal(size=(200, 3)) * 0.15
    mask = rng.random(200) < 0.8
    centre = np.asarray(centre)
    expected = _ordered(_voxels(points[mask], 0.1, least), centre)
    cloud = Cloud(jnp.asarray(points, dtype), jnp.asarray(mask))
    mine, overflow = _thin(cloud, 0.1, 256, jnp.asarray(centre, dtype), float(least))
    assert mine.points.dtype == dtype and mine.points.shape == (256, 3)
    assert int(mine.mask.sum()) == len(expected) and not bool(overflow)
    np.testing.assert_allclose(np.asarray(mine.points)[: len(expected)], expected, atol=2e-6)
    assert np.isfinite(mine.points).all()

    few, lost = _thin(cloud, 0.1, 10, jnp.asarray(centre, dtype), float(least))
    assert bool(lost) and np.asarray(few.mask).all()
    np.testing.assert_allclose(few.points, expected[:10], atol=2e-6)
    exact, lost = _thin(cloud, 0.1, len(expected), jnp.asarray(centre, dtype), float(least))
    assert not bool(lost) and np.asarray(exact.mask).all()


def test_nothing_far_points_and_errors(dtype):
    none = Cloud(jnp.ones((20, 3), dtype), jnp.zeros(20, bool))
    mine, overflow = _thin(none, 0.04, 8, jnp.zeros(3, dtype))
    assert not np.asarray(mine.mask).any() and not bool(overflow)
    far = Cloud(jnp.asarray([[0.1, 0, 0], [30.0, 0, 0]], dtype), jnp.ones(2, bool))
    mine, overflow = _thin(far, 0.04, 8, jnp.zeros(3, dtype))
    assert int(mine.mask.sum()) == 1 and bool(overflow)
    with pytest.raises(ValueError, match="capacity 0"):
        thin(none, 0.04, 0, jnp.zeros(3, dtype))


def test_derivative_of_a_mean():
    points = jnp.asarray([[0.01, 0.02, 0.03], [0.03, 0.01, 0.01], [0.5, 0.5, 0.5]])
    jacobian = jax.jacobian(lambda p: thin(Cloud(p, jnp.ones(3, bool)), 0.04, 2, jnp.zeros(3))[0].points)(points)
    np.testing.assert_allclose(jacobian[0, :, 0], np.eye(3) / 2, atol=1e-12)
    np.testing.assert_allclose(jacobian[0, :, 2], 0, atol=1e-12)
    np.testing.assert_allclose(jacobian[1, :, 2], np.eye(3), atol=1e-12)
    assert np.isfinite(jacobian).all()
