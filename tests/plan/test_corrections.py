"""Each corrected equation of the potential field against finite differences of its scalar, written out in NumPy; and what is wrong
with it as printed."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.numerics import safe_norm
from hrcjax.plan import PotentialParams, force
from hrcjax.plan.potential import attractive_potential, d_factor

GOAL = np.array([0.7, 0.3, 0.05])
START = np.array([0.1, 0.7, 0.15])
CENTRE, RADIUS = np.array([0.5, 0.45, 0.1]), 0.03
POINTS = np.array([[0.44, 0.47, 0.12], [0.47, 0.52, 0.07], [0.55, 0.40, 0.06]])
P = PotentialParams(k_rep=3e-5, exponent=3.0, d_star=0.2)
INFLUENCE = P.zeta * RADIUS


def our_force(q, params=P, scaled=True, centre=CENTRE, goal=GOAL):
    def distances(x):
        return (safe_norm(x - jnp.asarray(centre)) - RADIUS)[None]

    return np.asarray(
        force(params, jnp.asarray(q, jnp.float64), jnp.asarray(goal), distances, jnp.asarray([RADIUS]), scaled)
    )


def slope(scalar, q, step=1e-6):
    """Central differences."""
    return np.array([(scalar(q + e) - scalar(q - e)) / (2 * step) for e in step * np.eye(3)])


def gap(q):
    return np.linalg.norm(q - CENTRE) - RADIUS


def attraction(q):
    """2e with the constant that makes it continuous."""
    d, s = np.linalg.norm(q - GOAL), P.d_star
    return P.k_att * (d * d / 2 if d <= s else s * d - s * s / 2)


def repulsion(q):
    """3b with the present configuration in the factor."""
    return P.k_rep / 2 * (1 / gap(q) - 1 / INFLUENCE) ** 2 * np.linalg.norm(q - GOAL) ** P.exponent


def parts(q):
    """3c with the factor, and 3f with its direction and one n: closed forms."""
    d, lift = np.linalg.norm(q - GOAL), 1 / gap(q) - 1 / INFLUENCE
    away, toward = (q - CENTRE) / np.linalg.norm(q - CENTRE), (GOAL - q) / d
    first = P.k_rep * lift / gap(q) ** 2 * d**P.exponent * away
    return first, P.exponent / 2 * P.k_rep * lift**2 * d ** (P.exponent - 1) * toward


def test_2c_far_attraction_is_constant_and_points_to_the_goal():
    far = PotentialParams(k_rep=0.0, d_star=0.2)
    for q in ([0.1, 0.7, 0.15], [0.3, 0.3, 0.4], [0.7, 0.3, 0.8]):
        q = np.array(q)
        np.testing.assert_allclose(our_force(q, far), -slope(attraction, q), rtol=1e-7, atol=1e-12)
        np.testing.assert_allclose(our_force(q, far), -0.03 * 0.2 * (q - GOAL) / np.linalg.norm(q - GOAL), rtol=1e-12)


@pytest.mark.parametrize("d_star", [0.2, 1.0, 3.0])
def test_2e_printed_potential_jumps_at_d_star_and_ours_does_not(d_star):
    params, toward = PotentialParams(d_star=d_star), np.array([0.0, 0.6, 0.8])

    def at(d):
        return float(attractive_potential(params, jnp.asarray(GOAL + d * toward), jnp.asarray(GOAL)))

    near, printed = 0.03 * d_star**2 / 2, d_star * 0.03 * d_star - 0.03 / (2 * d_star**2)
    np.testing.assert_allclose(at(d_star * (1 - 1e-9)), near, rtol=1e-8)
    np.testing.assert_allclose(at(d_star * (1 + 1e-9)), near, rtol=1e-8)
    assert (abs(printed - near) < 1e-12) == (d_star == 1.0)


def test_3a_goal_beside_an_obstacle_is_at_rest_with_the_present_configuration_alone():
    beside = GOAL + np.array([0.0, 0.05, 0.0])
    np.testing.assert_allclose(our_force(GOAL, centre=beside), 0, atol=1e-15)
    constant = np.linalg.norm(START - GOAL) ** P.exponent  # as printed: the unscaled push times a number
    pushed = constant * our_force(GOAL, scaled=False, centre=beside)
    assert pushed[1] < -10 * P.k_att * 0.01  # out of 1 cm around the goal
    q = jnp.asarray(POINTS[0])
    fading = jax.grad(lambda q: d_factor(P, q, jnp.asarray(GOAL)))(q)
    np.testing.assert_allclose(fading, slope(lambda q: np.linalg.norm(q - GOAL) ** P.exponent, POINTS[0]), rtol=1e-7)
    assert np.linalg.norm(fading) > 0.01


@pytest.mark.parametrize("q", POINTS)
def test_3c_first_part_carries_the_factor(q):
    first, second = parts(q)
    pull = -slope(attraction, q)
    np.testing.assert_allclose(our_force(q), pull - slope(repulsion, q), rtol=1e-5, atol=1e-12)
    np.testing.assert_allclose(our_force(q), pull + first + second, rtol=1e-5, atol=1e-12)
    printed = first / np.linalg.norm(q - GOAL) ** P.exponent
    assert np.linalg.norm(our_force(q) - pull - printed - second) > np.linalg.norm(first)


@pytest.mark.parametrize("q", POINTS)
def test_3f_second_part_is_n_times_smaller_than_printed_and_points_to_the_goal(q):
    first, second = parts(q)
    rest = our_force(q) + slope(attraction, q) - first
    np.testing.assert_allclose(rest, second, rtol=1e-4, atol=1e-4 * np.linalg.norm(first))
    assert rest @ (GOAL - q) > 0
    d, lift = np.linalg.norm(q - GOAL), 1 / gap(q) - 1 / INFLUENCE
    printed = P.exponent / 2 * P.k_rep * lift**2 * P.exponent * d ** (P.exponent - 1)  # 3e and 3f
    pull = our_force(q, PotentialParams(k_rep=0.0, exponent=P.exponent, d_star=P.d_star))
    ours = our_force(q) - pull - d**P.exponent * (our_force(q, scaled=False) - pull)  # what the factor's gradient adds
    np.testing.assert_allclose(printed / np.linalg.norm(ours), P.exponent, rtol=1e-9)
