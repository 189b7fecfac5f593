"""The spline on a grid against cubic polynomials, scipy's spline, exact distances and its own derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import NdBSpline, make_interp_spline

from hrcjax.field import FAR, GridLayout, fit_grid, grid_distance, grid_distance_and_gradient, grid_nodes

LAYOUT = GridLayout((-0.4, 0.1, -0.2), (9, 7, 5), 0.1)
LOW, HIGH = np.asarray(LAYOUT.lower), np.asarray(LAYOUT.upper)
read = jax.jit(jax.vmap(grid_distance_and_gradient, in_axes=(None, 0)))
derive = jax.jit(jax.vmap(jax.value_and_grad(grid_distance, argnums=1), in_axes=(None, 0)))
hessian = jax.jit(jax.vmap(jax.hessian(grid_distance, argnums=1), in_axes=(None, 0)))


def random_field(seed: int = 0, dtype=jnp.float64):
    values = np.random.default_rng(seed).normal(size=LAYOUT.shape)
    return fit_grid(LAYOUT, jnp.asarray(values, dtype)), values


def places(count: int, seed: int = 1) -> np.ndarray:
    """Places in the grid, its corners among them."""
    x = np.random.default_rng(seed).uniform(LOW, HIGH, (count, 3))
    return np.concatenate([x, [LOW, HIGH]])


def test_nodes_are_in_the_order_of_the_values() -> None:
    x = np.asarray(grid_nodes(LAYOUT, jnp.float64)).reshape(*LAYOUT.shape, 3)
    np.testing.assert_allclose(x[3, 2, 1], LOW + 0.1 * np.array([3, 2, 1]))
    np.testing.assert_allclose(x[-1, -1, -1], HIGH)


def test_exact_on_cubic_polynomials() -> None:
    """To the very border: x^3, y^2 z and the like are the spline itself."""

    def polynomial(x):
        a, b, c = x[0], x[1], x[2]
        return 1 + a**3 - 2 * b**3 + 3 * c**3 + a**2 * b - a * b * c + 0.5 * b**2 * c**3

    values = jax.vmap(polynomial)(grid_nodes(LAYOUT, jnp.float64)).reshape(LAYOUT.shape)
    field, x = fit_grid(LAYOUT, values), jnp.asarray(places(200))
    d, g = read(field, x)
    np.testing.assert_allclose(d, jax.vmap(polynomial)(x), atol=1e-12)
    np.testing.assert_allclose(g, jax.vmap(jax.grad(polynomial))(x), atol=1e-11)
    np.testing.assert_allclose(hessian(field, x), jax.vmap(jax.hessian(polynomial))(x), atol=1e-9)


def test_is_the_spline_of_scipy(dtype) -> None:
    field, values = random_field(dtype=dtype)
    axes = [low + 0.1 * np.arange(n) for low, n in zip(LAYOUT.lower, LAYOUT.shape, strict=True)]
    knots, coefficients = [], values
    for along, nodes in enumerate(axes):
        spline = make_interp_spline(nodes, np.moveaxis(coefficients, along, 0))
        knots.append(spline.t)
        coefficients = np.moveaxis(spline.c, 0, along)
    oracle, x = NdBSpline(tuple(knots), coefficients, 3, extrapolate=True), places(300)
    d, _ = read(field, jnp.asarray(x, dtype))
    assert d.dtype == dtype
    np.testing.assert_allclose(d, oracle(x), atol=3e-5 if dtype == "float32" else 1e-11)


def test_gradient_is_the_derivative(dtype) -> None:
    """Inside, on the border, and out over faces, edges and corners."""
    field, _ = random_field(dtype=dtype)
    x = np.concatenate([places(100), np.random.default_rng(2).uniform(LOW - 1, HIGH + 1, (100, 3))])
    for got, want in zip(read(field, jnp.asarray(x, dtype)), derive(field, jnp.asarray(x, dtype)), strict=True):
        assert np.isfinite(got).all() and got.dtype == dtype
        np.testing.assert_allclose(got, want, rtol=1e-5, atol=1e-4 if dtype == "float32" else 1e-10)


def test_second_derivatives_are_continuous() -> None:
    field, _ = random_field()
    node = LOW + 0.1 * np.array([4, 3, 2])
    for axis in range(3):
        step, shift = 1e-9 * np.eye(3)[axis], 0.03 * (1 - np.eye(3)[axis])
        before, after = hessian(field, jnp.asarray([node + shift - step, node + shift + step]))
        np.testing.assert_allclose(before, after, atol=1e-4)
        assert np.abs(before).max() > 1.0


def test_outside_the_way_there_is_added() -> None:
    field, _ = random_field()
    way = np.array([[0.3, 0, 0], [0, -0.2, 0.1], [0.1, 0.2, -0.2]])
    border = np.array([[HIGH[0], 0.33, 0.07], [0.11, LOW[1], HIGH[2]], [HIGH[0], HIGH[1], LOW[2]]])
    d, g = read(field, jnp.asarray(border + way))
    at_border, _ = read(field, jnp.asarray(border))
    np.testing.assert_allclose(d, at_border + np.linalg.norm(way, axis=1), atol=1e-12)
    out = np.where(way != 0, way / np.linalg.norm(way, axis=1, keepdims=True), 0)
    np.testing.assert_allclose(np.where(way != 0, g, 0), out, atol=1e-12)
    near, _ = read(field, jnp.asarray(border + 1e-9 * way))
    np.testing.assert_allclose(near, at_border, atol=1e-8)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("axis", [0, 2])
def test_a_query_that_is_not_finite_is_not_a_distance(bad, axis) -> None:
    field, _ = random_field()
    x = (LOW + HIGH) / 2
    x[axis] = bad
    for d, g in (read(field, jnp.asarray(x[None])), derive(field, jnp.asarray(x[None]))):
        assert np.isnan(d).all() and np.isnan(g).all()


def test_nothing_around_is_far() -> None:
    field = fit_grid(LAYOUT, jnp.full(LAYOUT.shape, FAR, jnp.float32))
    d, g = read(field, jnp.asarray(places(50), jnp.float32))
    np.testing.assert_allclose(d, FAR, atol=1e-4)
    np.testing.assert_allclose(g, 0, atol=1e-3)


def test_linear_in_the_values_and_differentiable_by_them() -> None:
    """The derivative by the values, times the values, is the distance."""
    _, values = random_field()
    x = jnp.asarray(places(5))

    def total(values):
        return jnp.sum(jax.vmap(grid_distance, in_axes=(None, 0))(fit_grid(LAYOUT, values), x))

    value, slope = jax.jit(jax.value_and_grad(total))(jnp.asarray(values))
    np.testing.assert_allclose(np.sum(slope * values), value, rtol=1e-10)
    assert np.count_nonzero(np.abs(slope) > 1e-3) > 50


def test_distance_to_a_ball() -> None:
    """A tenth of a millimetre two spacings off the surface, where the spacing is a fifth of the radius."""
    layout = GridLayout((-0.4, -0.4, -0.4), (33, 33, 33), 0.025)
    values = jnp.linalg.norm(grid_nodes(layout, jnp.float64), axis=1).reshape(layout.shape) - 0.12
    x = np.random.default_rng(3).normal(size=(500, 3))
    x *= np.random.default_rng(4).uniform(0.17, 0.35, (500, 1)) / np.linalg.norm(x, axis=1, keepdims=True)
    d, g = read(fit_grid(layout, values), jnp.asarray(x))
    radius = np.linalg.norm(x, axis=1, keepdims=True)
    np.testing.assert_allclose(d, radius[:, 0] - 0.12, atol=1e-4)
    np.testing.assert_allclose(g, x / radius, atol=1e-3)


def test_refuses_what_is_no_grid() -> None:
    for lower, shape, spacing in (
        ((0.0, 0.0, 0.0), (3, 9, 9), 0.1),
        ((0.0, 0.0, 0.0), (9, 9, 9), 0.0),
        ((0.0, np.nan, 0.0), (9, 9, 9), 0.1),
        ((0.0, 0.0, 0.0), (9, 9, 9), np.inf),
    ):
        with pytest.raises(ValueError, match="at least 4 nodes"):
            GridLayout(lower, shape, spacing)
    with pytest.raises(ValueError, match=r"\(9, 7, 5\)"):
        fit_grid(LAYOUT, jnp.zeros((7, 9, 5)))
    with pytest.raises((ValueError, TypeError), match=r"fit_grid|values"):
        fit_grid(LAYOUT, jnp.zeros(LAYOUT.shape, int))
    field, _ = random_field()
    for function in (grid_distance, grid_distance_and_gradient):
        with pytest.raises((ValueError, TypeError), match=r"x"):
            function(field, jnp.zeros(3, int))
