"""Fits against scipy, distances against analytic surfaces, and finiteness in both precisions."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
import scipy.spatial.distance
import scipy.spatial.transform
from hypothesis import given, settings
from hypothesis import strategies as st
from samples import cloud, plane, sphere

from hrcjax.field import (
    FAR,
    MATERN12,
    MATERN32,
    SQUARED_EXPONENTIAL,
    FieldParams,
    GPField,
    rational_quadratic,
)
from hrcjax.field import distance as eager_distance
from hrcjax.field import distance_and_gradient as eager_distance_and_gradient
from hrcjax.field import fit as eager_fit
from hrcjax.field import fit_exact as eager_fit_exact
from hrcjax.field import gradient as eager_gradient
from hrcjax.field import hessian as eager_hessian
from hrcjax.field import log_occupancy as eager_log_occupancy
from hrcjax.geom.cloud import Cloud, drop_not_finite

distance, gradient, hessian = jax.jit(eager_distance), jax.jit(eager_gradient), jax.jit(eager_hessian)
distance_and_gradient, log_occupancy = jax.jit(eager_distance_and_gradient), jax.jit(eager_log_occupancy)
fit = jax.jit(eager_fit, static_argnames=("kernel", "solver"))
fit_exact = jax.jit(eager_fit_exact, static_argnames="kernel")
KERNELS = [SQUARED_EXPONENTIAL, rational_quadratic(75.0), MATERN12, MATERN32]
kernels = pytest.mark.parametrize("kernel", KERNELS, ids=lambda k: k.name)
PARAMS = FieldParams(length_scale=0.03, noise=0.02)


def textbook(name: str, r: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Covariance and its derivative by the distance."""
    if name.startswith("squared"):
        k = np.exp(-(r**2) / (2 * scale**2))
        return k, -r / scale**2 * k
    if name.startswith("rational"):
        base = 1 + r**2 / (150 * scale**2)
        return base**-75.0, -75 * base**-76.0 * r / (75 * scale**2)
    if name.endswith("1/2"):
        k = np.exp(-r / scale)
        return k, -k / scale
    t = np.sqrt(3) * r / scale
    return (1 + t) * np.exp(-t), -3 * r / scale**2 * np.exp(-t)


def inverse_by_bisection(name: str, o: float, scale: float) -> float:
    low, high = 0.0, 100.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if textbook(name, middle, scale)[0] > o else (low, middle)
    return low


@kernels
def test_exact_weights_solve_the_system(kernel, dtype):
    points = sphere(60, 0.1, (0.4, 0.1, 0.2))
    field, ok = fit_exact(cloud(points, dtype, missing=3), PARAMS, kernel)
    K = textbook(kernel.name, scipy.spatial.distance.cdist(points, points), 0.03)[0] + 0.02**2 * np.eye(60)
    alpha = scipy.linalg.solve(K, np.ones(60), assume_a="pos")
    assert ok and field.weights.dtype == dtype
    scale = np.abs(alpha).max() * (1e-3 if dtype == "float32" else 1e-10)
    np.testing.assert_allclose(field.weights[3:-3], alpha, atol=scale)
    assert np.all(np.asarray(field.weights)[np.r_[:3, -3:0]] == 0)


@kernels
def test_value_and_gradient_of_textbook_sums(kernel):
    """Occupancy, distance and gradient from plain sums of plain kernels."""
    points = sphere(60, 0.1, (0.4, 0.1, 0.2))
    for field in (
        fit(cloud(points, missing=2), PARAMS, kernel),
        fit_exact(cloud(points, missing=2), PARAMS, kernel)[0],
    ):
        weights = np.asarray(field.weights)[2:-2]
        for x in ([0.52, 0.12, 0.2], [0.4, 0.1, 0.36], [0.43, 0.11, 0.21], [0.1, 0.1, 0.1]):
            r = np.linalg.norm(np.asarray(x) - points, axis=1)
            k, slope = textbook(kernel.name, r, 0.03)
            o, grad_o = weights @ k, (weights * slope / r) @ (np.asarray(x) - points)
            at = jnp.asarray(x)
            np.testing.assert_allclose(log_occupancy(field, at), np.log(o), rtol=1e-9, atol=1e-9)
            d = inverse_by_bisection(kernel.name, o, 0.03)
            np.testing.assert_allclose(distance(field, at), d, rtol=1e-7)
            want = grad_o / textbook(kernel.name, d, 0.03)[1]
            np.testing.assert_allclose(gradient(field, at), want, rtol=1e-5, atol=1e-7)


@kernels
def test_lumped_weights(kernel, dtype):
    points = sphere(60, 0.1)
    field = fit(cloud(points, dtype, missing=3), PARAMS, kernel)
    K = textbook(kernel.name, scipy.spatial.distance.cdist(points, points), 0.03)[0]
    np.testing.assert_allclose(field.weights[3:-3], 1 / (0.02**2 + K.sum(axis=1)), rtol=1e-5)
    assert np.all(np.asarray(field.weights)[np.r_[:3, -3:0]] == 0) and not field.signed
    assert field.weights.dtype == field.length_scale.dtype == dtype


def test_default_params():
    assert FieldParams() == FieldParams(length_scale=0.035, noise=0.01)


def test_distance_of_a_plane(dtype):
    field = fit(cloud(plane(10, 0.02), dtype), FieldParams(length_scale=0.02))
    for h in (0.005, 0.02, 0.05, 0.1):
        at = jnp.asarray([0.003, 0.004, -h], dtype)
        np.testing.assert_allclose(distance(field, at), h, atol=5e-4)
        np.testing.assert_allclose(gradient(field, at), [0, 0, -1], atol=0.02)
    at = jnp.asarray([0.0, 0.0, 0.05], dtype)
    np.testing.assert_allclose(hessian(field, at), np.zeros((3, 3)), atol=0.2)


@pytest.mark.parametrize("spacing_ratio", [0.6, 0.8, 1.0])
def test_lumped_is_near_exact(spacing_ratio):
    points = sphere(300, 0.15)
    spacing = np.sqrt(4 * np.pi * 0.15**2 / 300)
    params = FieldParams(length_scale=spacing_ratio * spacing)
    lumped, exact = fit(cloud(points), params), fit(cloud(points), params, solver="cholesky")
    for x in sphere(12, 0.2, (0.001, 0.0, 0.0)):
        np.testing.assert_allclose(distance(lumped, jnp.asarray(x)), distance(exact, jnp.asarray(x)), atol=2e-3)


everything = jax.jit(
    jax.vmap(
        lambda field, x: (
            eager_distance(field, x),
            eager_gradient(field, x),
            eager_hessian(field, x),
            *eager_distance_and_gradient(field, x),
        ),
        in_axes=(None, 0),
    )
)


@pytest.mark.parametrize(
    ("kernel", "solver"),
    [*((k, "lumped") for k in KERNELS), (SQUARED_EXPONENTIAL, "cholesky")],
    ids=lambda v: getattr(v, "name", v),
)
def test_finite_everywhere(kernel, solver, dtype):
    """On the data, between points, 3 m away; there the gradient points away from the surface."""
    points = sphere(200, 0.1, (0.4, 0.1, 0.2))
    field = fit(cloud(points, dtype, missing=2), FieldParams(), kernel, solver)
    away = np.asarray([1.0, -2.0, 2.0]) / 3
    centre = np.asarray([0.4, 0.1, 0.2])
    x = [points[0], points[7], (points[0] + points[1]) / 2, centre, centre + 0.1 * away, centre + 3.1 * away]
    out = everything(field, jnp.asarray(np.asarray(x), dtype))
    assert all(np.all(np.isfinite(part)) for part in out)
    assert all(part.dtype == dtype for part in out)
    assert np.all(out[0] >= 0)
    for g in (out[1][-1], out[4][-1]):
        np.testing.assert_allclose(g / np.linalg.norm(g), away, atol=1e-3)
    if kernel is SQUARED_EXPONENTIAL:
        np.testing.assert_allclose(out[0][-1], 3.0, atol=3e-3)
    # the same program, and without points
    d, g, H, d_closed, g_closed = everything(
        eqx.tree_at(lambda f: (f.mask, f.weights), field, (field.mask & False, field.weights * 0)),
        jnp.asarray(np.asarray(x), dtype),
    )
    assert FAR == 10.0 and np.all(d == FAR) and np.all(d_closed == FAR)
    assert np.all(g == 0) and np.all(g_closed == 0) and np.all(H == 0)


@pytest.mark.parametrize("solver", ["lumped", "cholesky"])
def test_fit_of_no_points(solver, dtype):
    field = fit(Cloud(jnp.asarray(sphere(5, 0.1), dtype), jnp.zeros(5, bool)), PARAMS, solver=solver)
    assert np.all(field.weights == 0)


def test_gradient_shrinks_at_the_surface():
    """Below the bend the gradient goes to 0 instead of growing: its length is bounded on a line through the plane."""
    field = fit(cloud(plane(8, 0.02)), FieldParams(length_scale=0.02), solver="cholesky")
    z = np.linspace(-0.01, 0.01, 101)
    g = np.asarray(jax.vmap(lambda h: gradient(field, jnp.stack([0.003 + 0 * h, 0.004 + 0 * h, h])))(jnp.asarray(z)))
    assert np.linalg.norm(g, axis=1).max() < 1.5
    assert np.linalg.norm(g[50]) < 0.02
    assert np.all(g[z > 1e-3, 2] > 0.3) and np.all(g[z < -1e-3, 2] < -0.3)


def test_points_that_coincide(dtype):
    points = np.repeat(sphere(20, 0.1), 2, axis=0)
    single = fit(cloud(points[::2], dtype), FieldParams(noise=0.0))
    double = fit(cloud(points, dtype), FieldParams(noise=0.0))
    x = jnp.asarray([0.15, 0.02, 0.0], dtype)
    np.testing.assert_allclose(distance(double, x), distance(single, x), rtol=1e-5)
    _, ok = fit_exact(cloud(points, dtype), FieldParams(noise=0.1))
    assert ok


def test_exact_fit_reports_failure(dtype):
    """A singular system: no NaN, the lumped field and a False; nor NaN in the derivative."""
    points = np.repeat(sphere(20, 0.1), 2, axis=0)
    field, ok = fit_exact(cloud(points, dtype), FieldParams(length_scale=5.0, noise=0.0))
    assert not ok
    lumped = fit(cloud(points, dtype), FieldParams(length_scale=5.0, noise=0.0))
    np.testing.assert_array_equal(field.weights, lumped.weights)

    def read(length_scale):
        one = fit_exact(cloud(points, dtype), FieldParams(length_scale=length_scale, noise=0.0))[0]
        return distance(one, jnp.asarray([0.2, 0.1, 0.0], dtype))

    assert np.isfinite(jax.jit(jax.grad(read))(jnp.asarray(5.0, dtype)))


def test_cancelled_sum_fails_closed():
    """Negative weights that leave no occupancy: the sum of absolute terms, not a far distance."""
    points = jnp.asarray([[0.0, 0, 0], [0.01, 0, 0]])
    x = jnp.asarray([0.0, 0.05, 0.0])
    field = GPField(points, jnp.asarray([1.0, -2.0]), jnp.ones(2, bool), jnp.asarray(0.03))
    k = np.exp(-np.asarray([0.05**2, 0.05**2 + 0.01**2]) / (2 * 0.03**2))
    np.testing.assert_allclose(log_occupancy(field, x), np.log(k @ [1.0, 2.0]), rtol=1e-12)
    d, g = distance(field, x), gradient(field, x)
    assert d < 0.05 and g[1] > 0.5
    np.testing.assert_allclose(distance_and_gradient(field, x)[1], g, rtol=1e-10)
    kept = GPField(points, jnp.asarray([1.0, -0.5]), jnp.ones(2, bool), jnp.asarray(0.03))
    np.testing.assert_allclose(log_occupancy(kept, x), np.log(k @ [1.0, -0.5]), rtol=1e-12)


@pytest.mark.parametrize(("second", "trusted"), [(-0.99, True), (-0.999, False), (-1.0005, False)])
def test_trust_in_a_signed_sum(second, trusted):
    """Two points in one place, so that the sum is 1 + second and the absolute one 1 - second times the kernel."""
    weights = jnp.asarray([1.0, second])
    field = GPField(jnp.zeros((2, 3)), weights, jnp.ones(2, bool), jnp.asarray(0.03))
    x = jnp.asarray([0.0, 0.06, 0.0])
    want = np.log(1 + second if trusted else 1 - second) - 2.0
    np.testing.assert_allclose(log_occupancy(field, x), want, rtol=1e-9)
    np.testing.assert_allclose(distance_and_gradient(field, x)[0], distance(field, x), rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["lumped", "cholesky"])
@pytest.mark.parametrize("read", [distance, lambda f, x: distance_and_gradient(f, x)[0]], ids=["definition", "closed"])
def test_derivative_by_params(solver, read):
    """Through the fit as well as the query, against central differences."""
    points = cloud(sphere(40, 0.1), missing=2)

    def f(length_scale, noise):
        return read(fit(points, FieldParams(length_scale, noise), solver=solver), jnp.asarray([0.03, 0.15, 0.02]))

    at, h = (jnp.asarray(0.03), jnp.asarray(0.05)), 1e-6
    steps = jnp.asarray([(h, 0.0), (0.0, h)])
    difference = jax.jit(jax.vmap(lambda s: (f(at[0] + s[0], at[1] + s[1]) - f(at[0] - s[0], at[1] - s[1])) / (2 * h)))(
        steps
    )
    assert np.all(np.abs(difference) > 1e-4)
    for derivative in (jax.grad, jax.jacfwd):
        np.testing.assert_allclose(jax.jit(derivative(f, argnums=(0, 1)))(*at), difference, rtol=1e-4)


@given(
    turn=st.tuples(*4 * [st.floats(-1, 1)]).filter(lambda q: sum(c * c for c in q) > 0.1),
    shift=st.tuples(*3 * [st.floats(-2, 2)]),
)
@settings(deadline=None, max_examples=20)
def test_rigid_motion(turn, shift):
    """Moved with its points, a query reads the same distance and a turned gradient."""
    R = scipy.spatial.transform.Rotation.from_quat(turn).as_matrix()
    points, x = sphere(30, 0.1, (0.2, 0, 0)) * [1, 0.6, 0.3], np.asarray([0.25, 0.07, 0.05])
    d0, g0 = READ(jnp.asarray(points), jnp.asarray(x))
    d1, g1 = READ(jnp.asarray(points @ R.T + shift), jnp.asarray(R @ x + shift))
    np.testing.assert_allclose(d1, d0, rtol=1e-8)
    np.testing.assert_allclose(g1, R @ g0, atol=1e-7)


@jax.jit
def READ(points, x):
    return distance_and_gradient(fit(Cloud(points, jnp.ones(30, bool)), PARAMS), x)


def test_batches_and_errors():
    """vmap = loop for fit and query; wrong settings are named."""
    clouds = [cloud(sphere(20, 0.05 + 0.05 * i), missing=1) for i in range(2)]
    stacked = jax.tree.map(lambda *a: jnp.stack(a), *clouds)
    fields = jax.vmap(lambda c: fit(c, PARAMS))(stacked)
    x = jnp.asarray(sphere(4, 0.2))
    many = jax.jit(jax.vmap(lambda f: jax.vmap(lambda at: distance_and_gradient(f, at)[0])(x)))(fields)
    for i, one in enumerate(clouds):
        for j in range(4):
            np.testing.assert_allclose(many[i, j], distance(fit(one, PARAMS), x[j]), rtol=1e-10)
    with pytest.raises(ValueError, match="'qr'; accepted: 'lumped', 'cholesky'"):
        eager_fit.__wrapped__(clouds[0], PARAMS, solver="qr")
    with pytest.raises(ValueError, match="accepted: one cloud"):
        eager_fit(stacked, PARAMS)
    with pytest.raises(ValueError, match="accepted: one cloud"):
        eager_fit_exact(stacked, PARAMS)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_point_that_is_not_finite_is_never_free_space(bad) -> None:
    """Refused by name where it is known; where the cloud is traced every distance is NaN, which stops the arm."""
    good = cloud(sphere(60, 0.1))
    spoilt = Cloud(good.points.at[3, 1].set(bad), good.mask)
    for fitted in (eager_fit, lambda *a: eager_fit_exact(*a)[0]):
        with pytest.raises(ValueError, match="1 of 60 points under the mask are not finite"):
            fitted(spoilt, PARAMS)
    x = jnp.asarray([0.3, 0.0, 0.0], good.points.dtype)
    for field in (fit(spoilt, PARAMS), fit_exact(spoilt, PARAMS)[0]):
        assert np.isnan(distance(field, x)) and np.isnan(distance_and_gradient(field, x)[0])
    hidden = Cloud(spoilt.points, good.mask.at[3].set(False))
    assert np.isfinite(eager_distance(eager_fit(drop_not_finite(spoilt)[0], PARAMS), x))
    kept, dropped = drop_not_finite(spoilt)
    assert int(dropped) == 1 and int(jnp.sum(kept.mask)) == 59 and bool(jnp.all(jnp.isfinite(kept.points)))
    assert int(drop_not_finite(hidden)[1]) == 0
