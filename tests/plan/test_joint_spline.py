import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.plan.joint_spline import control_places, fit_matrix, joint_spline, spline_matrix


def _bernstein(u):
    """Of the only segment of four control points, in closed form."""
    return np.stack([(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u * u * (1 - u), u**3], axis=-1)


def test_four_control_points_are_a_bezier_curve(dtype):
    u = np.linspace(0, 1, 9)
    np.testing.assert_allclose(spline_matrix(4, u), _bernstein(u), atol=1e-14)
    C = jnp.asarray(np.random.default_rng(0).normal(size=(4, 5)), dtype)
    at = jax.vmap(joint_spline(C))(jnp.asarray(u, dtype))
    assert at.dtype == dtype
    np.testing.assert_allclose(at, _bernstein(u) @ np.asarray(C), atol=1e-5 if dtype == jnp.float32 else 1e-13)


@pytest.mark.parametrize("control", [5, 10, 14])
def test_polynomials_are_the_matrix_and_smooth(control):
    rng = np.random.default_rng(1)
    C, u = rng.normal(size=(control, 2)), rng.uniform(0, 1, 50)
    spline = joint_spline(jnp.asarray(C))
    np.testing.assert_allclose(jax.vmap(spline)(jnp.asarray(u)), spline_matrix(control, u) @ C, atol=1e-12)
    np.testing.assert_array_equal(spline(jnp.asarray(-1.0)), C[0])
    np.testing.assert_allclose(spline(jnp.asarray(2.0)), C[-1], atol=1e-12)
    knots = np.arange(1, control - 3) / (control - 3)
    bend = jax.vmap(jax.jacfwd(jax.jacfwd(spline)))
    np.testing.assert_allclose(bend(jnp.asarray(knots - 1e-9)), bend(jnp.asarray(knots + 1e-9)), atol=1e-4)


def test_a_straight_line_is_straight_at_constant_speed_and_fits_are_exact():
    u = np.linspace(0, 1, 30)
    for control in (5, 12):
        places = control_places(control)
        np.testing.assert_allclose(spline_matrix(control, u) @ places, u, atol=1e-13)
        C = np.random.default_rng(2).normal(size=(control, 3))
        np.testing.assert_allclose(fit_matrix(control, u) @ (spline_matrix(control, u) @ C), C[1:-1], atol=1e-9)


def test_too_few_control_points_are_refused():
    with pytest.raises(ValueError, match="accepted are 4"):
        joint_spline(jnp.zeros((3, 2)))
