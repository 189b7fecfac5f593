"""Distances of segments and capsules against C MuJoCo and a constrained least-squares solver; their derivatives."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import lsq_linear

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.segment import (
    FAR,
    capsule_distance,
    capsules_distances,
    point_segment_distance,
    segment_segment_distance,
    separation,
)

_segments = jax.jit(segment_segment_distance)
_capsules = jax.jit(capsule_distance)
_point = jax.jit(point_segment_distance)
_point_gradient = jax.jit(jax.grad(point_segment_distance))
_flat = lambda x: segment_segment_distance(*x)  # noqa: E731
_derivatives = jax.jit(lambda x: (jax.grad(_flat)(jnp.stack(x)), jax.hessian(_flat)(jnp.stack(x))))
coordinates = st.floats(-1, 1).map(lambda v: round(v, 3))


def _solver(a, b, c, d):
    """Least |a + s (b - a) - c - t (d - c)| with s, t in [0, 1], by bounded least squares."""
    A = np.stack([b - a, c - d], axis=1)
    result = lsq_linear(A, c - a, bounds=(0, 1), tol=1e-14)
    return np.linalg.norm(A @ result.x - (c - a))


@settings(max_examples=30, deadline=None)
@given(arrays(float, (4, 3), elements=coordinates))
def test_segments_agree_with_bounded_least_squares(x):
    assert float(_segments(*jnp.asarray(x))) == pytest.approx(_solver(*x), abs=2e-6)
    assert float(_point(*jnp.asarray(x[:3]))) == pytest.approx(_solver(x[0], x[0], x[1], x[2]), abs=2e-6)


def _capsule_model(pairs):
    spec = mujoco.MjSpec()
    for a, b, radius in pairs:
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[*a, *b], size=[radius, 0, 0], contype=1, conaffinity=1
        )
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def test_capsule_distance_agrees_with_mujoco(dtype):
    rng = np.random.default_rng(0)
    for _ in range(30):
        ends = rng.uniform(-0.6, 0.6, (4, 3))
        radii = rng.uniform(0.02, 0.1, 2)
        model, data = _capsule_model([(ends[0], ends[1], radii[0]), (ends[2], ends[3], radii[1])])
        expected = mujoco.mj_geomDistance(model, data, 0, 1, 10.0, None)
        a, b, c, d = jnp.asarray(ends, dtype)
        mine = _capsules(a, b, float(radii[0]), c, d, float(radii[1]))
        assert mine.dtype == dtype
        if expected > 0:
            assert float(mine) == pytest.approx(expected, abs=2e-6)
        else:
            assert float(mine) <= 1e-6


@pytest.mark.parametrize(
    ("a", "b", "c", "d", "expected"),
    [
        ((0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), 1.0),  # parallel, abreast
        ((0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0), 1.0),  # in line
        ((0, 0, 0), (1, 0, 0), (3, 1, 0), (1.5, 1, 0), np.hypot(1, 0.5)),  # antiparallel, apart
        ((0, 0, 0), (1, 0, 0), (0.5, -1, 0.3), (0.5, 1, 0.3), 0.3),  # crossing
        ((0, 0, 0), (0, 0, 0), (1, -1, 0), (1, 1, 0), 1.0),  # a point
        ((0, 0, 0), (0, 0, 0), (0, 3, 4), (0, 3, 4), 5.0),  # two points
        ((0, 0, 0), (1, 0, 0), (0.2, 0, 0), (0.9, 0, 0), 0.0),  # overlapping
        ((0, 0, 0), (1, 1, 0), (0, 1, 0), (1, 0, 0), 0.0),  # crossing in a point
        ((0, 0, 0), (1, 0, 0), (0.3, 0.5, 0), (0.8, 0.5, 1e-4), 0.5),  # nearly parallel
    ],
)
def test_singular_positions(a, b, c, d, expected, dtype):
    x = [jnp.asarray(p, dtype) for p in (a, b, c, d)]
    assert float(segment_segment_distance(*x)) == pytest.approx(expected, abs=1e-6)
    for derivative in _derivatives(x):
        assert np.isfinite(derivative).all()


def test_derivatives_are_those_of_the_distance():
    rng = np.random.default_rng(1)
    value = jax.jit(_flat)
    for _ in range(3):
        x = rng.uniform(-1, 1, (4, 3))
        gradient, hessian = _derivatives(list(jnp.asarray(x)))
        for k in np.ndindex(4, 3):
            e = np.zeros((4, 3))
            e[k] = 1e-5
            low, high = jnp.asarray(x - e), jnp.asarray(x + e)
            assert float(gradient[k]) == pytest.approx(float(value(high) - value(low)) / 2e-5, abs=1e-7)
            slope = np.asarray(_derivatives(list(high))[0] - _derivatives(list(low))[0]) / 2e-5
            np.testing.assert_allclose(hessian[k], slope, atol=1e-5)
    gradient = _point_gradient(*jnp.asarray([[0.4, 0.3, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    np.testing.assert_allclose(gradient, [0, 1, 0], atol=1e-12)
    on_axis = jnp.asarray([0.5, 0.0, 0.0])
    gradient = _point_gradient(on_axis, jnp.zeros(3), jnp.asarray([1.0, 0.0, 0.0]))
    np.testing.assert_array_equal(gradient, 0)


def test_sets_of_capsules_and_absent_ones():
    rng = np.random.default_rng(2)
    first = Capsules(*(jnp.asarray(v) for v in (rng.normal(size=(3, 3)), rng.normal(size=(3, 3)), [0.1, -1.0, 0.2])))
    second = Capsules(*(jnp.asarray(v) for v in (rng.normal(size=(2, 3)), rng.normal(size=(2, 3)), [0.05, 0.3])))
    table = capsules_distances(first, second)
    for i in range(3):
        for j in range(2):
            one = capsule_distance(first.a[i], first.b[i], first.radius[i], second.a[j], second.b[j], second.radius[j])
            assert float(table[i, j]) == pytest.approx(FAR if i == 1 else float(one), abs=1e-12)
    assert float(separation(first, second)) == pytest.approx(float(np.min(table)), abs=1e-12)
    nobody = Capsules(second.a, second.b, jnp.full(2, -1.0))
    assert float(separation(first, nobody)) == FAR
    assert float(separation(nobody, first)) == FAR
