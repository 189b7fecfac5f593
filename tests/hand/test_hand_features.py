"""Features of hands: what they must not change with, and what they must."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_hands import made_hand
from scipy.spatial.distance import pdist

from hrcjax.hand import CLOSED, NONE, OPEN, POINTING, Classifier, extended_fingers, pair_distances, rule_gesture

FEATURES = jax.jit(pair_distances)
numbers = st.floats(-3.0, 3.0)


def test_they_are_the_distances_of_scipy() -> None:
    x = np.random.default_rng(0).normal(size=(21, 2))
    d = pdist(x)
    np.testing.assert_allclose(FEATURES(jnp.asarray(x)), d / np.sqrt((d**2).mean()), rtol=1e-6)


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    angle=numbers,
    dx=numbers,
    dy=numbers,
    scale=st.floats(0.05, 500.0),
    mirror=st.booleans(),
)
def test_place_turn_size_and_side_change_nothing(seed, angle, dx, dy, scale, mirror) -> None:
    x = np.random.default_rng(seed).normal(size=(21, 2))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    other = scale * (x * [-1.0 if mirror else 1.0, 1.0]) @ turn.T + scale * np.array([dx, dy])
    np.testing.assert_allclose(FEATURES(jnp.asarray(other)), FEATURES(jnp.asarray(x)), atol=2e-4)


def test_they_change_with_the_shape_alone() -> None:
    hands = [np.asarray(FEATURES(jnp.asarray(made_hand(up)))) for up in ((1, 1, 1, 1), (0, 0, 0, 0), (1, 0, 0, 0))]
    for a, b in ((0, 1), (0, 2), (1, 2)):
        assert np.abs(hands[a] - hands[b]).max() > 0.3
    stretched = made_hand((1, 1, 1, 1)) * [1.0, 0.7]
    assert np.abs(FEATURES(jnp.asarray(stretched)) - hands[0]).max() > 0.1


def test_a_hand_in_one_place_has_finite_features_and_derivatives() -> None:
    x = jnp.ones((21, 2))
    assert np.asarray(pair_distances(x) == 0).all()
    assert np.isfinite(jax.jacrev(pair_distances)(x)).all()
    assert np.isnan(pair_distances(x.at[3, 0].set(jnp.nan))).any()


@pytest.mark.parametrize(
    "up, gesture",
    [
        ((1, 1, 1, 1), OPEN),
        ((0, 0, 0, 0), CLOSED),
        ((1, 0, 0, 0), POINTING),
        ((1, 1, 0, 0), NONE),
        ((0, 0, 0, 1), NONE),
    ],
)
def test_the_rule_counts_fingers(up, gesture) -> None:
    for angle in (0.0, 1.0, 4.0):
        x = jnp.asarray(made_hand(up, angle))
        assert np.asarray(extended_fingers(x)).tolist() == [bool(one) for one in up]
        assert int(rule_gesture(x)) == gesture
    assert int(rule_gesture(x.at[0, 0].set(jnp.nan))) == NONE


def test_probabilities_of_a_network_made_by_hand() -> None:
    """A network of one unit, whose answer is worked out beside it."""
    rng = np.random.default_rng(1)
    w, v = rng.normal(size=(210, 5)), rng.normal(size=(5, 4))
    model = Classifier(
        jnp.full(210, 0.3), jnp.full(210, 2.0), (jnp.asarray(w), jnp.asarray(v)), (jnp.ones(5), jnp.arange(4.0))
    )
    x = rng.normal(size=(21, 2))
    d = pdist(x)
    f = (d / np.sqrt((d**2).mean()) - 0.3) / 2.0
    z = np.maximum(f @ w + 1.0, 0.0) @ v + np.arange(4.0)
    expected = np.exp(z - z.max()) / np.exp(z - z.max()).sum()
    np.testing.assert_allclose(model.probabilities(jnp.asarray(x)), expected, rtol=1e-5)
    assert np.isnan(model.probabilities(jnp.asarray(x).at[2, 1].set(jnp.nan))).all()
