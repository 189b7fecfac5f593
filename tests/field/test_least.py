"""The lower bound of the distance to the nearest point: never above it, near it, differentiable everywhere."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from samples import cloud, sphere
from scipy.spatial import KDTree
from scipy.special import logsumexp

from hrcjax.field import FieldParams, GPField, fit, log_occupancy
from hrcjax.field.least import log_least_weight, nearest_bound
from hrcjax.geom.cloud import Cloud

ROOM = 24
"""Points of the random clouds, at most."""


def bound(field: GPField, x):
    return nearest_bound(log_occupancy(field, x), log_least_weight(field), field.length_scale)


read = jax.jit(jax.vmap(bound, (None, 0)))


@jax.jit
def bounds(points, mask, length_scale, noise, x):
    """Bounds at some queries."""
    field = fit(Cloud(points, mask), FieldParams(length_scale, noise))
    return jax.vmap(lambda one: bound(field, one))(x)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, ROOM),
    size=st.floats(0.01, 0.6),
    length_scale=st.floats(0.01, 0.2),
    noise=st.floats(0.001, 0.3),
    single=st.booleans(),
)
def test_never_above_the_nearest_point(seed, count, size, length_scale, noise, single) -> None:
    """Whatever the shape, its density and the length scale; on the points, near and far, in both precisions."""
    rng = np.random.default_rng(seed)
    dtype = np.float32 if single else np.float64
    points = rng.normal(size=(ROOM, 3)).astype(dtype) * dtype(size)
    if count > 3:
        points[1] = points[0]  # two alike
    away = rng.normal(size=(30, 3)) * np.geomspace(1e-3, 5.0, 30)[:, None]
    x = np.concatenate([points[:3], points[rng.integers(0, count, 30)] + away.astype(dtype)])
    got = np.asarray(bounds(points, np.arange(ROOM) < count, dtype(length_scale), dtype(noise), x), np.float64)
    true = KDTree(points[:count]).query(x)[0]
    # the logarithms are right to 1e-6 of their size in float32, where the slope by them is 7.5 l at most
    slack = 1e-6 + 2e-6 * true + 2e-5 * length_scale if single else 1e-9
    assert np.all(np.isfinite(got)) and np.all(got <= true + slack)
    assert np.all(got >= 0)


def test_near_the_truth_for_evenly_spaced_points() -> None:
    """A ball of people's size, 5 cm apart as in the cell: some centimetres at first, less with the distance.

    In theory at most r - sqrt(r^2 - 2 l^2 ln(sum alpha / min alpha)).
    """
    radius, scale = 0.12, 0.035
    points = sphere(int(4 * np.pi * (radius / 0.05) ** 2), radius)
    field = fit(cloud(points, missing=2), FieldParams(scale))
    d = np.array([0.05, 0.1, 0.2, 0.5, 1.0, 2.0])
    x = (radius + d)[:, None] * np.array([0.48, 0.6, -0.64])
    nearest, got = KDTree(points).query(x)[0], np.asarray(read(field, jnp.asarray(x)))
    lost, weights = nearest - got, np.asarray(field.weights)
    assert np.all(lost >= -1e-12) and np.all(lost < [0.04, 0.015, 0.005, 0.001, 3e-4, 1e-4])
    most = np.log(weights.sum() / weights[weights > 0].min())
    assert np.all(got >= np.sqrt(np.maximum(nearest**2 - 2 * scale**2 * most, 0)) - 1e-12)


def test_exact_for_one_point_and_for_points_of_equal_weight_at_one_distance(dtype) -> None:
    """One point: r. Six on the axes, query at their middle: the occupancy is six times as large, r^2 - 2 l^2 ln 6."""
    scale = 0.05
    x = np.array([[0.3, 0.0, 0.4], [0.0, 1.0, 0.0]])
    one = fit(cloud(np.zeros((1, 3)), dtype, missing=3), FieldParams(scale))
    np.testing.assert_allclose(read(one, jnp.asarray(x, dtype)), [0.5, 1.0], rtol=1e-5)
    six = fit(cloud(0.4 * np.concatenate([np.eye(3), -np.eye(3)]), dtype), FieldParams(scale))
    want = np.sqrt(0.4**2 - 2 * scale**2 * np.log(6))
    np.testing.assert_allclose(read(six, jnp.zeros((1, 3), dtype)), want, rtol=1e-5)


def test_the_formula_by_scipy() -> None:
    """sqrt(-2 l^2 (ln sum_i alpha_i k_i - ln min alpha)), where alpha differs from point to point; masked ones do not count."""
    rng, scale = np.random.default_rng(5), 0.06
    points = np.concatenate([rng.normal(size=(12, 3)) * 0.03, rng.normal(size=(4, 3)) * 0.3])
    field = fit(cloud(points, missing=3), FieldParams(scale, 0.1))
    k = np.exp(-0.5 * ((points[:, None] - points) ** 2).sum(-1) / scale**2)
    alpha = 1 / (0.01 + k.sum(1))
    assert alpha.max() > 3 * alpha.min()
    np.testing.assert_allclose(log_least_weight(field), np.log(alpha.min()), rtol=1e-10)
    x = rng.normal(size=(20, 3))
    r2 = ((x[:, None] - points) ** 2).sum(-1)
    want = scale * np.sqrt(-2 * (logsumexp(-0.5 * r2 / scale**2, b=alpha, axis=1) - np.log(alpha.min())))
    np.testing.assert_allclose(read(field, jnp.asarray(x)), want, rtol=1e-9)


def test_gradient_is_finite_everywhere_and_a_difference(dtype) -> None:
    """By query and by length scale: on a point, between two, amid six, far away, and without points."""
    places = np.array([[0.0, 0, 0], [0.05, 0, 0], [1e-9, 0, 0], [0.3, -0.2, 0.1], [40.0, 3.0, -5.0]])

    def value(points, mask, scale, x):
        return bound(fit(Cloud(points, mask), FieldParams(scale)), x)

    derive = jax.jit(jax.vmap(jax.value_and_grad(value, argnums=(2, 3)), (None, None, None, 0)))
    points = np.array([[0.0, 0, 0], [0.1, 0, 0], [0.05, 0.1, 0], [0.05, -0.1, 0]], dtype)
    scale, x = jnp.asarray(0.035, dtype), jnp.asarray(places, dtype)
    for count in (0, 1, 4):
        d, (by_scale, by_x) = derive(points, np.arange(4) < count, scale, x)
        assert np.isfinite(d).all() and np.isfinite(by_scale).all() and np.isfinite(by_x).all()
    if dtype == "float64":
        far = x[3:]
        step = 1e-6
        for axis in range(3):
            sides = [derive(points, np.ones(4, bool), scale, far + s * step * np.eye(3)[axis])[0] for s in (1, -1)]
            np.testing.assert_allclose(by_x[3:, axis], (sides[0] - sides[1]) / (2 * step), atol=1e-6)
        wider = [derive(points, np.ones(4, bool), scale + s * step, far)[0] for s in (1, -1)]
        np.testing.assert_allclose(by_scale[3:], (wider[0] - wider[1]) / (2 * step), atol=1e-5)
        assert by_x[3] @ places[3] > 0, "away from the points the bound grows"


def test_no_points_and_weights_that_are_none(dtype) -> None:
    some = fit(cloud(np.zeros((3, 3)), dtype), FieldParams())
    none = eqx.tree_at(lambda f: (f.weights, f.mask), some, (some.weights * 0, some.mask & False))
    assert log_least_weight(none) == 0
    batch = jax.tree.map(lambda *a: jnp.stack(a), none, some)
    np.testing.assert_allclose(log_least_weight(batch), [0, -np.log(3 + 1e-4)], rtol=1e-4)
    lost = eqx.tree_at(lambda f: f.weights, some, some.weights * 0)
    assert np.isfinite(log_least_weight(lost)), "weights that have vanished"
