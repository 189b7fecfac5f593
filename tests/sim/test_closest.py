"""The least distance over all ticks against brute force."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.segment import capsule_distance
from hrcjax.sim.closest import RESOLVED, Sampled, closest, least_between, travelled

STRIDE = 10


def all_distances(one: Capsules, other: Capsules) -> jax.Array:
    """(time, capsule, other) [m]."""
    apart = jax.vmap(jax.vmap(capsule_distance, (None, None, None, 0, 0, 0)), (0, 0, 0, None, None, None))
    return jax.vmap(apart)(one.a, one.b, one.radius, other.a, other.b, other.radius)


def search(one: Capsules, other: Capsules, counts: jax.Array, enough: float | None = None) -> jax.Array:
    """The least distance, from every `STRIDE`-th."""
    some = all_distances(*jax.tree.map(lambda a: a[::STRIDE], (one, other)))
    way = travelled(one, STRIDE)[:, :, None] + travelled(other, STRIDE)[:, None, :]
    count = other.a.shape[1]

    def at(tick: jax.Array, pair: jax.Array) -> jax.Array:
        i, j = pair // count, pair % count
        return capsule_distance(
            one.a[tick, i], one.b[tick, i], one.radius[tick, i], other.a[tick, j], other.b[tick, j], other.radius[tick, j]
        )  # fmt: skip

    flat = Sampled(some.reshape(some.shape[0], -1), way.reshape(some.shape[0], -1))
    return closest(at, flat, counts, STRIDE, enough)


def drawn(seed: int, time: int, rough: float, still: bool) -> tuple[Capsules, Capsules, jax.Array]:
    """Two sets of capsules that wander, smoothly or roughly, one of them now and then still; and ticks that count."""
    draw = np.random.default_rng(seed)

    def wander(count: int) -> Capsules:
        ends = draw.normal(size=(2, 1, count, 3)) * 0.4
        step = draw.normal(size=(2, time, count, 3)) * rough
        smooth = np.sin(draw.uniform(0, 9, (2, 1, count, 3)) + np.linspace(0, 9, time)[:, None, None]) * 0.3
        if still:
            step[:, time // 3 : time // 2] = 0
            smooth[:, time // 3 : time // 2] = smooth[:, time // 3 : time // 3 + 1]
        a, b = ends + smooth + step.cumsum(axis=1)
        return Capsules(jnp.asarray(a), jnp.asarray(b), jnp.full((time, count), 0.02))

    return wander(3), wander(4), jnp.asarray(draw.uniform(size=time) < draw.choice([0.1, 0.7, 1.0]))


@pytest.mark.parametrize("time", [240, 233, 221])
def test_the_least_of_all_ticks(time: int) -> None:
    both = jax.jit(lambda one, other, counts: (search(one, other, counts), all_distances(one, other)))
    sooner = 0
    for seed in range(40):
        one, other, counts = drawn(seed, time, [0.0, 1e-4, 0.01, 0.1][seed % 4], seed % 3 == 0)
        found, every = both(one, other, counts)
        least = np.asarray(every).min(axis=(1, 2))
        np.testing.assert_allclose(found, least[np.asarray(counts)].min(), atol=RESOLVED)
        sooner += least[::STRIDE][np.asarray(counts)[::STRIDE]].min(initial=np.inf) > float(found) + 1e-4
    assert sooner > 20, "most least distances must lie between samples"


def test_bounds_hold() -> None:
    for seed in range(12):
        one, other, _ = drawn(seed, 240, [0.0, 0.01, 0.1][seed % 3], False)
        every = np.asarray(jax.jit(all_distances)(one, other))
        way = travelled(one, STRIDE)[:, :, None] + travelled(other, STRIDE)[:, None, :]
        bound = np.asarray(least_between(Sampled(jnp.asarray(every[::STRIDE].reshape(24, -1)), way.reshape(24, -1))))
        assert (every.reshape(24, STRIDE, -1).min(axis=1) >= bound - 1e-12).all()


def test_is_there_any_distance_below() -> None:
    """Far from it nothing is looked at; a single tick suffices."""
    one, other, _ = drawn(1, 240, 0.01, False)
    under = jax.jit(lambda counts, enough: search(one, other, counts, enough), static_argnums=1)
    least = float(under(jnp.ones(240, bool), None))
    assert float(under(jnp.ones(240, bool), least + 0.01)) < least + 0.01
    assert float(under(jnp.ones(240, bool), least - 0.01)) >= least - 0.01
    when = int(np.asarray(all_distances(one, other)).min(axis=(1, 2)).argmin())
    assert when % STRIDE, "between samples"
    assert float(under(jnp.arange(240) == when, least + 1e-9)) == pytest.approx(least)
    assert np.isinf(under(jnp.zeros(240, bool), None)) and np.isinf(under(jnp.zeros(240, bool), least - 0.01))


def test_a_touch_of_one_tick_between_samples() -> None:
    """Two balls that pass within three ticks, and stand far off at all samples."""
    x = np.full((60, 1, 3), 0.5)
    x[34:37, 0] = [[0.2, 0, 0], [0.01, 0, 0], [0.2, 0, 0]]
    one = Capsules(jnp.asarray(x), jnp.asarray(x), jnp.full((60, 1), 0.02))
    other = jax.tree.map(jnp.zeros_like, one)
    least = jax.jit(search)
    assert float(least(one, other, jnp.ones(60, bool))) == pytest.approx(0.01 - 0.02)
    assert float(least(one, other, jnp.arange(60) != 35)) == pytest.approx(0.2 - 0.02)


@pytest.mark.parametrize("every", [1, STRIDE])
def test_derivative_is_that_of_the_nearest_moment(every: int) -> None:
    """Between samples, and at one."""
    one, other, counts = drawn(5, 120, 0.01, False)
    counts = jnp.arange(120) % every == 0

    def moved(by: jax.Array) -> Capsules:
        return Capsules(one.a + by * jnp.sin(one.a), one.b, one.radius)

    def brute(by: jax.Array) -> jax.Array:
        return jnp.min(all_distances(moved(by), other)[::every])

    def ours(by: jax.Array) -> jax.Array:
        return search(moved(by), other, counts)

    for grad in (jax.grad, jax.jacfwd):
        found = jax.jit(grad(ours))(0.1)
        assert abs(found) > 1e-3
        np.testing.assert_allclose(found, jax.jit(jax.grad(brute))(0.1), rtol=1e-9)
    batch = jnp.linspace(0, 0.3, 5)
    np.testing.assert_allclose(jax.jit(jax.vmap(ours))(batch), jax.vmap(brute)(batch), atol=RESOLVED)


@pytest.mark.parametrize("when", [20, 23])
def test_what_is_not_a_number_is_not_free(when: int) -> None:
    """At a sample, and between samples where the least distance is looked for."""
    x = np.full((60, 1, 3), 0.5)
    x[21:26, 0] = 0.1
    one = Capsules(jnp.asarray(x).at[when].set(jnp.nan), jnp.asarray(x), jnp.full((60, 1), 0.02))
    other = jax.tree.map(lambda a: jnp.zeros((60, *a.shape[1:])), one)
    assert np.isnan(jax.jit(search)(one, other, jnp.ones(60, bool)))
