"""Rays against C MuJoCo; rays that start inside, miss, run along, and graze."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from hrcjax.geom.ray import ray_box, ray_capsule, ray_column, ray_plane, ray_sphere

CENTER = np.array([0.3, -0.2, 0.5])
HALF = np.array([0.2, 0.1, 0.3])
A, B = CENTER - 0.5 * np.array([0.2, 0.3, 0.1]), CENTER + 0.5 * np.array([0.2, 0.3, 0.1])


def _axes_to(direction):
    """A rotation whose z axis runs along `direction`."""
    z = direction / np.linalg.norm(direction)
    x = np.cross([0.0, 1.0, 0.3], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


YAW = np.array([[np.cos(0.7), -np.sin(0.7), 0], [np.sin(0.7), np.cos(0.7), 0], [0, 0, 1]])
G = mujoco.mjtGeom
CASES = {
    "sphere": (lambda o, u, k: ray_sphere(o, u, k(CENTER), 0.2), G.mjGEOM_SPHERE, np.eye(3), [0.2, 0, 0]),
    "box": (lambda o, u, k: ray_box(o, u, k(CENTER), k(HALF), 0.7), G.mjGEOM_BOX, YAW, HALF),
    "column": (lambda o, u, k: ray_column(o, u, k(CENTER), 0.12, 0.25), G.mjGEOM_CYLINDER, np.eye(3), [0.12, 0.25, 0]),
    "capsule": (
        lambda o, u, k: ray_capsule(o, u, k(A), k(B), 0.1),
        G.mjGEOM_CAPSULE,
        _axes_to(B - A),
        [0.1, np.linalg.norm(B - A) / 2, 0],
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_agrees_with_mujoco(name, dtype):
    mine, kind, R, size = CASES[name]
    rng = np.random.default_rng(0)
    origin = rng.normal(size=(400, 3))
    origin = CENTER + origin / np.linalg.norm(origin, axis=1, keepdims=True) * rng.uniform(0.8, 2.5, (400, 1))
    direction = CENTER + rng.normal(size=(400, 3)) * 0.15 - origin
    direction[::10] *= -1  # looking away
    expected = np.array(
        [
            mujoco.mju_rayGeom(CENTER, R.flatten(), np.asarray(size, float), o, u, int(kind), None)
            for o, u in zip(origin, direction, strict=True)
        ]
    )
    k = lambda v: jnp.asarray(v, dtype)  # noqa: E731
    t = np.asarray(jax.jit(jax.vmap(lambda o, u: mine(o, u, k)))(k(origin), k(direction)))
    assert t.dtype == dtype
    hits = expected >= 0
    assert 80 < hits.sum() < 360
    agree = np.isfinite(t) == hits
    assert agree.all() if dtype == jnp.float64 else agree.mean() > 0.99
    both = hits & np.isfinite(t)
    np.testing.assert_allclose(t[both], expected[both], atol=1e-9 if dtype == jnp.float64 else 2e-3)
    assert np.median(np.abs(t[both] - expected[both])) < (1e-12 if dtype == jnp.float64 else 1e-6)


def _k(v):
    return jnp.asarray(v, float)


@pytest.mark.parametrize("name", CASES)
def test_inside_is_zero_and_away_is_infinite(name):
    mine = CASES[name][0]
    assert float(mine(_k(CENTER), _k([0.3, 0.2, 0.9]), _k)) == 0
    assert float(mine(_k(CENTER + 2), _k([1.0, 1.0, 1.0]), _k)) == np.inf
    assert float(mine(_k(CENTER - 2), _k([-1.0, -1.0, -1.0]), _k)) == np.inf


@pytest.mark.parametrize(
    ("t", "expected"),
    [
        (lambda: ray_box(_k([0, 0, 5]), _k([0, 0, -1]), _k([0, 0, 0]), _k([1, 1, 1])), 4),  # along two slabs
        (lambda: ray_box(_k([2, 0, 5]), _k([0, 0, -1]), _k([0, 0, 0]), _k([1, 1, 1])), np.inf),
        (lambda: ray_box(_k([0, -5, 0]), _k([0, 2, 0]), _k([0, 0, 0]), _k([1, 2, 3])), 1.5),  # not of length 1
        (lambda: ray_column(_k([0.1, 0, 5]), _k([0, 0, -1]), _k([0, 0, 0]), 0.5, 2.0), 3),  # upright ray
        (lambda: ray_column(_k([0.6, 0, 5]), _k([0, 0, -1]), _k([0, 0, 0]), 0.5, 2.0), np.inf),
        (lambda: ray_column(_k([-3, 0, 0]), _k([1, 0, 0]), _k([0, 0, 0]), 0.5, 2.0), 2.5),  # level ray
        (lambda: ray_column(_k([-3, 0, 2.1]), _k([1, 0, 0]), _k([0, 0, 0]), 0.5, 2.0), np.inf),
        (lambda: ray_capsule(_k([0, 0, 5]), _k([0, 0, -1]), _k([0, 0, 0]), _k([0, 0, 1]), 0.5), 3.5),  # along its axis
        (lambda: ray_capsule(_k([0, 0, -5]), _k([0, 0, 2]), _k([0, 0, 0]), _k([0, 0, 1]), 0.5), 2.25),
        (lambda: ray_capsule(_k([0.6, 0, 5]), _k([0, 0, -1]), _k([0, 0, 0]), _k([0, 0, 1]), 0.5), np.inf),
        (lambda: ray_capsule(_k([0, -3, 0]), _k([0, 1, 0]), _k([0, 0, 0]), _k([0, 0, 0]), 0.5), 2.5),  # a ball
        (lambda: ray_capsule(_k([0, -3, 0]), _k([0, 1, 0]), _k([0, 0, 0]), _k([0, 0, 1]), -1.0), np.inf),  # no capsule
        (lambda: ray_capsule(_k([0, 0, 0]), _k([0, 1, 0]), _k([0, 0, 0]), _k([0, 0, 1]), -1.0), np.inf),
        (lambda: ray_plane(_k([0, 0, 2]), _k([1, 0, -1]), _k([0, 0, 1]), -0.75), 2.75),
        (lambda: ray_plane(_k([0, 0, 2]), _k([1, 0, 0]), _k([0, 0, 1]), -0.75), np.inf),
        (lambda: ray_plane(_k([0, 0, -1]), _k([1, 0, 0]), _k([0, 0, 1]), -0.75), 0),
    ],
)
def test_rays_along_axes(t, expected):
    assert float(t()) == pytest.approx(expected, abs=1e-6)


def test_derivative_of_a_hit_is_finite_and_right():
    direction = _k([0.02, 1.0, 0.05])
    for f in (
        lambda o: ray_capsule(o, direction, _k([0, 0, -0.3]), _k([0, 0, 1]), 0.5),
        lambda o: ray_sphere(o, direction, _k([0, 0, 0]), 0.5),
        lambda o: ray_box(o, direction, _k([0, 0, 0]), _k([1, 1, 1]), 0.3),
        lambda o: ray_column(o, direction, _k([0, 0, 0]), 0.5, 1.0),
    ):
        f = jax.jit(f)
        o = _k([0.05, -3.0, 0.1])
        g = jax.grad(f)(o)
        for axis in range(3):
            e = jnp.eye(3)[axis] * 1e-6
            assert float(g[axis]) == pytest.approx(float(f(o + e) - f(o - e)) / 2e-6, abs=1e-6)
        missed = jax.grad(f)(_k([5.0, -3.0, 0.1]))
        assert np.isfinite(missed).all()
