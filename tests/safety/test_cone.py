"""Directions that are off by an angle: the worst approach against dense directions, and persons who really are elsewhere."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.safety import direction_sine, steep_limit, worst_approach


def turned(rng, away, theta, count):
    """Unit vectors within theta of a unit vector, many of them at theta."""
    side = rng.normal(size=(count, 3))
    side -= (side @ away)[:, None] * away
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    angle = theta * np.where(np.arange(count) % 2, 1.0, rng.uniform(0, 1, count))[:, None]
    return np.cos(angle) * away + np.sin(angle) * side


@pytest.mark.parametrize("seed", range(20))
def test_the_worst_of_all_directions(seed: int) -> None:
    rng = np.random.default_rng(seed)
    away, v = rng.normal(size=(2, 3))
    away /= np.linalg.norm(away)
    theta = rng.uniform(0.01, np.pi / 2)
    every = -turned(rng, away, theta, 100_000) @ v
    along = -away @ v
    across = np.sqrt(v @ v - along**2)
    worst = float(worst_approach(jnp.asarray(along), jnp.asarray(across), jnp.asarray(np.sin(theta))))
    assert every.max() <= worst + 1e-9
    assert worst - every.max() < 2e-3 * np.linalg.norm(v), "and not more than that"


@pytest.mark.parametrize("seed", range(20))
def test_somebody_beside_where_they_are_seen(seed: int) -> None:
    """A person, a ball, moved by up to e in any direction: the point that keeps the steep limit approaches them nowhere."""
    rng = np.random.default_rng(100 + seed)
    D, e = rng.uniform(0.05, 0.5), rng.uniform(0.01, 0.1)
    e = min(e, 0.7 * D)  # up to 45 degrees
    sine, across = float(direction_sine(jnp.asarray(D), jnp.asarray(e))), rng.uniform(0, 0.25)
    along = float(steep_limit(jnp.asarray(0.0), jnp.asarray(across), jnp.asarray(sine)))
    seen = np.array([D, 0.0, 0.0])  # the point is at the origin
    v = np.array([along, across, 0.0])
    moved = rng.normal(size=(20_000, 3))
    moved *= e * rng.uniform(0.8, 1, (20_000, 1)) / np.linalg.norm(moved, axis=1, keepdims=True)
    way = seen + moved
    approach = (way @ v) / np.linalg.norm(way, axis=1)
    assert approach.max() <= 1e-9
    assert approach.max() > -0.05 * across, "no retreat is asked for that is not needed"
    flat = (way @ [0.0, across, 0.0]) / np.linalg.norm(way, axis=1)
    assert flat.max() > 0.5 * across * sine, "a limit of 0 alone would let it approach them"


def test_exact_directions_change_nothing() -> None:
    along, across = jnp.asarray([-0.3, 0.0, 0.2]), jnp.asarray([0.1, 0.4, 0.2])
    sine = direction_sine(jnp.asarray([0.3, -0.1, 0.0]), jnp.asarray(0.0))
    np.testing.assert_array_equal(sine, 0.0)
    np.testing.assert_array_equal(worst_approach(along, across, sine), along)
    np.testing.assert_array_equal(steep_limit(along, across, sine), along)


def test_where_the_person_may_be_on_any_side() -> None:
    """At a touch, the part across counts whole for a retreat, and the whole speed for an approach."""
    sine = direction_sine(jnp.asarray([-0.1, 0.0, 0.02]), jnp.asarray(0.03))
    np.testing.assert_array_equal(sine, 1.0)
    worst = worst_approach(jnp.asarray([-0.3, 0.3, -0.3]), jnp.asarray([0.4, 0.4, 0.0]), sine)
    np.testing.assert_allclose(worst, [0.4, 0.5, 0.0], atol=1e-7)


def test_singular_points(dtype) -> None:
    def f(along, across, D):
        sine = direction_sine(D, jnp.asarray(0.03, dtype))
        return worst_approach(along, across, sine) + steep_limit(along, across, sine)

    slope = jax.vmap(jax.grad(f, argnums=(0, 1, 2)))
    zero = jnp.zeros(5, dtype)
    D = jnp.asarray([-0.1, 0.0, 0.03, 0.3, 1e4], dtype)
    assert all(bool(jnp.isfinite(one).all()) for one in slope(zero, zero, D))
    assert bool(jnp.isnan(f(*jnp.asarray([0.0, 0.1, jnp.nan], dtype))))
