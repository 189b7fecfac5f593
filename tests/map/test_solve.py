"""Exact weights of local blocks beside the lumped ones of the map."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.field import FAR
from hrcjax.map import (
    MapParams,
    View,
    empty_map,
    exact_distance_and_gradient,
    exact_field,
    map_distance_and_gradient,
    nearest_points,
)
from hrcjax.sense import d435i

SPACING = 0.025


@pytest.fixture(scope="module")
def flat(layout, points_program):
    """A plane sampled at the middles of its voxels, z = 0.0125."""
    a, b = np.meshgrid(*2 * [np.arange(-20, 20) * SPACING + SPACING / 2])
    points = np.stack([a.ravel(), b.ravel(), np.full(a.size, SPACING / 2)], axis=1).astype(np.float32)
    camera = d435i(jnp.asarray([0.0, -1.0, 0.9], jnp.float32), jnp.zeros(3, jnp.float32), 1)
    count = len(points)
    view = View(jnp.asarray(points), jnp.ones(count, bool), jnp.full(count, 1e-6), jnp.zeros((120, 160), jnp.float32))
    return points_program(empty_map(layout), camera, view)[0]


@pytest.fixture(scope="module")
def places():
    """Within 25 cm over the plane's middle."""
    return np.random.default_rng(0).uniform([-0.1, -0.1, 0.02], [0.1, 0.1, 0.26], (64, 3)).astype(np.float32)


def test_lumped_and_exact_agree_on_regular_samples(layout, flat, places):
    ratio = MapParams().ratio
    exact = jax.jit(jax.vmap(lambda x: exact_distance_and_gradient(layout, flat.levels, x, ratio)))
    lumped = jax.jit(jax.vmap(lambda x: map_distance_and_gradient(layout, flat.levels, ratio, x, corrected=False)))
    (d, g), (d_lumped, g_lumped) = exact(places), lumped(places)
    assert np.max(np.abs(d - d_lumped)) < 2e-3
    assert np.max(np.abs(d - (places[:, 2] - SPACING / 2))) < 2e-3
    assert np.min(np.sum(g * g_lumped, axis=1)) > 0.98


@pytest.mark.parametrize("ratio", [0.7, 1.0])
def test_weights_solve_the_equations(layout, flat, ratio):
    x = jnp.asarray([0.01, 0.02, 0.05], jnp.float32)
    field, ok = jax.jit(lambda x: exact_field(layout, flat.levels, x, ratio))(x)
    assert bool(ok)
    p, w = (np.asarray(v, np.float64)[np.asarray(field.mask)] for v in (field.points, field.weights))
    K = np.exp(-0.5 * np.sum((p[:, None] - p[None]) ** 2, axis=2) / (ratio * SPACING) ** 2) + 1e-4 * np.eye(len(p))
    np.testing.assert_allclose(K @ w, 1, atol=0.01)
    assert np.min(w) < 0 or ratio < 1  # negative weights are met, and the query stays finite


def test_too_long_a_scale_is_said_and_answered_by_lumped_weights(layout, flat):
    x = jnp.asarray([0.01, 0.02, 0.05], jnp.float32)
    field, ok = jax.jit(lambda x: exact_field(layout, flat.levels, x, 8.0, 1e-4))(x)
    assert not bool(ok) and np.all(np.asarray(field.weights) >= 0) and np.isfinite(field.weights).all()


def test_nothing_about(layout):
    x = jnp.asarray([0.0, 0.0, 0.1], jnp.float32)
    levels = empty_map(layout).levels
    d, g = jax.jit(lambda x: exact_distance_and_gradient(layout, levels, x, 0.7))(x)
    assert float(d) == FAR and not np.any(g)
    assert not np.any(jax.jit(lambda x: nearest_points(layout, levels, x))(x).mask)


def test_derivatives_are_finite(layout, flat):
    slope = jax.jit(jax.vmap(jax.grad(lambda x: exact_distance_and_gradient(layout, flat.levels, x, 0.7)[0])))
    at = jnp.asarray([[0.0, 0.0, 0.0125], [0.0125, 0.0125, 0.0125], [0.03, 0.02, 0.2]], jnp.float32)
    assert np.isfinite(slope(at)).all()
