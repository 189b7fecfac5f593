"""Exact signed distances against sampled surfaces, C MuJoCo and closed forms; gradients of length 1."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from hrcjax.geom.shape import (
    box_distance,
    capsule_point_distance,
    column_distance,
    plane_distance,
    segment_convex_distance,
    sphere_distance,
)

CENTER = jnp.asarray([0.3, -0.2, 0.5])
HALF = jnp.asarray([0.2, 0.1, 0.3])


def _box_surface(n=80):
    u = np.linspace(-1, 1, n)
    grid = np.stack(np.meshgrid(u, u, indexing="ij"), -1).reshape(-1, 2)
    faces = []
    for axis in range(3):
        for sign in (-1, 1):
            faces.append(np.insert(grid, axis, sign, axis=1))
    return np.concatenate(faces) * np.asarray(HALF)


def _column_surface(radius, half, n=240):
    angle = np.linspace(0, 2 * np.pi, n)
    ring = np.stack([np.cos(angle), np.sin(angle)], -1)
    mantle = [np.column_stack([radius * ring, np.full(n, z)]) for z in np.linspace(-half, half, 80)]
    caps = [np.column_stack([r * ring, np.full(n, s * half)]) for r in np.linspace(0, radius, 40) for s in (-1, 1)]
    return np.concatenate(mantle + caps)


SHAPES = {
    "sphere": (lambda x: sphere_distance(x, CENTER, 0.2), None),
    "box": (lambda x: box_distance(x, CENTER, HALF, 0.7), "box"),
    "column": (lambda x: column_distance(x, CENTER, 0.12, 0.25), "column"),
    "capsule": (lambda x: capsule_point_distance(x, CENTER, CENTER + HALF, 0.1), None),
    "plane": (lambda x: plane_distance(x, jnp.asarray([0.0, 0.6, 0.8]), 0.3), None),
}


def _surface(name):
    if name == "box":
        c, s = np.cos(0.7), np.sin(0.7)
        return _box_surface() @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + np.asarray(CENTER)
    return _column_surface(0.12, 0.25) + np.asarray(CENTER)


@pytest.mark.parametrize("name", ["box", "column"])
def test_distance_is_that_to_the_sampled_surface(name):
    surface = _surface(name)
    distance = jax.jit(jax.vmap(SHAPES[name][0]))
    x = np.random.default_rng(0).uniform(-0.4, 0.4, (150, 3)) + np.asarray(CENTER)
    mine = np.asarray(distance(jnp.asarray(x)))
    nearest = np.min(np.linalg.norm(x[:, None] - surface[None], axis=-1), axis=1)
    np.testing.assert_allclose(np.abs(mine), nearest, atol=6e-3)
    local = x - np.asarray(CENTER)
    if name == "box":
        c, s = np.cos(0.7), np.sin(0.7)
        local = local @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        inside = np.all(np.abs(local) < np.asarray(HALF), axis=1)
    else:
        inside = (np.hypot(local[:, 0], local[:, 1]) < 0.12) & (np.abs(local[:, 2]) < 0.25)
    assert inside.any()
    np.testing.assert_array_equal(mine < 0, inside)


def test_sphere_plane_and_capsule_by_hand():
    assert float(sphere_distance(jnp.asarray([3.0, 4.0, 0.0]), jnp.zeros(3), 2.0)) == pytest.approx(3)
    assert float(plane_distance(jnp.asarray([1.0, 2.0, 3.0]), jnp.asarray([0.0, 0.0, 1.0]), 0.5)) == pytest.approx(2.5)
    b = jnp.asarray([1.0, 0.0, 0.0])
    assert float(capsule_point_distance(jnp.asarray([0.5, 2.0, 0.0]), jnp.zeros(3), b, 0.3)) == pytest.approx(1.7)
    assert float(capsule_point_distance(jnp.asarray([4.0, 4.0, 0.0]), jnp.zeros(3), b, 0.3)) == pytest.approx(4.7)
    assert float(box_distance(CENTER + 2 * HALF, CENTER, HALF)) == pytest.approx(np.linalg.norm(HALF))
    assert float(box_distance(CENTER, CENTER, HALF)) == pytest.approx(-0.1)
    assert float(column_distance(CENTER, CENTER, 0.3, 0.2)) == pytest.approx(-0.2)


@pytest.mark.parametrize("name", SHAPES)
def test_gradient_has_length_one_and_is_that_of_the_distance(name):
    distance = SHAPES[name][0]
    x = np.random.default_rng(1).uniform(-0.7, 0.7, (200, 3)) + np.asarray(CENTER)
    gradients = jax.jit(jax.vmap(jax.grad(distance)))(jnp.asarray(x))
    np.testing.assert_allclose(np.linalg.norm(gradients, axis=-1), 1, atol=1e-9)
    step = 1e-6
    each = jax.jit(jax.vmap(distance))
    for axis in range(3):
        e = np.eye(3)[axis] * step
        slope = (np.asarray(each(jnp.asarray(x + e))) - np.asarray(each(jnp.asarray(x - e)))) / (2 * step)
        assert np.mean(np.abs(slope - gradients[:, axis]) < 1e-6) > 0.97  # all but points astride a ridge


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("offset", [(0, 0, 0), (0.2, 0, 0), (0, 0, 0.25), (0, 0.1, 0.3), (0.12, 0, 0.25)])
def test_finite_at_centres_faces_and_edges(name, offset, dtype):
    x = jnp.asarray(CENTER + jnp.asarray(offset, float), dtype)
    distance = {
        "sphere": lambda x: sphere_distance(x, CENTER.astype(dtype), 0.2),
        "box": lambda x: box_distance(x, CENTER.astype(dtype), HALF.astype(dtype), 0.0),
        "column": lambda x: column_distance(x, CENTER.astype(dtype), 0.12, 0.25),
        "capsule": lambda x: capsule_point_distance(x, CENTER.astype(dtype), CENTER.astype(dtype), 0.1),
        "plane": lambda x: plane_distance(x, jnp.asarray([0, 0, 1], dtype), 0.75),
    }[name]
    value, gradient, hessian = jax.jit(lambda x: (distance(x), jax.grad(distance)(x), jax.hessian(distance)(x)))(x)
    assert value.dtype == dtype
    assert np.isfinite(value) and np.isfinite(gradient).all() and np.isfinite(hessian).all()


@pytest.mark.parametrize("place", ["face", "mantle"])
def test_full_gradient_on_the_surface(place):
    if place == "face":
        g = jax.grad(lambda x: box_distance(x, jnp.zeros(3), jnp.ones(3)))(jnp.asarray([1.0, 0.2, 0.1]))
    else:
        g = jax.grad(lambda x: column_distance(x, jnp.zeros(3), 1.0, 2.0))(jnp.asarray([1.0, 0.0, 0.1]))
    np.testing.assert_allclose(g, [1, 0, 0], atol=1e-12)


@pytest.mark.parametrize("name", ["sphere", "box", "column"])
def test_segment_to_convex_is_the_least_on_the_axis(name, dtype):
    center, half = CENTER.astype(dtype), HALF.astype(dtype)
    distance = {
        "sphere": lambda x: sphere_distance(x, center, 0.2),
        "box": lambda x: box_distance(x, center, half, 0.7),
        "column": lambda x: column_distance(x, center, 0.12, 0.25),
    }[name]
    rng = np.random.default_rng(3)
    mine = jax.jit(lambda a, b: segment_convex_distance(a, b, distance))
    bulk = jax.jit(lambda a, b: jax.vmap(lambda s: distance(a + s * (b - a)))(jnp.linspace(0, 1, 2001, dtype=dtype)))
    for _ in range(12):
        a, b = jnp.asarray(rng.uniform(-0.8, 0.8, (2, 3)) + np.asarray(CENTER), dtype)
        assert mine(a, b).dtype == dtype
        length = float(np.linalg.norm(b - a))
        least = float(np.min(bulk(a, b)))
        assert least - length / 2000 - 1e-6 <= float(mine(a, b)) <= least + 2e-5


def test_segment_to_convex_ends_count_and_derivative_is_the_envelope():
    distance = lambda x: box_distance(x, CENTER, HALF, 0.7)  # noqa: E731
    a, b = CENTER + jnp.asarray([0.5, 0.4, 0.1]), CENTER + jnp.asarray([0.9, 0.6, 0.3])
    assert float(segment_convex_distance(a, b, distance)) == pytest.approx(float(distance(a)), abs=1e-12)
    assert float(segment_convex_distance(b, a, distance)) == pytest.approx(float(distance(a)), abs=1e-12)
    a, b = CENTER + jnp.asarray([0.5, -0.4, 0.1]), CENTER + jnp.asarray([0.1, 0.6, 0.5])
    f = jax.jit(lambda a, b: segment_convex_distance(a, b, distance, steps=45))
    distance = jax.jit(distance)

    def oracle(a, b):
        result = minimize_scalar(
            lambda s: float(distance(a + s * (b - a))), bounds=(0, 1), method="bounded", options={"xatol": 1e-10}
        )
        return result.fun

    assert float(f(a, b)) == pytest.approx(oracle(a, b), abs=1e-9)
    gradient = jax.grad(f, argnums=(0, 1))(a, b)
    for axis in range(3):
        e = jnp.eye(3)[axis] * 1e-4
        slope = (oracle(a + e, b) - oracle(a - e, b)) / 2e-4
        assert float(gradient[0][axis]) == pytest.approx(slope, abs=2e-4)
        slope = (oracle(a, b + e) - oracle(a, b - e)) / 2e-4
        assert float(gradient[1][axis]) == pytest.approx(slope, abs=2e-4)
