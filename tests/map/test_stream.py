"""Frames that must not be believed: each is named, shows nothing, and lets the data grow old."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.map import make_view
from hrcjax.map.stream import (
    AHEAD,
    BAD_POSE,
    EMPTY,
    LEAP,
    REPEATED,
    REVERSED,
    StreamParams,
    admit,
    describe_frame,
    initial_stream,
)
from hrcjax.sense import d435i


@pytest.fixture(scope="module")
def step():
    return jax.jit(lambda state, stamp, camera, view: admit(StreamParams(), state, stamp, camera, view))


def camera_at(x: float, aim: float = 0.0):
    return d435i(jnp.asarray([x, 0.0, 1.0], jnp.float32), jnp.asarray([x + aim, 0.5, 0.0], jnp.float32), 8)


def play(step, frames):
    """(stamp, camera, depth) one after the other -> reasons of each, times of the last believed frame, views."""
    state, reasons, stamps, views = initial_stream(), [], [], []
    for stamp, camera, depth in frames:
        view = make_view(camera, jnp.full((60, 80), depth, jnp.float32), 4e-3)
        state, view, why = step(state, jnp.asarray(stamp, jnp.float32), camera, view)
        reasons.append(int(why))
        stamps.append(float(state.stamp))
        views.append(view)
    return reasons, stamps, views


def test_a_camera_that_moves_on_is_believed(step) -> None:
    reasons, stamps, views = play(step, [(0.033 * k, camera_at(0.02 * k), 1.0) for k in range(5)])
    assert reasons == [0] * 5 and stamps == pytest.approx([0.033 * k for k in range(5)])
    assert all(view.mask.all() for view in views)


def test_stamps_that_do_not_go_on(step) -> None:
    still = camera_at(0.0)
    reasons, stamps, views = play(step, [(t, still, 1.0) for t in (1.0, 1.0, 0.5, 1.1)])
    assert reasons == [0, REPEATED, REVERSED, 0]
    assert stamps == pytest.approx([1.0, 1.0, 1.0, 1.1])
    assert not views[1].mask.any() and not views[2].depth.any()


def test_one_wild_stamp_does_not_stop_the_camera(step) -> None:
    still = camera_at(0.0)
    reasons, stamps, _ = play(step, [(t, still, 1.0) for t in (1.0, 1e6, 1.1, 1.2, 0.5, 0.6)])
    assert reasons == [0, AHEAD, REVERSED, 0, REVERSED, 0]
    assert stamps == pytest.approx([1.0, 1.0, 1.0, 1.2, 1.2, 0.6])


def test_a_camera_that_was_silent_is_believed_at_its_second_frame(step) -> None:
    still = camera_at(0.0)
    assert play(step, [(t, still, 1.0) for t in (0.0, 0.03, 60.0, 60.03)])[0] == [0, 0, AHEAD, 0]


@pytest.mark.parametrize("there", [camera_at(0.5), camera_at(0.0, aim=0.6)])
def test_a_leap_is_refused_once(step, there) -> None:
    here = camera_at(0.0)
    frames = [(0.0, here, 1.0), (0.03, there, 1.0), (0.06, there, 1.0), (0.09, here, 1.0), (0.12, here, 1.0)]
    assert play(step, frames)[0] == [0, LEAP, 0, LEAP, 0]


@pytest.mark.parametrize("depth", [0.0, np.nan, -1.0])
def test_an_image_without_depth(step, depth: float) -> None:
    reasons, stamps, _ = play(step, [(0.0, camera_at(0.0), 1.0), (0.03, camera_at(0.0), depth)])
    assert reasons == [0, EMPTY] and stamps[1] == 0.0


def test_what_is_not_a_number_is_refused_and_forgotten(step) -> None:
    here = camera_at(0.0)
    lost = dataclasses.replace(here, position=here.position.at[1].set(jnp.nan))
    frames = [(0.0, here, 1.0), (0.03, lost, 1.0), (np.nan, here, 1.0), (np.inf, here, 1.0), (0.06, here, 1.0)]
    reasons, stamps, views = play(step, frames)
    assert [r & BAD_POSE for r in reasons] == [0, BAD_POSE, BAD_POSE, BAD_POSE, 0]
    assert stamps[-1] == pytest.approx(0.06) and np.isfinite(stamps).all() and not views[1].mask.any()


def test_before_the_first_frame_the_data_are_infinitely_old() -> None:
    assert float(initial_stream().stamp) == -np.inf


def test_reasons_in_words() -> None:
    assert describe_frame(0) == "none"
    assert describe_frame(EMPTY | LEAP) == "too few pixels with depth; pose leapt"
