"""Parts of a body from a place, against exact capsules in NumPy that are moved step by step."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from standing import gaps, person_of, pose

from hrcjax.body import BodyFit, BodyParams, joints_of, part_capsules
from hrcjax.body.parts_from import ANY_SPEED, head_gap, parts_from, seen_since, surface_gap
from hrcjax.body.skeleton import HEAD_PART, USUAL_LENGTHS, USUAL_RADII
from hrcjax.body.state import sure_track

PARAMS = BodyParams()
PLACES = np.array([[0.2, 0.3, 0.9], [-0.4, 0.6, 0.4], [0.2, 1.0, 1.6]])
HORIZON = 0.45


def standing(speeds: np.ndarray, deviation: float = 0.0) -> BodyFit:
    """A body that is known exactly, with the speeds of its joints."""
    joints = joints_of(person_of(pose()))[0]
    every = jnp.broadcast_to(jnp.eye(3), (11, 3, 3))
    return BodyFit(
        joints, jnp.asarray(USUAL_RADII), jnp.broadcast_to(jnp.asarray(speeds), (11, 3)), 1e-6 * every, deviation**2 * every,
        jnp.asarray(USUAL_LENGTHS), jnp.full((10,), 9.0), jnp.zeros((10,)), jnp.asarray(1.0), jnp.asarray(2.0), jnp.asarray(True),
        jnp.full((4, 3), 100.0),
    )  # fmt: skip


look = jax.jit(lambda fit, x: parts_from(PARAMS, fit, x, HORIZON))


@pytest.mark.parametrize("x", PLACES)
def test_distances_are_those_of_the_capsules(x: np.ndarray) -> None:
    fit = standing(np.zeros(3))
    exact = gaps(x[None], part_capsules(fit.joints, fit.radii))[0]
    np.testing.assert_allclose(look(fit, jnp.asarray(x)).distance, exact, atol=1e-6)
    np.testing.assert_allclose(surface_gap(fit, jnp.asarray(x)), exact.min(), atol=1e-6)


@pytest.mark.parametrize("x", PLACES)
@pytest.mark.parametrize("seed", range(6))
def test_no_part_comes_faster_than_its_bound(x: np.ndarray, seed: int) -> None:
    """Every joint goes its own way: ends of parts that come from farther too."""
    speeds = np.random.default_rng(seed).normal(size=(11, 3)) * 1.5
    fit = standing(speeds)
    found = look(fit, jnp.asarray(x))
    begin = gaps(x[None], part_capsules(fit.joints, fit.radii))[0]
    for t in np.linspace(0.05, HORIZON, 9):
        there = gaps(x[None], part_capsules(fit.joints + t * fit.speeds, fit.radii))[0]
        assert (begin - there <= np.maximum(np.asarray(found.v_h), 0) * t + 1e-5).all()


def test_the_sign_of_a_walk() -> None:
    """Towards the place is positive, away negative, and the uncertainty adds to both."""
    x = jnp.asarray([0.2, 0.0, 1.0])
    for way, sign in ((-0.8, 1), (0.8, -1)):
        found = look(standing(np.array([0.0, way, 0.0])), x)
        assert (np.sign(found.v_h[:2]) == sign).all()
    sure, vague = (look(standing(np.array([0.0, -0.8, 0.0]), dev), x).v_h for dev in (0.0, 0.1))
    np.testing.assert_allclose(vague[:2] - sure[:2], PARAMS.deviations * 0.1, atol=0.02)


def test_what_is_not_seen_is_not_known() -> None:
    fit = standing(np.zeros(3))
    unseen = jnp.zeros(10).at[jnp.asarray([2, 8])].set(1.0)
    hidden = eqx.tree_at(lambda f: f.unseen, fit, unseen)
    since = np.asarray(seen_since(hidden))
    assert since[2] == 0 and since[8] == 1, "a neck is between trunk and head; fingers are the end of a hand alone"
    found = look(hidden, jnp.asarray(PLACES[0]))
    assert found.v_h[8] == ANY_SPEED and not found.known[8] and found.known[2] and found.v_h[2] < 1
    vague = eqx.tree_at(lambda f: f.place_covariance, fit, 3e3 * fit.place_covariance)
    far, near = (look(f, jnp.asarray(PLACES[0])) for f in (fit, vague))
    assert not near.known.any() and (near.distance < far.distance - 0.05).all()


@pytest.mark.parametrize(
    ("where", "value", "sure"),
    [("age", 1.01, True), ("age", 0.99, False), ("explained", 0.84, False), ("tracked", False, False), ("speeds", np.nan, False)],
)  # fmt: skip
def test_a_sure_track(where: str, value: float, sure: bool) -> None:
    fit = standing(np.zeros(3))
    leaf = getattr(fit, where)
    changed = eqx.tree_at(lambda f: getattr(f, where), fit, jnp.full_like(leaf, value))
    assert bool(sure_track(PARAMS, fit)) and bool(sure_track(PARAMS, changed)) == sure


def test_the_head_where_it_is_and_where_it_will_be() -> None:
    x = np.array([[0.2, 0.5, 1.3], [0.3, 1.5, 1.1]])
    for way in (-1.0, 1.0):
        fit = standing(np.array([0.0, way, 0.0]))
        ends = [gaps(x, part_capsules(fit.joints + t * fit.speeds, fit.radii))[:, HEAD_PART] for t in (0.0, 0.1)]
        distance, away = head_gap(PARAMS, fit, jnp.asarray(x), 0.1)
        np.testing.assert_allclose(distance, np.minimum(*ends), atol=1e-6)
        for k in range(3):  # against differences
            e = 1e-4 * np.eye(3)[k]
            more, less = (
                np.asarray(head_gap(PARAMS, fit, jnp.asarray(x + side * e), 0.1)[0], float) for side in (1, -1)
            )
            np.testing.assert_allclose(away[:, k], (more - less) / 2e-4, atol=5e-3)
