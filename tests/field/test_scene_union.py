"""Scene and people read at once: the plain formula, derivatives by autodiff, surfaces, afar, and without people."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from samples import cloud, sphere
from scipy.special import logsumexp

from hrcjax.field import FAR, FieldParams, GridLayout, distance, distance_and_gradient, fit, fit_grid, grid_nodes
from hrcjax.field.grid import grid_distance, grid_distance_and_gradient
from hrcjax.field.scene_union import scene_and_people
from hrcjax.numerics import safe_norm

SCALE = 0.035
LAYOUT = GridLayout((-0.5, -0.5, -0.2), (26, 26, 20), 0.04)
BALL = np.array([0.1, 0.0, 0.1])
"""Middle of the ball that stands [m]."""
read = jax.jit(jax.vmap(scene_and_people, (None, None, 0)))
by_autodiff = jax.jit(
    jax.vmap(jax.grad(lambda s, p, x: scene_and_people(s, p, x).distance, argnums=2), (None, None, 0))
)


def parts(dtype=jnp.float64, people=True):
    """A ball of 12 cm that stands, and a round person of 10 cm beside it."""
    d = np.linalg.norm(np.asarray(grid_nodes(LAYOUT, np.float64)) - BALL, axis=1) - 0.12
    scene = fit_grid(LAYOUT, jnp.asarray(d.reshape(LAYOUT.shape), dtype))
    field = fit(cloud(sphere(60, 0.1, (-0.25, 0.1, 0.1)), dtype, missing=2), FieldParams(SCALE))
    none = eqx.tree_at(lambda f: (f.weights, f.mask), field, (field.weights * 0, field.mask & False))
    return scene, field if people else none


def places(count=60, seed=0) -> np.ndarray:
    """Outside both and in the grid, then beyond it."""
    rng = np.random.default_rng(seed)
    x = np.concatenate([rng.uniform(-0.45, 0.45, (count, 3)), rng.uniform(-3, 3, (20, 3))])
    out = np.minimum(np.linalg.norm(x - BALL, axis=1) - 0.12, np.linalg.norm(x - [-0.25, 0.1, 0.1], axis=1) - 0.1)
    return x[out > 0.03]


def test_the_plain_formula(dtype) -> None:
    """d = l sqrt(-2 ln(exp(-d_scene^2 / 2 l^2) + sum_i alpha_i exp(-r_i^2 / 2 l^2))), 2 cm off surfaces and farther."""
    scene, people = parts(dtype)
    x = places()
    d_scene = np.asarray(jax.vmap(grid_distance, (None, 0))(scene, jnp.asarray(x, dtype)), np.float64)
    points, weights = (np.asarray(v, np.float64)[np.asarray(people.mask)] for v in (people.points, people.weights))
    r2 = ((x[:, None] - points) ** 2).sum(-1)
    terms = np.concatenate([-0.5 * (d_scene**2)[:, None] / SCALE**2, np.log(weights) - 0.5 * r2 / SCALE**2], axis=1)
    both = read(scene, people, jnp.asarray(x, dtype))
    np.testing.assert_allclose(
        both.distance, SCALE * np.sqrt(-2 * logsumexp(terms, axis=1)), rtol=2e-5 if dtype == "float32" else 1e-10
    )
    assert both.distance.dtype == both.gradient.dtype == dtype
    np.testing.assert_allclose(
        both.people.log_occupancy, logsumexp(terms[:, 1:], axis=1), rtol=1e-4 if dtype == "float32" else 1e-10
    )
    np.testing.assert_allclose(
        both.people.offset, x - np.exp(terms[:, 1:] - logsumexp(terms[:, 1:], axis=1, keepdims=True)) @ points,
        atol=1e-5 if dtype == "float32" else 1e-10,
    )  # fmt: skip


def test_near_one_of_them_it_is_that_one_and_amid_both_it_is_nearer() -> None:
    scene, people = parts()
    beside_ball, beside_person = np.add(BALL, [0.15, -0.1, 0.05]), np.array([-0.4, 0.15, 0.1])
    between = np.array([-0.085, 0.05, 0.1])
    d = read(scene, people, jnp.asarray([beside_ball, beside_person, between])).distance
    np.testing.assert_allclose(d[0], grid_distance(scene, jnp.asarray(beside_ball)), rtol=1e-6)
    np.testing.assert_allclose(d[1], distance(people, jnp.asarray(beside_person)), rtol=1e-6)
    near = grid_distance(scene, jnp.asarray(between)), distance(people, jnp.asarray(between))
    assert d[2] < min(near) - 0.002 and abs(near[0] - near[1]) < 0.03


def test_gradient_is_the_derivative(dtype) -> None:
    """Near and far, on the ball's surface, in the ball, on the person's points, out of the grid; finite at each of them."""
    scene, people = parts(dtype)
    steps = np.outer([-0.05, -0.01, 0.0, 0.004, 0.02], [0.6, 0.0, -0.8])
    surface = BALL + 0.12 * np.array([0.6, 0.0, -0.8]) + steps
    x = jnp.asarray(np.concatenate([places(), surface, np.asarray(people.points)[5:8] + 1e-4]), dtype)
    both, slope = read(scene, people, x), by_autodiff(scene, people, x)
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves((both, slope)))
    np.testing.assert_allclose(both.gradient, slope, rtol=1e-4, atol=2e-3 if dtype == "float32" else 1e-7)
    if dtype == "float64":
        far, step = x[: len(places())], 1e-6
        for axis in range(3):
            sides = [read(scene, people, far + s * step * np.eye(3)[axis]).distance for s in (1, -1)]
            np.testing.assert_allclose(both.gradient[: len(far), axis], (sides[0] - sides[1]) / (2 * step), atol=1e-5)


def test_gradient_points_away() -> None:
    scene, people = parts()
    x = np.array([[0.35, 0.0, 0.1], [-0.45, 0.1, 0.1], [1.2, 0.2, 0.3], [-2.0, 0.1, 0.1]])
    g = np.asarray(read(scene, people, jnp.asarray(x)).gradient)
    assert g[0, 0] > 0.99 and g[1, 0] < -0.95 and g[2, 0] > 0.9 and g[3, 0] < -0.9


def test_within_what_stands_the_distance_is_0() -> None:
    scene, people = parts()
    both = read(scene, people, jnp.asarray([np.add(BALL, [0.02, 0.0, 0.01]), np.add(BALL, [0.0, 0.1, 0.0])]))
    np.testing.assert_array_equal(both.distance, 0)
    np.testing.assert_array_equal(both.gradient, 0)


def test_nobody(dtype) -> None:
    """The scene alone, wherever it is not within the bend at a surface; a scene of nothing leaves the people alone."""
    scene, none = parts(dtype, people=False)
    x = jnp.asarray(places(), dtype)
    both = read(scene, none, x)
    d, g = jax.vmap(grid_distance_and_gradient, (None, 0))(scene, x)
    tolerance = 1e-5 if dtype == "float32" else 1e-10
    np.testing.assert_allclose(both.distance, d, rtol=tolerance)
    np.testing.assert_allclose(both.gradient, g, atol=tolerance)
    assert not both.people.some.any()
    nothing, people = fit_grid(LAYOUT, jnp.full(LAYOUT.shape, FAR, dtype)), parts(dtype)[1]
    both = read(nothing, people, x)
    d, g = jax.vmap(distance_and_gradient, (None, 0))(people, x)
    np.testing.assert_allclose(both.distance, d, rtol=tolerance)
    np.testing.assert_allclose(both.gradient, g, atol=tolerance)


@pytest.mark.parametrize("present", [True, False])
def test_reverse_mode_by_length_scale_and_query(present) -> None:
    """Through the reading of a bound and its direction, as in the loop; against differences."""
    scene, _ = parts()
    points = cloud(sphere(20, 0.1, (-0.25, 0.1, 0.1)), missing=2)
    points = eqx.tree_at(lambda c: c.mask, points, points.mask & present)
    x = jnp.asarray([[0.05, 0.2, 0.15], [-0.1, 0.05, 0.3], [0.9, 0.2, 0.1]])

    def loss(scale, x):
        people = fit(points, FieldParams(scale))

        def one(x):
            both = scene_and_people(scene, people, x)
            return both.distance + both.gradient @ jnp.ones(3) + 0.1 * safe_norm(both.people.offset)

        return jnp.sum(jax.vmap(one)(x))

    value = jax.jit(loss)
    scale = jnp.asarray(SCALE)
    by_scale, by_x = jax.jit(jax.grad(loss, argnums=(0, 1)))(scale, x)
    assert np.isfinite(by_scale) and np.isfinite(by_x).all()
    way = np.random.default_rng(1).normal(size=x.shape)
    np.testing.assert_allclose(by_scale, (value(scale + 1e-6, x) - value(scale - 1e-6, x)) / 2e-6, rtol=1e-4, atol=1e-6)
    along = (value(scale, x + 1e-6 * way) - value(scale, x - 1e-6 * way)) / 2e-6
    np.testing.assert_allclose(np.sum(by_x * way), along, rtol=1e-4, atol=1e-6)


def test_a_query_that_is_not_finite_is_not_a_distance() -> None:
    scene, people = parts()
    both = read(scene, people, jnp.asarray([[np.nan, 0.0, 0.0]]))
    assert np.isnan(both.distance).all()
