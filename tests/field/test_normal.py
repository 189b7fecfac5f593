"""Normals and planarity from the Hessian of the occupancy, on spheres and planes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from samples import cloud, plane, sphere

from hrcjax.field import (
    SQUARED_EXPONENTIAL,
    FieldParams,
    distance_occupancy_hessian,
    fit,
    hessian_normal,
    log_occupancy,
    occupancy_hessian,
    rational_quadratic,
    surface_normal,
)
from hrcjax.numerics import safe_norm
from hrcjax.typing import Array, Vector3

normal_at = jax.jit(surface_normal)


def test_eigenvalues_on_a_sphere():
    """-1/l^2 + 2/R^2 along the normal, -1/R^2 across (spacing 1.8 cm, l = 3 cm, R = 10 cm)."""
    R, scale = 0.1, 0.03
    points = sphere(400, R)
    H = jax.jit(occupancy_hessian)(
        fit(cloud(points), FieldParams(scale, 0.001), solver="cholesky"), jnp.asarray(points[200])
    )
    want = np.asarray([-1 / scale**2 + 2 / R**2, -1 / R**2, -1 / R**2])
    np.testing.assert_allclose(np.linalg.eigvalsh(H), want, rtol=0.01)


def test_same_as_autodiff_of_the_occupancy():
    points = sphere(40, 0.1)
    x = jnp.asarray([0.03, -0.02, 0.11])
    for kernel in (SQUARED_EXPONENTIAL, rational_quadratic(75.0)):
        field = fit(cloud(points), FieldParams(0.04), kernel)
        want = jax.jit(jax.hessian(lambda at, f=field: jnp.exp(log_occupancy(f, at) - log_occupancy(f, x))))(x)
        np.testing.assert_allclose(jax.jit(occupancy_hessian)(field, x), want, rtol=1e-8, atol=1e-6)


def test_normal_and_planarity(dtype):
    R, scale = 0.15, 0.03
    points = sphere(500, R, (0.5, 0, 0))
    field = fit(cloud(points, dtype, missing=2), FieldParams(scale))
    for i in (200, 301):
        outward = (points[i] - [0.5, 0, 0]) / R
        for side in (1, -1):
            x = jnp.asarray(points[i], dtype)
            got = normal_at(field, x, x + side * jnp.asarray(outward, dtype))
            np.testing.assert_allclose(got.normal, side * outward, atol=0.01)
            np.testing.assert_allclose(got.planarity, 1 - 2 * (scale / R) ** 2, atol=0.01)
            assert got.ok and got.normal.dtype == got.planarity.dtype == dtype


def test_refusal(dtype):
    """R < 4.5 l is refused at 0.9, the same surface is accepted at 0.7; a field without points is refused."""
    points = sphere(300, 0.1)
    field = fit(cloud(points, dtype), FieldParams(0.03))
    x = jnp.asarray(points[150], dtype)
    assert not normal_at(field, x, 2 * x).ok
    assert normal_at(field, x, 2 * x, 0.7).ok
    small = fit(cloud(0.3 * points, dtype), FieldParams(0.03))  # l > R / sqrt(3): the normal is wrong
    assert not normal_at(small, 0.3 * x, x).ok
    empty = fit(cloud(points, dtype).__class__(field.points, field.mask & False), FieldParams(0.03))
    got = normal_at(empty, x, 2 * x)
    assert not got.ok and np.all(np.isfinite(got.normal))
    inside = normal_at(field, 0.0 * x, x)
    assert not inside.ok


@pytest.mark.slow
def test_derivative():
    """By the query on a sphere; and finite on a plane, where the tangential eigenvalues coincide."""
    points = sphere(300, 0.15)
    field = fit(cloud(points), FieldParams(0.03))
    x, eye = jnp.asarray(points[150]), jnp.asarray([0.0, 0.3, 2.0])
    read = jax.jit(lambda at: (lambda n: (n.normal, n.planarity))(surface_normal(field, at, eye)))
    slope = jax.jit(jax.jacrev(read))(x)
    for i in range(3):
        h = 1e-5 * np.eye(3)[i]
        for plus, minus, ours in zip(read(x + h), read(x - h), slope, strict=True):
            np.testing.assert_allclose(ours[..., i], (plus - minus) / 2e-5, rtol=1e-3, atol=1e-4)
    flat = fit(cloud(plane(3, 0.03)), FieldParams(0.03))
    assert np.all(np.isfinite(jax.jacfwd(lambda at: surface_normal(flat, at, eye).normal)(jnp.zeros(3))))


def test_any_field_of_distance_has_hessian_normals(dtype: jnp.dtype) -> None:
    """Of an exact ball and of a plane, at the surface and a little off it; planarity is that of exp(-d^2 / 2 l^2)."""
    radius, scale = 0.05, 0.01
    direction = jnp.asarray([0.48, -0.6, 0.64], dtype)
    centre = jnp.asarray([0.1, 0.2, 0.3], dtype)

    def ball(x: Vector3) -> Array:
        return safe_norm(x - centre) - radius

    for off in (0.0, 0.002, -0.002):
        x = centre + (radius + off) * direction
        one = hessian_normal(distance_occupancy_hessian(ball, x, scale), direction, 0.9)
        np.testing.assert_allclose(one.normal, direction, atol=2e-3 if dtype == "float32" else 1e-9)
        assert bool(one.ok) and one.normal.dtype == dtype
        assert float(hessian_normal(distance_occupancy_hessian(ball, x, scale), -direction).normal @ direction) < 0
    flat = hessian_normal(distance_occupancy_hessian(lambda x: x[2], jnp.zeros(3, dtype), scale), direction)
    np.testing.assert_allclose(flat.normal, [0, 0, 1], atol=1e-6)
    np.testing.assert_allclose(flat.planarity, 1, atol=1e-5)
