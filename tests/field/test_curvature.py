"""The correction for curvature on densely sampled balls, tubes and planes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads
from samples import cylinder, plane, sphere

from hrcjax.field import FieldParams, fit
from hrcjax.field.curvature import MOST, corrected_square, curvature_correction, tangential_share
from hrcjax.field.gp import log_occupancy

SCALE = 0.02


def correction(spread, offset, scale):
    return curvature_correction(tangential_share(spread, offset, scale), offset, scale)


@jax.jit
def both(points, x):
    """The field's distance, and the corrected one, by the definition of the spread."""
    field = fit(cloud_of(points), FieldParams(SCALE, 1e-3))
    k = field.weights * jnp.exp(-jnp.sum((x - field.points) ** 2, axis=1) / (2 * SCALE**2))
    share = k / jnp.sum(k)
    mean = share @ field.points
    spread = (field.points - mean).T @ (share[:, None] * (field.points - mean))
    v = -2 * log_occupancy(field, x)
    v_corrected = v + correction(spread, x - mean, jnp.asarray(SCALE))
    return SCALE * jnp.sqrt(v), SCALE * jnp.sqrt(v_corrected)


def cloud_of(points):
    from hrcjax.geom.cloud import Cloud

    return Cloud(points, jnp.ones(points.shape[0], bool))


@pytest.mark.parametrize("d", [0.02, 0.05, 0.1])
def test_balls_and_tubes(d: float) -> None:
    for points, radius in ((sphere(3000, 0.08), 0.08), (cylinder(0.06, 0.008, 0.3), 0.06)):
        plain, corrected = both(jnp.asarray(points), jnp.asarray([radius + d, 0.0, 0.0]))
        assert plain - d > 8e-4
        np.testing.assert_allclose(corrected, d, atol=1e-3 if d <= SCALE else 4e-4)


def test_planes_stay() -> None:
    plain, corrected = both(jnp.asarray(plane(20, 0.012)), jnp.asarray([0.003, 0.002, 0.05]))
    np.testing.assert_allclose(corrected, plain, atol=2e-4)


def test_concave_surfaces_stay_on_the_safe_side() -> None:
    """In the middle of a hollow ball's half the spread is large: nothing is added."""
    spread = 4 * SCALE**2 * jnp.eye(3)
    assert abs(float(correction(spread, jnp.asarray([0.0, 0.0, 0.05]), jnp.asarray(SCALE)))) < 0.01


def test_derivatives_are_finite_where_the_normal_is_not_known() -> None:
    spread = SCALE**2 * jnp.diag(jnp.asarray([1.0, 0.6, 0.0]))
    slope = jax.grad(correction, argnums=(0, 1))(spread, jnp.zeros(3), jnp.asarray(SCALE))
    assert all(np.isfinite(g).all() for g in slope)
    check_grads(
        lambda c: correction(spread, jnp.asarray(c), jnp.asarray(SCALE)),
        (jnp.asarray([0.01, 0.02, 0.03]),),
        1,
        rtol=1e-3,
    )
    shape = jnp.diag(jnp.asarray([1.0, 0.6, 0.1]))
    offset = jnp.asarray([0.0, 0.01, 0.03])
    check_grads(lambda s: correction(SCALE**2 * jnp.asarray(s), offset, jnp.asarray(SCALE)), (shape,), 1)


def test_of_a_distance_something_is_always_left() -> None:
    """Whatever the sample looks like: 40 % of the square; and a small correction is left as it is."""
    square = jnp.geomspace(1e-3, 1e3, 60)
    left = jax.vmap(corrected_square)(square, jnp.full(60, -3.9))
    assert (left > (1 - MOST) * square - 0.02).all() and (left > 0)[square > 0.05].all()
    np.testing.assert_allclose(left[square > 30], (square - 3.9)[square > 30], rtol=1e-2)
    assert (jnp.diff(left) > 0).all()
    slope = jax.vmap(jax.grad(corrected_square, argnums=(0, 1)))(jnp.linspace(-3.0, 3.0, 61), jnp.full(61, -2.0))
    assert all(np.isfinite(g).all() for g in slope)
    np.testing.assert_array_equal(corrected_square(jnp.asarray(2.0), jnp.asarray(0.0)), 2.0)
