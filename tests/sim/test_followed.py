"""A body followed from image to image of a track of people: by the images' own times, and refused ones."""

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.body import BodyParams, joints_of
from hrcjax.body.state import sure_track
from hrcjax.numerics import unrolled_options
from hrcjax.presence import CELL_VOXELS
from hrcjax.presence.track import initial_track
from hrcjax.presence.voxels import pack_columns, voxel_of
from hrcjax.sense.rig import cell_rig
from hrcjax.sim.followed import follow_body, nobody_followed
from hrcjax.world import scene_named

sys.path.insert(0, str(Path(__file__).parents[1] / "body"))
from standing import person_of, pose, surface_points

WALK = 0.3
"""Speed at which the person comes [m/s]."""
SURE = BodyParams(sure_age=0.3)
"""Of a track that may be sure within the images below."""


def shown(points: np.ndarray, camera: int):
    """A track in which one of two cameras shows these points."""
    track = initial_track(CELL_VOXELS, 2, jnp.zeros((), jnp.float32))
    sums = np.zeros((CELL_VOXELS.count + 1, 4), np.float32)
    np.add.at(sums, np.asarray(voxel_of(CELL_VOXELS, jnp.asarray(points))), np.c_[np.ones(len(points)), points])
    here = pack_columns(CELL_VOXELS, jnp.asarray(sums[:-1, 0] > 0))
    return replace(track, sums=track.sums.at[camera].set(sums[:-1]), occupied=track.occupied.at[camera].set(here))


@pytest.fixture(scope="module")
def followed():
    """The body after every image of somebody who walks towards the arm; the cameras take turns, the last image is refused."""
    rig, params = cell_rig(scene_named("robotica", 0)), BodyParams()
    program = jax.jit(partial(follow_body, params, CELL_VOXELS, rig), compiler_options=unrolled_options())
    state, found = nobody_followed(params, jnp.zeros((), jnp.float32)), []
    assert not bool(state.fit.tracked) and not bool(sure_track(params, state.fit))
    times = np.concatenate([np.arange(1, 26) / 30, [25 / 30 + 1 / 15, 25 / 30 + 2 / 15]])
    for k, t in enumerate(times):
        points = surface_points(pose(y=1.1 - WALK * t), count=700, seed=k)
        track = shown(points, k % 2)
        state = program(track, state, jnp.asarray(k % 2), jnp.asarray(t, jnp.float32), jnp.asarray(k < 26))
        found.append(state)
    return times, found


def test_the_body_is_that_of_the_images(followed) -> None:
    times, found = followed
    fit = found[25].fit
    assert bool(fit.tracked) and bool(sure_track(SURE, fit))
    true = np.asarray(joints_of(person_of(pose(y=1.1 - WALK * times[25])))[0])
    off = np.linalg.norm(np.asarray(fit.joints) - true, axis=1)
    assert np.median(off) < 0.02
    # both arms: of the first body the left upper arm lies where the whole arm is, and hardly a point is left over
    assert off[3:].max() < 0.05
    np.testing.assert_allclose(
        np.asarray(fit.speeds)[:3, 1].mean(), -WALK, atol=0.08
    )  # by unequal times between images


def test_time_goes_on_by_the_images(followed) -> None:
    times, found = followed
    for k in (24, 25, 26):
        np.testing.assert_allclose(found[k].time, times[k], rtol=1e-6)
    np.testing.assert_allclose(found[25].fit.age - found[24].fit.age, 1 / 15, atol=1e-5)


def test_a_refused_image_explains_nothing(followed) -> None:
    """The same points would have: they do not count, and the track is not sure."""
    fit = followed[1][26].fit
    assert float(fit.explained) == 0 and not bool(sure_track(SURE, fit))
