"""A body followed in exact points: it is found, an arm out of sight is less and less sure, a jump is noticed."""

from functools import cache
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from standing import SEEN_FROM, gaps, person_of, pose, surface_points

from hrcjax.body import BodyFit, BodyParams, BodyState, Landmarks, initial_body, joints_of, part_capsules, track_body
from hrcjax.body.facing import spun
from hrcjax.body.least_squares import joined, split
from hrcjax.body.state import PLACES
from hrcjax.body.track import next_rivals
from hrcjax.numerics import unrolled_options

DT = 1 / 30


@cache
def program() -> Any:
    """One compiled frame for all tests; landmarks that are not given change nothing."""

    def frame(state: BodyState, points: jax.Array, mask: jax.Array, found: Landmarks) -> tuple[BodyState, BodyFit]:
        return track_body(BodyParams(), state, points, mask, DT, jnp.asarray(SEEN_FROM, jnp.float32), found)

    return jax.jit(frame, compiler_options=unrolled_options())


def none_found() -> Landmarks:
    return Landmarks(jnp.full((11, 3), jnp.nan, jnp.float32), jnp.zeros((11,), jnp.float32))


def follow(clouds: list[np.ndarray], found: Landmarks | None = None) -> tuple[BodyState, list[BodyFit]]:
    state, fits = initial_body(BodyParams()), []
    for cloud in clouds:
        points = np.zeros((320, 3), np.float32)
        points[: len(cloud)] = cloud
        mask = np.arange(320) < len(cloud)
        state, fit = program()(state, jnp.asarray(points), jnp.asarray(mask), found or none_found())
        fits.append(fit)
    return state, fits


@pytest.fixture(scope="module")
def followed() -> tuple[BodyState, list[BodyFit]]:
    return follow([surface_points(pose(), seed=k) for k in range(15)])


def test_a_person_is_found(followed: tuple[BodyState, list[BodyFit]]) -> None:
    fit = followed[1][-1]
    assert bool(fit.tracked)
    assert float(fit.explained) > 0.95
    off = np.linalg.norm(np.asarray(fit.joints) - np.asarray(joints_of(person_of(pose()))[0]), axis=1)
    assert off[3:].max() < 0.05  # both arms, and on the right sides
    assert np.median(off) < 0.02


def test_lengths_are_learnt(followed: tuple[BodyState, list[BodyFit]]) -> None:
    first, last = followed[1][0], followed[1][-1]
    true = np.array([0.33, 0.26])  # upper arm, forearm
    assert np.abs(np.asarray(last.lengths)[4:6] - true).max() < 0.02
    assert np.trace(followed[0].covariance[33:46, 33:46]) < np.trace(
        initial_body(BodyParams()).covariance[33:46, 33:46]
    )
    assert not np.array_equal(first.lengths, last.lengths)


def test_an_arm_out_of_sight_is_less_and_less_sure() -> None:
    seen = [surface_points(pose(), seed=k) for k in range(6)]
    hidden = [surface_points(pose(), seed=k, without=(6, 8)) for k in range(6, 14)]
    _, fits = follow(seen + hidden)
    spread = [float(np.trace(fit.place_covariance[7])) for fit in fits]
    assert spread[13] > spread[9] > 2 * spread[5]
    assert float(np.trace(fits[13].place_covariance[8])) < 0.5 * spread[13]  # the other wrist
    assert float(fits[13].unseen[8]) > 0.2
    assert bool(fits[13].tracked)


def test_a_lost_track_is_noticed_within_three_frames_and_begun_anew() -> None:
    here = [surface_points(pose(), seed=k) for k in range(6)]
    there = [surface_points(pose(y=0.2), seed=k) + np.array([0.9, 0.0, 0.0]) for k in range(6, 24)]
    _, fits = follow(here + there)
    ages = [float(fit.age) for fit in fits]
    assert any(age < ages[5] for age in ages[6:9])
    true = np.asarray(joints_of(person_of(pose(y=0.2)))[0]) + np.array([0.9, 0.0, 0.0])
    assert np.median(np.linalg.norm(np.asarray(fits[-1].joints) - true, axis=1)) < 0.05


def test_without_points_there_is_no_track() -> None:
    _, fits = follow([surface_points(pose(), seed=k) for k in range(3)] + [np.zeros((0, 3))] * 3)
    assert bool(fits[2].tracked)
    assert not bool(fits[5].tracked)


def test_landmarks_pull() -> None:
    seen = [surface_points(pose(), seed=k, without=(6, 8)) for k in range(6)]
    true = joints_of(person_of(pose()))[0]
    places = none_found().joints.at[7].set(true[7].astype(jnp.float32))
    found = Landmarks(places, jnp.full((11,), 1e4, jnp.float32))
    _, fits = follow(seen, found)
    assert np.linalg.norm(np.asarray(fits[-1].joints[7]) - np.asarray(true[7])) < 0.03


def test_told_deviations_of_speeds_are_those_of_the_errors() -> None:
    """Somebody stands, begins to come at up to 0.6 m/s, and stops; points are noisy."""
    share = np.clip((DT * np.arange(60) - 0.5) / 1.0, 0, 1)
    way = 0.3 * (share - np.sin(2 * np.pi * share) / (2 * np.pi))
    draw = np.random.default_rng(3)
    bodies = [pose(y=1.1 - s) for s in way]
    clouds = [surface_points(body, seed=k) for k, body in enumerate(bodies)]
    _, fits = follow([cloud + draw.normal(0, 0.008, cloud.shape) for cloud in clouds])
    true = np.stack([np.asarray(joints_of(person_of(body))[0]) for body in bodies])
    speeds = np.gradient(true, DT, axis=0)[12:-1]
    told = np.stack([np.asarray(fit.speeds) for fit in fits])[12:-1]
    deviation = np.sqrt(np.stack([np.diagonal(fit.speed_covariance, axis1=1, axis2=2) for fit in fits])[12:-1])
    z = np.abs(told - speeds) / deviation
    assert (z < 2).mean() > 0.9
    assert np.sqrt((z**2).mean()) > 0.3  # nor are they several times too large
    assert np.median(deviation) < 0.12


def test_other_bodies_are_fitted_over_frames_and_then_begun_anew() -> None:
    cloud = surface_points(pose(), seed=0)

    def off(state: BodyState) -> float:
        """How far the points are from the other bodies, by plain geometry."""
        parts = [part_capsules(joints, radii) for joints, _, radii in map(split, state.rivals)]
        return float(np.mean([np.abs(gaps(cloud, part).min(1)).mean() for part in parts]))

    params, state, offs, turns = BodyParams(), initial_body(BodyParams()), [], []
    for _ in range(params.rival_frames + 1):
        points = jnp.asarray(np.concatenate([cloud, np.zeros((320 - len(cloud), 3))]), jnp.float32)
        state, _ = program()(state, points, jnp.arange(320) < len(cloud), none_found())
        offs.append(off(state))
        turns.append(int(state.turn))
    assert turns == list(range(1, params.rival_frames + 2))
    assert offs[params.rival_frames - 1] < 0.8 * offs[0]
    assert offs[params.rival_frames] > offs[params.rival_frames - 1]
    assert [int(next_rivals(params, jnp.asarray(k))) for k in (0, 1, 2, 3, 4)] == [0, 3, 3, 3, 6]


def test_a_body_is_replaced_when_others_are_fitted_and_not_before(followed: tuple[BodyState, list[BodyFit]]) -> None:
    """The other bodies are where the person is, the track is half a metre beside: only in the last frame of three they are compared."""
    state, params = followed[0], BodyParams()
    cloud = surface_points(pose(), seed=20)
    points = jnp.asarray(np.concatenate([cloud, np.zeros((320 - len(cloud), 3))]), jnp.float32)
    right = joined(state.joints, state.lengths, state.radii)
    beside = state.joints + jnp.asarray([0.5, 0.0, 0.0], jnp.float32)
    for turn in range(params.rival_frames):
        wrong = eqx.tree_at(
            lambda s: (s.joints, s.rivals, s.turn),
            state,
            (beside, jnp.stack([right, right]), jnp.asarray(turn, jnp.int32)),
        )
        after, _ = program()(wrong, points, jnp.arange(320) < len(cloud), none_found())
        replaced = float(after.age) == 0
        assert replaced == (turn == params.rival_frames - 1)
        assert (float(jnp.max(jnp.abs(after.joints - state.joints))) < 0.05) == replaced


@pytest.mark.parametrize(
    "angle, dt, expected",
    [
        (0.21, 1 / 30, False), (0.26, 1 / 30, True), (-0.75, 0.1, True), (1.95, 0.3, False), (3.1, 3.0, False),
        (0.1, 0.0, False), (0.1, 0.002, False), (0.26, 0.002, True),  # noise of a fit is as large however near two images are
    ],
)  # fmt: skip
def test_a_body_that_turns_as_nobody_does_is_found(angle: float, dt: float, expected: bool) -> None:
    """Turned about the vertical by SciPy; after half a turn nobody can say how fast."""
    before = np.array(joints_of(person_of(pose()))[0], float)
    after = Rotation.from_euler("z", angle).apply(before)
    assert bool(spun(jnp.asarray(before, jnp.float32), jnp.asarray(after, jnp.float32), dt)) == expected


def test_a_track_whose_fit_turns_quickly_is_young_again(followed: tuple[BodyState, list[BodyFit]]) -> None:
    """The track is a tenth of a turn beside the points, which pull it back in one frame."""
    state = followed[0]
    cloud = surface_points(pose(), seed=20)
    points = jnp.asarray(np.concatenate([cloud, np.zeros((320 - len(cloud), 3))]), jnp.float32)
    for turn, young in ((0.0, False), (0.6, True)):
        turned = Rotation.from_euler("z", turn).as_matrix().astype(np.float32)
        middle = state.joints[0] * jnp.asarray([1.0, 1.0, 0.0], jnp.float32)
        loose = state.covariance + 0.3 * jnp.diag((jnp.arange(state.covariance.shape[0]) < PLACES).astype(jnp.float32))
        beside = eqx.tree_at(
            lambda s: (s.joints, s.covariance, s.turn),
            state,
            ((state.joints - middle) @ turned.T + middle, loose, jnp.asarray(0, jnp.int32)),  # no other body is taken
        )
        after, _ = program()(beside, points, jnp.arange(320) < len(cloud), none_found())
        assert (float(after.age) < 2 * DT) == young
