"""The approach of a surface that stands: an arm that brakes as it may stops before it."""

import jax
import jax.numpy as jnp
import numpy as np
from jax.test_util import check_grads

from hrcjax.reference import safety as serial
from hrcjax.safety import surface_limit


def test_whoever_keeps_the_limit_stops_before_the_margin() -> None:
    """Period by period, at full speed for one period, then braking."""
    a, margin, dt = 3.0, 0.02, 0.008
    for d in np.concatenate([[0.0, 0.02, 0.0201], np.linspace(0.021, 1.5, 40)]):
        v = float(surface_limit(jnp.asarray(d), a, margin, dt))
        left = d - margin - v * dt - v * v / (2 * a)
        assert left > -1e-12 or v == 0
        assert abs(left) < 1e-12 or d <= margin  # and no slower than needed
        np.testing.assert_allclose(serial.surface_limit(np.array(d), a, margin, dt), v)


def test_without_a_reaction_it_is_the_root() -> None:
    got = surface_limit(jnp.asarray([0.1, 0.5]), 2.0, 0.02, 0.0)
    np.testing.assert_allclose(got, np.sqrt(2 * 2.0 * np.array([0.08, 0.48])))


def test_slope_is_finite_at_the_margin_and_in_contact_and_a_floor_holds(dtype) -> None:
    slope = jax.jit(jax.vmap(jax.grad(lambda d: surface_limit(d, 3.0, 0.02))))
    d = jnp.asarray([-0.1, 0.0, 0.02, 0.02 + 1e-6, 0.1, 5.0], dtype)
    found = slope(d)
    assert bool(jnp.isfinite(found).all()) and float(jnp.abs(found).max()) <= 1 / 0.008 * (1 + 1e-3)
    np.testing.assert_array_equal(found[:2], 0.0)
    assert surface_limit(d, 3.0, 0.02).dtype == dtype
    np.testing.assert_allclose(surface_limit(d, 3.0, 0.02, floor=0.01)[:3], 0.01, rtol=1e-6)
    assert bool(jnp.isnan(surface_limit(jnp.asarray(jnp.nan, dtype), 3.0, 0.02)))
    if dtype == jnp.float64:
        at = tuple(map(jnp.asarray, (0.2, 3.0, 0.02, 0.008)))
        check_grads(jax.jit(lambda d, a, m, T: surface_limit(d, a, m, T)), at, 1)
