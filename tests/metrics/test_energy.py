"""Work of the joints."""

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.metrics import energy, power

# Compiled once a shape, not operation by operation.
energy = jax.jit(energy)
power = jax.jit(power)


def test_energy_of_a_sine(dtype: jnp.dtype) -> None:
    """Torque 3 sin t at speed 2 cos t: the integral of |6 sin t cos t| over a turn is 12; braking does not pay back."""
    t = np.arange(2000) * (2 * np.pi / 2000)
    tau = jnp.asarray(np.stack([3 * np.sin(t), 0 * t], axis=-1), dtype)
    qd = jnp.asarray(np.stack([2 * np.cos(t), 5 + 0 * t], axis=-1), dtype)
    dt = jnp.asarray(2 * np.pi / 2000, dtype)
    assert energy(tau, qd, dt).dtype == dtype
    np.testing.assert_allclose(energy(tau, qd, dt), 12, rtol=1e-4)
    np.testing.assert_allclose(energy(tau, qd, dt, jnp.asarray(t < np.pi)), 6, rtol=1e-3)
    np.testing.assert_allclose(power(tau, qd), np.abs(6 * np.sin(t) * np.cos(t)), atol=1e-5)


def test_joints_add_up_without_sign() -> None:
    tau, qd = jnp.array([[1.0, -2.0]]), jnp.array([[3.0, 4.0]])
    assert power(tau, qd)[0] == 11
    assert jnp.all(jnp.isfinite(jax.grad(lambda tau: energy(tau, qd, 0.1))(jnp.zeros((1, 2)))))
