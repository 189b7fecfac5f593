"""The union of two fields: the sum of their occupancies, and each alone."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from samples import cloud, plane, sphere

from hrcjax.field import (
    FAR,
    MATERN12,
    SQUARED_EXPONENTIAL,
    FieldParams,
    GPField,
    distance,
    distance_and_gradient,
    fit,
    union_distance,
    union_distance_and_gradient,
)

PARAMS = FieldParams(0.03, 0.02)
union = jax.jit(jax.vmap(union_distance_and_gradient, in_axes=(None, None, 0)))
PLACES = np.asarray([[0.0, 0, 0.08], [0.05, 0.02, 0.12], [0.02, -0.01, 0.03], [0.3, 0.1, 0.3], [1.0, -2.0, 2.0]])


def pair(kernel=SQUARED_EXPONENTIAL, dtype=np.float64, solver="lumped"):
    static = fit(cloud(plane(4, 0.03), dtype, missing=2), PARAMS, kernel, solver)
    return static, fit(cloud(sphere(40, 0.06, (0, 0, 0.2)), dtype, missing=3), PARAMS, kernel, solver)


@pytest.mark.parametrize(
    ("kernel", "solver"), [(SQUARED_EXPONENTIAL, "lumped"), (SQUARED_EXPONENTIAL, "cholesky"), (MATERN12, "lumped")]
)
def test_same_as_one_field_of_all_points(kernel, solver):
    static, moving = pair(kernel, solver=solver)
    joined = GPField(
        *(jnp.concatenate([getattr(f, name) for f in (static, moving)]) for name in ("points", "weights", "mask")),
        static.length_scale,
        kernel,
    )
    x = jnp.asarray(PLACES)
    d, g, d_moving, g_moving = union(static, moving, x)
    both = jax.jit(jax.vmap(jax.value_and_grad(distance, argnums=1), in_axes=(None, 0)))
    for got, want in zip((d, g), both(joined, x), strict=True):
        np.testing.assert_allclose(got, want, rtol=1e-8, atol=1e-9)
    for got, want in zip((d_moving, g_moving), both(moving, x), strict=True):
        np.testing.assert_allclose(got, want, rtol=1e-8, atol=1e-9)
    plain = jax.vmap(union_distance, in_axes=(None, None, 0))(static, moving, x)
    np.testing.assert_allclose(plain, d, rtol=1e-10)
    assert np.all(d <= d_moving) and np.any(d < 0.5 * d_moving)


def test_one_part_empty(dtype):
    static, moving = pair(dtype=dtype)
    x = jnp.asarray(PLACES, dtype)
    none = lambda f: eqx.tree_at(lambda f: (f.mask, f.weights), f, (f.mask & False, f.weights * 0))  # noqa: E731
    alone = jax.vmap(distance_and_gradient, in_axes=(None, 0))
    tolerance = 1e-5 if dtype == "float32" else 1e-9
    d, g, d_moving, g_moving = union(static, none(moving), x)
    np.testing.assert_allclose(d, alone(static, x)[0], rtol=tolerance)
    np.testing.assert_allclose(g, alone(static, x)[1], atol=tolerance)
    assert np.all(d_moving == FAR) and np.all(g_moving == 0) and d.dtype == g_moving.dtype == dtype
    d, g, d_moving, g_moving = union(none(static), moving, x)
    np.testing.assert_allclose(d, d_moving, rtol=tolerance)
    np.testing.assert_allclose(g, g_moving, atol=tolerance)
    np.testing.assert_allclose(d_moving, alone(moving, x)[0], rtol=tolerance)
    d, g, d_moving, _ = union(none(static), none(moving), x)
    assert np.all(d == FAR) and np.all(g == 0) and np.all(d_moving == FAR)


def test_far_part_does_not_underflow():
    """A moving part 2 m away keeps its distance and direction in float32 beside a static part at 5 cm."""
    static = fit(cloud(plane(3, 0.03), np.float32), PARAMS)
    moving = fit(cloud(sphere(40, 0.06, (0, 2.0, 0.05)), np.float32), PARAMS)
    d, g, d_moving, g_moving = union(static, moving, jnp.asarray([[0.0, 0.0, 0.05]], jnp.float32))
    np.testing.assert_allclose([d[0], d_moving[0]], [0.05, 1.94], atol=3e-3)
    np.testing.assert_allclose(g[0], [0, 0, 1], atol=0.01)
    np.testing.assert_allclose(g_moving[0], [0, -1, 0], atol=0.01)


@pytest.mark.slow
def test_reverse_mode_in_a_loop():
    """Gradient by length scale, weights and query through vmap of a scan, against differences."""
    static, moving = pair()

    def loss(length_scale, weights, x):
        fields = [
            eqx.tree_at(lambda f: (f.length_scale, f.weights), f, (length_scale, w))
            for f, w in zip((static, moving), weights, strict=True)
        ]

        def step(at, _):
            d, g, d_moving, g_moving = union_distance_and_gradient(*fields, at)
            return at + 0.01 * g - 0.02 * d_moving * g_moving, d

        def run(at):
            end, d = jax.lax.scan(step, at, None, length=3)
            return jnp.sum(end**2) + jnp.sum(d)

        return jnp.sum(jax.vmap(run)(x))

    start = (jnp.asarray(0.03), (static.weights, moving.weights), jnp.asarray(PLACES[:3]))
    rng = np.random.default_rng(0)
    way = jax.tree.map(lambda a: jnp.asarray(rng.normal(size=a.shape)) * 0.1, start)

    def shifted(h, a, b):
        return a + h * b

    for i in range(3):
        v = tuple(w if j == i else jax.tree.map(jnp.zeros_like, w) for j, w in enumerate(way))
        f = jax.jit(lambda h, v=v: loss(*jax.tree.map(partial(shifted, h), start, v)))
        difference = (f(1e-5) - f(-1e-5)) / 2e-5
        slope = jax.jit(jax.grad(loss, argnums=i))(*start)
        along = sum(jnp.sum(a * b) for a, b in zip(jax.tree.leaves(slope), jax.tree.leaves(way[i]), strict=True))
        np.testing.assert_allclose(along, difference, rtol=1e-4)


def test_kernels_must_agree():
    static, _ = pair()
    other = fit(cloud(plane(1, 0.03)), PARAMS, MATERN12)
    for f in (union_distance, union_distance_and_gradient):
        with pytest.raises(ValueError, match="'squared exponential' and 'Matern 1/2'"):
            f(static, other, jnp.zeros(3))
