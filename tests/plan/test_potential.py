import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads
from plan_scenes import GOAL, PRINTED, scene

from hrcjax.plan import PotentialParams, force, potential
from hrcjax.plan.potential import attractive_potential, d_factor, inverse_distance, limited, repulsive_potentials

NONE = scene(centers=np.full((1, 3), 9.0))


def closed_force(p, q, s, scaled=True):
    """Eqs. 2c, 3c to 3g in NumPy: factor and direction put right."""
    q, goal = np.asarray(q), np.asarray(s.goal)
    d = np.linalg.norm(q - goal)
    total = -p.k_att * (q - goal) if d <= p.d_star else -p.k_att * p.d_star * (q - goal) / d
    for centre, radius in zip(PRINTED, np.asarray(s.radius), strict=True):
        rho, zeta = np.linalg.norm(q - centre) - radius, p.zeta * radius
        if rho < zeta:
            normal = (q - centre) / np.linalg.norm(q - centre)
            factor = d**p.exponent if scaled else 1.0
            total = total + p.k_rep * (1 / rho - 1 / zeta) / rho**2 * factor * normal
            if scaled:
                toward = (goal - q) / d
                total = total + p.exponent / 2 * p.k_rep * (1 / rho - 1 / zeta) ** 2 * d ** (p.exponent - 1) * toward
    return total


@pytest.mark.parametrize("scaled", [True, False])
@pytest.mark.parametrize("exponent", [2.0, 3.0])
@pytest.mark.parametrize("d_star", [0.2, 1.0])
def test_force_is_the_papers_corrected(scaled, exponent, d_star):
    s = scene()
    p = PotentialParams(exponent=exponent, d_star=d_star, k_rep=3e-5)
    for q in ([0.3, 0.5, 0.12], [0.35, 0.6, 0.2], [0.56, 0.27, 0.17], [0.1, 0.7, 0.15]):
        mine = force(p, jnp.asarray(q), s.goal, s.distances, s.radius, scaled)
        np.testing.assert_allclose(mine, closed_force(p, q, s, scaled), rtol=1e-10, atol=1e-14)


def test_attraction_value_and_slope_meet_at_d_star():
    p = PotentialParams(d_star=0.4)
    goal = jnp.asarray(GOAL)

    def at(d):
        return attractive_potential(p, goal + jnp.asarray([0.0, d, 0.0]), goal)

    np.testing.assert_allclose(at(0.3), 0.03 * 0.3**2 / 2, rtol=1e-12)
    np.testing.assert_allclose(at(0.4 - 1e-9), at(0.4 + 1e-9), rtol=1e-7)
    np.testing.assert_allclose(jax.grad(at)(0.4 - 1e-9), jax.grad(at)(0.4 + 1e-9), rtol=1e-7)
    np.testing.assert_allclose(at(0.9) - at(0.7), 0.03 * 0.4 * 0.2, rtol=1e-12)


def test_inverse_distance_continues_by_its_tangent(dtype):
    rho = jnp.asarray([0.02, 0.005, 0.0, -0.01], dtype)
    np.testing.assert_allclose(inverse_distance(rho, 0.005), [50, 200, 400, 800], rtol=1e-5)
    slope = jax.vmap(jax.grad(lambda r: inverse_distance(r[None], 0.005)[0]))(rho)
    np.testing.assert_allclose(slope, [-2500, -40000, -40000, -40000], rtol=1e-5)
    assert inverse_distance(rho, 0.005).dtype == dtype


def test_repulsion_ends_at_its_influence_and_absent_obstacles_do_not_repel():
    rho, influence = jnp.asarray([0.1, 0.3, 0.2, 10.0]), jnp.asarray([0.2, 0.2, 0.2, 0.0])
    value = repulsive_potentials(PotentialParams(k_rep=2.0), rho, influence, jnp.asarray(1.0))
    np.testing.assert_allclose(value, [(10 - 5) ** 2, 0, 0, 0], rtol=1e-12)


def test_force_pushes_out_from_inside_and_stays_finite(dtype):
    s = scene(dtype=dtype)
    p = PotentialParams()
    for depth in (0.0, 0.01, 0.03 - 1e-4):
        q = jnp.asarray(PRINTED[2] + np.array([0.0, 0.03 - depth, 0.0]), dtype)
        push = force(p, q, s.goal, s.distances, s.radius)
        assert push.dtype == dtype
        assert float(push[1]) > 1.0  # tens of steps' worth of attraction
    centre = force(p, jnp.asarray(PRINTED[2], dtype), s.goal, s.distances, s.radius)
    assert np.isfinite(centre).all()
    at_goal = force(p, s.goal, s.goal, s.distances, s.radius)
    np.testing.assert_allclose(at_goal, 0, atol=1e-7)


def test_d_factor():
    goal = jnp.zeros(3)
    q = jnp.asarray([0.3, 0.0, 0.4])
    np.testing.assert_allclose(d_factor(PotentialParams(exponent=3.0), q, goal), 0.125, rtol=1e-12)
    assert float(d_factor(PotentialParams(), q, goal, False)) == 1.0
    assert float(d_factor(PotentialParams(), goal, goal)) == 0.0


@pytest.mark.parametrize("q", [[0.3, 0.5, 0.12], list(GOAL), [0.3, 0.58, 0.2], [0.52, 0.5, 0.201]])
def test_derivatives(q):
    s = scene()
    q = jnp.asarray(q)
    params = jax.tree.map(jnp.asarray, PotentialParams())

    @jax.jit
    def value(params, q):
        return potential(params, q, s.goal, s.distances, s.radius)

    if not np.allclose(q, GOAL):
        check_grads(value, (params, q), order=1, modes=["fwd", "rev"], rtol=1e-4, atol=1e-4, eps=1e-8)
    for grad in (jax.grad(value, argnums=(0, 1)), jax.jacfwd(jax.grad(value, argnums=1), argnums=(0, 1))):
        assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(grad(params, q)))


def test_limited():
    np.testing.assert_allclose(limited(jnp.asarray([3.0, 0.0, 4.0]), 0.5), [0.3, 0, 0.4], rtol=1e-12)
    np.testing.assert_allclose(limited(jnp.asarray([0.3, 0.0, 0.0]), 0.5), [0.3, 0, 0], rtol=1e-12)
    assert np.isfinite(jax.jacfwd(lambda x: limited(x, 0.5))(jnp.zeros(3))).all()
