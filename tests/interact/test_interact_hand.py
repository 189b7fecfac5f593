"""The hand in a cloud, and from image to image: against points made from a known arm, and known motions."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.interact import HandParams, Seen, TrackParams, find_hand, hand_now, no_hand, still_for, watch_hand
from hrcjax.presence import CELL_VOXELS
from hrcjax.presence.cloud import were_measured

F = jnp.result_type(float)
RADIUS = 0.103


def _f(x: object) -> jax.Array:
    return jnp.asarray(x, F)


def arm_points(middle: np.ndarray, axis: np.ndarray, seed: int = 0, noise: float = 0.003) -> np.ndarray:
    """Points about 4 cm apart on a hand, a ball with 10 cm of a cylinder behind it, and on a thinner forearm; the side to the robot and above."""
    draw = np.random.default_rng(seed)
    axis = axis / np.linalg.norm(axis)  # from the hand to the elbow
    found = []
    for start, end, radius, count in ((0.0, 0.1, RADIUS, 130), (0.1, 0.36, 0.066, 90)):
        along = draw.uniform(start - radius if start == 0 else start, end, count)
        around = draw.normal(size=(count, 3))
        around -= (around @ axis)[:, None] * axis
        around /= np.linalg.norm(around, axis=1)[:, None]
        ring = np.sqrt(np.maximum(radius**2 - np.minimum(along, 0) ** 2, 0))
        found.append(middle + along[:, None] * axis + ring[:, None] * around)
    points = np.concatenate(found)
    seen = (points - middle) @ np.array([0.0, -0.7, 0.7]) > -0.02
    return (points + noise * draw.normal(size=points.shape))[seen]


def seen_at(points: np.ndarray, t: float, stamp: float) -> Seen:
    room = np.zeros((256, 3))
    room[: len(points)] = points
    return Seen(jnp.asarray(room), jnp.arange(256) < len(points), _f(stamp), _f(t))


@pytest.mark.parametrize("seed", [0, 1])
def test_the_ball_is_at_the_end_of_the_arm_and_does_not_slide_up(seed: int) -> None:
    middle, axis = np.array([0.3, 0.7, 0.3]), np.array([0.4, 1.0, 0.8])
    seen = seen_at(arm_points(middle, axis, seed), 0.0, 0.0)
    hand = find_hand(HandParams(), seen)
    assert bool(hand.there) and np.linalg.norm(np.asarray(hand.x) - middle) < 0.01
    blunt = find_hand(eqx.tree_at(lambda p: p.edge, HandParams(), 100.0), seen)  # all points alike
    assert np.linalg.norm(np.asarray(blunt.x) - middle) > 0.015
    nobody = find_hand(HandParams(), Seen(seen.points, jnp.zeros(256, bool), seen.stamp, seen.t))
    assert not bool(nobody.there) and np.isfinite(np.asarray(nobody.x)).all()


def test_hidden_space_is_told_from_what_was_measured() -> None:
    middles = np.asarray(CELL_VOXELS.lower) + 0.05 * (np.array([[10, 50, 7], [44, 60, 3]]) + 0.5)
    coarse = np.asarray(CELL_VOXELS.lower) + 0.1 * (np.array([[10, 25, 7]]) + 0.5)
    means = middles + np.array([[0.01, 0, 0], [0.004, -0.003, 0.008]])
    found = were_measured(CELL_VOXELS, jnp.asarray(np.concatenate([middles, coarse, means]), F))
    assert found.tolist() == [False, False, False, True, True]


def tracked(place, seconds: float = 3.0, params: TrackParams | None = None, latency: float = 0.05):  # type: ignore[no-untyped-def]
    """Tracks of a hand at place(t), from images of 30 Hz that are used after the latency: (t, place now, track) of every tick."""
    params = TrackParams(lag=0.0) if params is None else params
    step = jax.jit(lambda track, seen: watch_hand(params, track, seen))
    now = jax.jit(lambda track, t: hand_now(params, track, t)[0])
    track, found = no_hand(F), []
    ball = np.asarray(arm_points(np.zeros(3), np.array([0.0, 1.0, 0.8]), noise=0.0))
    for t in np.arange(0, seconds, 0.016):
        stamp = np.floor((t - latency) * 30) / 30
        track = step(track, seen_at(place(stamp) + ball, t, stamp))
        found.append((t, np.asarray(now(track, _f(t))), track))
    return found


def test_a_hand_that_moves_is_where_it_is_now_not_where_it_was() -> None:
    def place(t: float) -> np.ndarray:
        return np.array([0.1 + 0.3 * t, 0.8, 0.3])

    off = [x - place(t) for t, x, _ in tracked(place, 2.0) if t > 1.0]
    spread = np.array(off) - np.mean(off, axis=0)
    assert np.abs(np.mean(off, axis=0)).max() < 0.012 and np.abs(spread).max() < 0.012  # 3 cm behind without prediction


def test_still_counts_from_the_rest_on_and_ends_with_a_move() -> None:
    def place(t: float) -> np.ndarray:
        return np.array([0.3 + 0.4 * max(0.5 - t, 0.0) + 0.4 * max(t - 2.0, 0.0), 0.8, 0.3])

    still = {round(t, 3): float(still_for(track, t)) for t, _, track in tracked(place, 2.6)}
    assert still[0.48] < 0.2 and 1.1 < still[1.792] < 1.5
    assert still[2.4] < 0.2
    assert float(still_for(no_hand(F), 1.0)) == 0.0
