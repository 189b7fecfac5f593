"""Power and force: the table against its own energies, speeds by hand, and the reflected mass of known arms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from hrcjax.safety import (
    BODY_REGIONS,
    PflParams,
    contact_mobility,
    effective_mass,
    pfl_speed,
    pfl_speeds,
    reduced_mass,
    reduced_mass_of_mobility,
    reflected_mass,
)
from hrcjax.safety.pfl import FACE, HAND, SKULL

# Compiled once a shape, not operation by operation.
contact_mobility = jax.jit(contact_mobility)
pfl_speed = jax.jit(pfl_speed)
pfl_speeds = jax.jit(pfl_speeds)
reflected_mass = jax.jit(reflected_mass)


@pytest.mark.parametrize("region", BODY_REGIONS, ids=lambda r: r.name)
def test_energy_of_the_transient_force(region) -> None:
    """F_transient^2 / 2k agrees with the printed energy within 8 %; skull and face were printed with a factor of 2."""
    factor = 2.0 if region in (SKULL, FACE) else region.transient
    assert region.transient == (1.0 if region in (SKULL, FACE) else 2.0)
    np.testing.assert_allclose(region.energy, (factor * region.force) ** 2 / (2 * region.stiffness), rtol=0.08)


def test_sums_of_the_table() -> None:
    """Masses are not in the energies: their sum, and the order of the rows, guard them."""
    assert [r.mass for r in BODY_REGIONS] == [4.4, 4.4, 1.2, 40, 40, 40, 40, 3, 2, 0.6, 75, 75]
    assert sum(r.force for r in BODY_REGIONS) == 1785
    assert len({r.name for r in BODY_REGIONS}) == 12


def test_speed_by_hand(dtype: jnp.dtype) -> None:
    """Hand: F 280 N, k 75e3 N/m, m_H 0.6 kg; robot 16/2 + 1 = 9 kg: mu 0.5625 kg, v 1.3632 m/s."""
    m_r = effective_mass(PflParams(arm_mass=16.0, payload=1.0))
    assert m_r == 9.0
    mu = reduced_mass(jnp.asarray(HAND.mass, dtype), jnp.asarray(m_r, dtype))
    np.testing.assert_allclose(mu, 0.5625, rtol=1e-6)
    v = pfl_speed(HAND, mu)
    assert v.dtype == dtype
    np.testing.assert_allclose(v, 1.36321, rtol=1e-5)
    np.testing.assert_allclose(
        pfl_speed(SKULL, reduced_mass(4.4, 9.0)), 130 / np.sqrt(4.4 * 9 / 13.4 * 150e3), rtol=1e-6
    )


def test_speeds_of_all_regions(dtype: jnp.dtype) -> None:
    """The kinetic energy of the reduced mass at the allowed speed is the spring's energy at the force."""
    mobility = jnp.asarray(1 / 7.0, dtype)
    v = pfl_speeds(mobility)
    assert v.dtype == dtype and v.shape == (12,)
    for speed, region in zip(v, BODY_REGIONS, strict=True):
        mu = 1 / (1 / region.mass + 1 / 7.0)
        force = region.force * region.transient
        np.testing.assert_allclose(0.5 * mu * speed**2, force**2 / (2 * region.stiffness), rtol=1e-5)


def test_reflected_mass_of_a_planar_arm() -> None:
    """Two point masses on massless links at right angles: a push along the second moves both, across it the tip."""
    l1, l2, m1, m2 = 0.4, 0.3, 2.0, 1.5
    q2 = np.pi / 2
    c = np.cos(q2)
    M = np.array([[m1 * l1**2 + m2 * (l1**2 + l2**2 + 2 * l1 * l2 * c), m2 * (l2**2 + l1 * l2 * c)],
                  [m2 * (l2**2 + l1 * l2 * c), m2 * l2**2]])  # fmt: skip
    J = np.array([[0.0 - l2, -l2], [l1, 0.0], [0.0, 0.0]])  # tip, first link along x, second along y
    along, across = jnp.array([0.0, 1.0, 0.0]), jnp.array([1.0, 0.0, 0.0])
    np.testing.assert_allclose(reflected_mass(jnp.asarray(J), jnp.asarray(M), along), m1 + m2, rtol=1e-10)
    np.testing.assert_allclose(reflected_mass(jnp.asarray(J), jnp.asarray(M), across), m2, rtol=1e-10)


def test_mobility_against_numpy(dtype: jnp.dtype) -> None:
    rng = np.random.default_rng(0)
    A = rng.normal(size=(6, 6))
    M, J, u = A @ A.T + 6 * np.eye(6), rng.normal(size=(3, 6)), np.array([0.6, 0.0, -0.8])
    expected = u @ J @ np.linalg.solve(M, J.T @ u)
    mobility = contact_mobility(jnp.asarray(J, dtype), jnp.asarray(M, dtype), jnp.asarray(u, dtype))
    assert mobility.dtype == dtype
    np.testing.assert_allclose(mobility, expected, rtol=1e-5)
    np.testing.assert_allclose(reduced_mass(3.0, 1 / expected), reduced_mass_of_mobility(3.0, expected), rtol=1e-12)


def test_singular_arm_weighs_like_the_body_part() -> None:
    """An arm that can't give way has mobility 0 and finite derivatives; the reduced mass is then the body's."""
    J = jnp.zeros((3, 2)).at[1, 0].set(0.5)
    M = jnp.diag(jnp.array([2.0, 1.0]))
    u = jnp.array([1.0, 0.0, 0.0])

    def speed(J):
        return pfl_speed(HAND, reduced_mass_of_mobility(HAND.mass, contact_mobility(jnp.asarray(J), M, u)))

    assert contact_mobility(J, M, u) == 0
    assert reduced_mass(3.0, jnp.inf) == 3.0
    np.testing.assert_allclose(speed(J), 280 / np.sqrt(0.6 * 75e3), rtol=1e-12)
    assert jnp.all(jnp.isfinite(jax.jit(jax.grad(speed))(J)))
    check_grads(jax.jit(speed), (J + 0.1,), order=1)
