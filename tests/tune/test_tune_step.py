"""Steps of tuning on functions whose optimum is known: optimum, minibatches, a start that is not finite, an update by hand."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import minimize

from hrcjax.tune.step import TuneState, Values, initial_tuning, minibatch, tune_step, values_and_gradients

optax = pytest.importorskip("optax")
WEIGHTS = (2.0, 0.5)
WORLDS = jnp.asarray([[1.0, -2.0], [3.0, 0.5], [-1.0, 4.0]])
"""In place of a world, the point that it pulls to."""


def terms(params, world):
    """Two terms: pulled to the world's point, and to each other."""
    return jnp.stack([jnp.sum((params - world) ** 2), (params[0] - params[1]) ** 2])


def values(vectors, worlds=WORLDS, function=terms) -> Values:
    return values_and_gradients(function, WEIGHTS, lambda v: v, jnp.asarray(vectors), worlds)


def optimum() -> np.ndarray:
    """By scipy."""
    worlds = np.asarray(WORLDS)
    loss = lambda x: 2.0 * np.mean(np.sum((x - worlds) ** 2, axis=1)) + 0.5 * (x[0] - x[1]) ** 2  # noqa: E731
    return minimize(loss, np.zeros(2), tol=1e-12).x


def test_values_by_hand() -> None:
    found = values([[1.0, 1.0], [0.0, 2.0]])
    points = np.asarray(WORLDS)
    for k, x in enumerate(([1.0, 1.0], [0.0, 2.0])):
        pulled = np.mean(np.sum((np.array(x) - points) ** 2, axis=1))
        np.testing.assert_allclose(found.each[k, :, 0], np.sum((np.array(x) - points) ** 2, axis=1), rtol=1e-12)
        np.testing.assert_allclose(found.terms[k], [pulled, (x[0] - x[1]) ** 2], rtol=1e-12)
        np.testing.assert_allclose(found.loss[k], 2 * pulled + 0.5 * (x[0] - x[1]) ** 2, rtol=1e-12)
        apart = np.array([x[0] - x[1], x[1] - x[0]])
        np.testing.assert_allclose(found.gradient[k], 4 * (np.array(x) - points.mean(axis=0)) + apart, rtol=1e-12)


def test_every_start_finds_the_optimum() -> None:
    optimiser = optax.adam(0.1)
    state = initial_tuning(jnp.asarray([[0.0, 0.0], [5.0, -5.0], [-3.0, 8.0]]), optimiser, jax.random.key(0))
    step = jax.jit(lambda s: tune_step(s, values(s.vector), optimiser))
    for _ in range(800):
        state = step(state)
    np.testing.assert_allclose(state.best, np.tile(optimum(), (3, 1)), atol=1e-5)
    np.testing.assert_allclose(state.best_loss, values([optimum()]).loss[0], rtol=1e-8)
    assert int(state.step) == 800 and not np.asarray(state.skipped).any()


def test_first_update_is_that_of_the_optimiser_alone() -> None:
    optimiser = optax.chain(optax.clip_by_global_norm(1.0), optax.sgd(0.1))
    vectors = jnp.asarray([[0.0, 0.0], [5.0, -5.0]])
    state = tune_step(initial_tuning(vectors, optimiser, jax.random.key(0)), values(vectors), optimiser)
    gradient = np.asarray(values(vectors).gradient)
    clipped = gradient / np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1.0)
    np.testing.assert_allclose(state.vector, np.asarray(vectors) - 0.1 * clipped, rtol=1e-12)


@pytest.mark.parametrize("bad", ["loss", "gradient"])
def test_a_start_that_is_not_finite_goes_back_and_spoils_no_other(bad: str) -> None:
    def broken(params, world):
        away = jnp.sum((params - world) ** 2)
        value = jnp.where(params[0] > 4, jnp.nan, 0.0)
        slope = jnp.sqrt(jnp.where(params[0] > 4, 0 * params[0], 1.0)) - 1  # of a root of 0: infinity times 0
        wrong = value if bad == "loss" else slope
        return jnp.stack([away + wrong, (params[0] - params[1]) ** 2])

    optimiser = optax.adam(0.1)
    vectors = jnp.asarray([[0.0, 0.0], [5.0, -5.0]])
    state = alone = initial_tuning(vectors, optimiser, jax.random.key(0))
    for _ in range(5):
        state = tune_step(state, values(state.vector, function=broken), optimiser)
        alone = tune_step(alone, values(alone.vector), optimiser)
    assert np.asarray(state.skipped).tolist() == [0, 5]
    np.testing.assert_array_equal(state.vector[0], alone.vector[0])
    np.testing.assert_array_equal(state.vector[1], vectors[1])  # there is no better place to go back to
    known = TuneState(**{**vars(state), "best": jnp.asarray([[0.0, 0.0], [1.0, 3.0]])})
    back = tune_step(known, values(known.vector, function=broken), optimiser)
    np.testing.assert_array_equal(back.vector[1], [3.0, -1.0])
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(state.optimiser))
    assert np.isinf(state.best_loss[1])


def test_minibatches() -> None:
    key = jax.random.key(3)
    drawn = np.stack([minibatch(key, jnp.asarray(step), 7, 3) for step in range(200)])
    assert all(len(set(some)) == 3 for some in drawn.tolist()) and set(drawn.ravel()) == set(range(7))
    counts = np.bincount(drawn.ravel())
    assert counts.min() > 55 and counts.max() < 120, "each world about as often"
    np.testing.assert_array_equal(minibatch(key, jnp.asarray(9), 7, 3), drawn[9])
    np.testing.assert_array_equal(minibatch(key, jnp.asarray(0), 4, 4), np.arange(4))
    np.testing.assert_array_equal(minibatch(key, jnp.asarray(0), 4, 9), np.arange(4))
