"""Laws of following people where no camera looks; the extent of hidden space against SciPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from overhead import EXACT, down, grid_of, middles
from scipy.ndimage import binary_dilation, generate_binary_structure

from hrcjax.presence.params import PresenceParams
from hrcjax.presence.sight import all_sights
from hrcjax.presence.track import (
    BODY,
    MOST_STEPS,
    Track,
    initial_track,
    live_cameras,
    survey_empty,
    union,
    update_track,
)
from hrcjax.presence.voxels import VoxelLayout
from hrcjax.sense.rig import stack_cameras

BOX = VoxelLayout((-1.0, -1.0, 0.0), (20, 20, 6), 0.1)
FLOOR = 3.15
"""Depth of the floor, 15 cm below the box, so that every voxel can be seen through [m]."""
CAMERAS = stack_cameras([down(48, 48, 48.0, 3.0)] * 2)
"""Two that see the same, all of the box: what one does not measure the other may."""
CROP = jnp.full(3, -9.0), jnp.full(3, 9.0)
PERIOD = 0.1
NOWHERE = jnp.full((48, 48), jnp.inf)
CORNERS = generate_binary_structure(3, 3)
EMPTY = survey_empty(BOX, EXACT, jnp.full((2, 48, 48), FLOOR), all_sights(BOX, CAMERAS))
_update = jax.jit(
    lambda track, camera, exposed, good, depth, period: update_track(
        BOX, EXACT, EMPTY, track, camera, CAMERAS, jnp.full(2, period), exposed, good, depth, NOWHERE, CROP
    )
)


def start(time: float = 0.0) -> Track:
    return initial_track(BOX, 2, jnp.asarray(time))


def look(track: Track, camera: int, exposed: float, depth: np.ndarray, good: bool = True, period: float = 1e6) -> Track:
    """After an image; by default cameras never count as missing."""
    return _update(track, jnp.asarray(camera), jnp.asarray(exposed), jnp.asarray(good), jnp.asarray(depth), period)


def floor() -> np.ndarray:
    return np.full((48, 48), FLOOR)


def pixels(x0: float, x1: float, y0: float, y1: float, depth: float) -> tuple[slice, slice]:
    """Pixels that look at a rectangle at a depth."""
    u = [int(np.clip(round(48 * x / depth + 23.5), 0, 48)) for x in (x0, x1)]
    v = [int(np.clip(round(-48 * y / depth + 23.5), 0, 48)) for y in (y1, y0)]
    return slice(v[0], v[1]), slice(u[0], u[1])


def somebody(x: float = 0.0, y: float = 0.0, half: float = 0.25) -> np.ndarray:
    """The floor with somebody on it, 0.5 m tall."""
    image = floor()
    image[pixels(x - half, x + half, y - half, y + half, 2.5)] = 2.5
    return image


def hole(x0: float, x1: float, y0: float, y1: float, image: np.ndarray | None = None) -> np.ndarray:
    """An image in which nothing is measured of a rectangle of the floor."""
    image = floor() if image is None else image.copy()
    image[pixels(x0, x1, y0, y1, FLOOR)] = 0.0
    return image


def seen_twice(x: float = 0.0, y: float = 0.0, half: float = 0.25) -> Track:
    """Somebody in the images at 0.1 and 0.2 s of both cameras."""
    track = start()
    for t in (0.1, 0.2):
        for camera in (0, 1):
            track = look(track, camera, t, somebody(x, y, half))
    return track


def hidden_of(track: Track) -> np.ndarray:
    return grid_of(BOX, EMPTY.watched) & ~grid_of(BOX, union(track.free))


def lost_of(track: Track) -> np.ndarray:
    return grid_of(BOX, track.lost)


def grown(known: np.ndarray, within: np.ndarray, steps: int) -> np.ndarray:
    """What spreads by voxels, over corners too, inside of a set."""
    return binary_dilation(known & within, CORNERS, iterations=steps, mask=within) if steps else known & within


# the empty cell -------------------------------------------------------------------------------------------------------


def test_all_of_the_box_is_watched() -> None:
    assert grid_of(BOX, EMPTY.watched).all()


def test_what_no_camera_has_a_settled_picture_of_is_not_watched() -> None:
    """A hole in the settled picture of the one, nothing known to the other."""
    settled = np.stack([hole(-0.5, 0.0, -0.4, 0.1), np.full((48, 48), 0.0)])
    known = survey_empty(BOX, EXACT, jnp.asarray(settled), all_sights(BOX, CAMERAS))
    unwatched = middles(BOX)[~grid_of(BOX, known.watched)]
    assert len(unwatched) > 50 and (unwatched[:, 0] < 0.15).all()


def test_watching_takes_twice_the_margin_of_noise() -> None:
    noisy = PresenceParams(pixel_noise=0.004)
    settled = jnp.full((2, 48, 48), FLOOR)
    watched = grid_of(BOX, survey_empty(BOX, noisy, settled, all_sights(BOX, CAMERAS)).watched)
    depth = 3.0 - middles(BOX)[..., 2]
    np.testing.assert_array_equal(watched, depth + 0.05 + 2 * 3 * 0.004 * depth**2 < FLOOR)
    assert 0 < watched.sum() < BOX.count


# a person in view -----------------------------------------------------------------------------------------------------


def test_an_empty_cell_stays_empty() -> None:
    track = start()
    for k in range(6):
        track = look(track, k % 2, 0.1 * (k + 1), floor(), period=PERIOD * 2)
        assert not lost_of(track).any() and not bool(track.unsure) and not bool(track.missing)
        assert not np.asarray(track.occupied).any()


def test_somebody_in_view_is_where_he_stands_and_nobody_is_lost() -> None:
    track = seen_twice(0.2, -0.1)
    occupied = grid_of(BOX, union(track.occupied))
    at = middles(BOX)[occupied]
    assert len(at) > 10
    assert np.abs(at[:, 0] - 0.2).max() <= 0.3 and np.abs(at[:, 1] + 0.1).max() <= 0.3
    assert np.abs(at[:, 2] - 0.5).max() <= 0.05 + 1e-9
    assert not lost_of(track).any() and not bool(track.unsure)
    np.testing.assert_array_equal(grid_of(BOX, union(track.sure)), occupied)


def test_one_image_makes_nobody_sure() -> None:
    """What only one image showed leaves nothing behind, as it was not beside somebody known."""
    track = look(start(), 0, 0.1, somebody())
    assert grid_of(BOX, union(track.occupied)).any() and not np.asarray(track.sure).any()
    track = look(track, 0, 0.2, hole(-0.8, 0.8, -0.8, 0.8))
    assert not lost_of(track).any() and not bool(track.unsure)


def test_who_is_seen_through_is_gone_at_once() -> None:
    track = seen_twice()
    for camera in (0, 1):
        track = look(track, camera, 0.3, floor())
    assert not np.asarray(track.occupied).any() and not lost_of(track).any() and not bool(track.unsure)


def test_behind_people_in_view_nothing_spreads() -> None:
    """Three seconds in one place: what they hide is a part of themselves."""
    track = seen_twice()
    for k in range(30):
        track = look(track, k % 2, 0.3 + 0.1 * k, somebody())
        assert not lost_of(track).any() and not bool(track.unsure)
    assert hidden_of(track).sum() > 100


# a person who is not measured -----------------------------------------------------------------------------------------

DARK = hole(-0.75, 0.75, -0.75, 0.75)
"""Nothing is measured of the middle of the cell."""


def test_who_is_not_measured_stays_and_spreads_through_hidden_space_at_the_assumed_speed() -> None:
    """To the voxel, until all hidden space that hangs together is full; never into what is seen free."""
    track = seen_twice()
    sure = grid_of(BOX, union(track.sure))
    for camera in (0, 1):
        track = look(track, camera, 0.2 + 1e-6 * (camera + 1), DARK)
    hidden = hidden_of(track)
    assert 0.3 < hidden.mean() < 0.8
    first = grown(grown(sure, np.ones_like(sure), BODY), hidden, 0)
    np.testing.assert_array_equal(lost_of(track), first)
    assert bool(track.unsure) and not np.asarray(track.occupied).any()
    sizes = []
    for t in np.arange(0.23, 1.5, 0.041):
        for camera in (0, 1):
            track = look(track, camera, t, DARK)
        steps = int(np.floor(float(EXACT.speed) * t / BOX.edge)) - int(np.floor(float(EXACT.speed) * 0.2 / BOX.edge))
        np.testing.assert_array_equal(lost_of(track), grown(first, hidden, steps))
        sizes.append(lost_of(track).sum())
        assert bool(track.unsure) and not (lost_of(track) & grid_of(BOX, union(track.free))).any()
    assert len(set(sizes)) > 3 and sizes[-1] == sizes[-2]


def test_a_new_image_frees_what_it_sees_through_and_no_more() -> None:
    track = seen_twice()
    for t in np.arange(0.3, 1.2, 0.05):
        for camera in (0, 1):
            track = look(track, camera, t, DARK)
    before = lost_of(track)
    half = hole(-0.75, 0.0, -0.75, 0.75)
    for camera in (0, 1):
        track = look(track, camera, 1.2, half)
    after = lost_of(track)
    np.testing.assert_array_equal(after, before & hidden_of(track))
    assert 0 < after.sum() < before.sum()
    for camera in (0, 1):
        track = look(track, camera, 1.25, floor())
    assert not lost_of(track).any() and not bool(track.unsure)


def test_what_one_camera_does_not_measure_and_the_other_sees_through_is_nobody() -> None:
    track = seen_twice()
    track = look(track, 0, 0.3, DARK)
    track = look(track, 1, 0.31, floor())
    assert not lost_of(track).any()
    track = look(track, 0, 0.4, DARK)
    assert not lost_of(track).any()


def test_what_one_camera_does_not_measure_is_still_shown_by_the_other() -> None:
    track = seen_twice()
    for k in range(10):
        track = look(track, 0, 0.3 + 0.1 * k, DARK)
        track = look(track, 1, 0.31 + 0.1 * k, somebody())
    assert grid_of(BOX, union(track.occupied)).any() and not lost_of(track).any() and not bool(track.unsure)


@pytest.mark.parametrize("every", [0.025, 0.06, 0.1, 0.18])
def test_growth_does_not_depend_on_the_rate_of_images(every: float) -> None:
    """The same hidden space after the same time: 0.9 s at up to three voxels an image."""
    track = seen_twice(-0.5, -0.5, half=0.15)
    sure = grid_of(BOX, union(track.sure))
    for camera in (0, 1):
        track = look(track, camera, 0.2, DARK)
    count = round(0.36 / every)
    for k in range(1, count + 1):
        track = look(track, k % 2, 0.2 + 0.36 * k / count + 1e-4, DARK)
    steps = int(np.floor(float(EXACT.speed) * 0.5601 / BOX.edge)) - int(np.floor(float(EXACT.speed) * 0.2 / BOX.edge))
    expected = grown(grown(sure, np.ones_like(sure), BODY), hidden_of(track), steps)
    assert steps == 5 and expected.sum() < hidden_of(track).sum()
    np.testing.assert_array_equal(lost_of(track), expected)


def test_one_image_grows_by_some_voxels_at_most() -> None:
    track = seen_twice(half=0.15)
    for camera in (0, 1):
        track = look(track, camera, 0.2, DARK)
    before = lost_of(track)
    after = look(track, 0, 9.2, DARK)
    np.testing.assert_array_equal(lost_of(after), grown(before, hidden_of(after), MOST_STEPS))


def test_who_is_lost_does_not_spread_behind_people_in_view() -> None:
    """One of two is no longer measured: hidden space beside the other is filled, what the other hides is not."""
    one = somebody(-0.5, 0.0, 0.2)
    both = np.minimum(one, somebody(0.4, 0.0, 0.2))
    track = start()
    for t in (0.1, 0.2):
        for camera in (0, 1):
            track = look(track, camera, t, both)
    dark = hole(-0.3, 0.95, -0.6, 0.6)
    dark = np.where(one < FLOOR, one, dark)
    for camera in (0, 1):
        track = look(track, camera, 0.21, dark)
    first = lost_of(track)
    for t in np.arange(0.25, 1.2, 0.05):
        for camera in (0, 1):
            track = look(track, camera, t, dark)
    shadow, last = grid_of(BOX, union(track.shadow)), lost_of(track)
    beside = binary_dilation(last & ~shadow, CORNERS) & shadow & hidden_of(track)
    assert last.sum() > 1.3 * first.sum() and (beside & ~first).any(), "it came up to what the other hides"
    assert not (last & shadow & ~first).any()


# pockets --------------------------------------------------------------------------------------------------------------


def darkened(half: float, visible: np.ndarray | None = None) -> Track:
    """After somebody was seen, a square in the middle is not measured for some images."""
    track = seen_twice()
    for t in (0.3, 0.35, 0.4):
        for camera in (0, 1):
            track = look(track, camera, t, hole(-half, half, -half, half, visible))
    return track


def test_a_pocket_too_small_for_a_trunk_holds_nobody() -> None:
    small, large = darkened(0.05), darkened(0.4)
    assert hidden_of(small).sum() > 0 and not lost_of(small).any() and not bool(small.unsure)
    assert lost_of(large).any() and bool(large.unsure)


def test_a_small_pocket_beside_somebody_in_view_may_hold_a_part_of_him() -> None:
    """A long body, of which one end is no longer measured: hidden space as narrow as an arm, but joined to the rest."""
    image = floor()
    image[pixels(-0.8, 0.8, -0.1, 0.1, 2.5)] = 2.5
    track = start()
    for t in (0.1, 0.2):
        for camera in (0, 1):
            track = look(track, camera, t, image)
    part = floor()
    part[pixels(-0.8, 0.0, -0.1, 0.1, 2.5)] = 2.5
    joined, apart = hole(-0.1, 0.95, -0.06, 0.06, part), hole(0.6, 0.95, -0.06, 0.06, part)
    end = {}
    for name, picture in (("joined", joined), ("apart", apart)):
        after = track
        for t in (0.25, 0.3):
            for camera in (0, 1):
                after = look(after, camera, t, picture)
        end[name] = after
    assert lost_of(end["joined"]).any() and bool(end["joined"].unsure)
    assert (middles(BOX)[lost_of(end["joined"])][:, 0] > 0.0).all()
    assert hidden_of(end["apart"]).sum() > 0
    assert (middles(BOX)[lost_of(end["apart"])][:, 0] < 0.2).all() and not bool(end["apart"].unsure)


# cameras that fail ----------------------------------------------------------------------------------------------------


def test_refused_images_change_nothing_but_time() -> None:
    track = seen_twice()
    after = look(track, 0, 0.25, DARK, good=False)
    for name in ("stamp", "sums", "occupied", "sure", "before", "shadow", "free", "lost", "missing", "unsure"):
        np.testing.assert_array_equal(getattr(after, name), getattr(track, name), err_msg=name)
    assert float(after.time) == 0.25
    # later images make the same of both
    direct, around = look(track, 1, 0.3, DARK), look(after, 1, 0.3, DARK)
    for one, two in zip(jax.tree.leaves(direct), jax.tree.leaves(around), strict=True):
        np.testing.assert_allclose(one, two, atol=1e-12)


def test_cameras_count_until_their_image_is_too_old() -> None:
    track = look(look(start(), 0, 0.1, floor()), 1, 0.15, floor())
    for now, expected in ((0.2, [True, True]), (0.259, [True, True]), (0.261, [False, True]), (0.32, [False, False])):
        live = live_cameras(EXACT, track, jnp.asarray(now), jnp.full(2, PERIOD))
        assert np.asarray(live).tolist() == expected


RIGHT = hole(0.05, 1.7, -1.7, 1.7)
LEFT = hole(-1.7, -0.05, -1.7, 1.7)
"""Images of one half of the cell."""


def test_a_missing_camera_is_known_and_makes_nobody() -> None:
    """Each camera watches one half; that of the right one fails, and comes back."""
    track = start()
    for t in (0.1, 0.2):
        track = look(look(track, 0, t, RIGHT, period=PERIOD), 1, t, LEFT, period=PERIOD)
        assert not lost_of(track).any() and not bool(track.missing)
    for t in 0.2 + 0.07 * np.arange(1, 10):
        track = look(track, 0, t, RIGHT, period=PERIOD)
        assert bool(track.missing) == (t - 0.2 >= 1.6 * PERIOD) and not lost_of(track).any()
    track = look(track, 1, t + 0.01, LEFT, period=PERIOD)
    assert not bool(track.missing) and not bool(track.unsure)


def test_somebody_whom_only_a_failed_camera_saw_stays() -> None:
    """In its half, where the other camera does not look."""
    track = start()
    visible = somebody(0.5, 0.0)
    visible[:, :24] = 0.0
    for t in (0.1, 0.2):
        track = look(look(track, 0, t, RIGHT, period=PERIOD), 1, t, visible, period=PERIOD)
    where = grid_of(BOX, union(track.sure))
    assert where.any()
    track = look(track, 0, 0.3, RIGHT, period=PERIOD)
    assert not lost_of(track).any(), "its last image still counts"
    track = look(track, 0, 0.4, RIGHT, period=PERIOD)
    assert bool(track.missing) and lost_of(track)[where].all() and bool(track.unsure)


def test_frozen_stamps_of_the_start_count_as_working() -> None:
    track = start(5.0)
    assert np.asarray(live_cameras(EXACT, track, jnp.asarray(5.1), jnp.full(2, PERIOD))).all()
    assert not bool(track.missing) and float(track.growth) == 0.0
