"""The settled picture of the empty cell, and what stands out from it."""

import jax.numpy as jnp
import numpy as np

from hrcjax.presence.background import (
    foreground,
    initial_background,
    learn_background,
    settled_depth,
    shows_robot,
)
from hrcjax.presence.params import PresenceParams

PARAMS = PresenceParams(margin=0.02, deviations=3.0, robot_margin=0.03, pixel_noise=0.001)
"""At a depth of 2 m three deviations are 12 mm."""
SHAPE = (12, 16)
NOWHERE = jnp.full(SHAPE, jnp.inf)


def robot_at(rows: slice, columns: slice, depth: float):
    return NOWHERE.at[rows, columns].set(depth)


def learnt(images, robots):
    known = initial_background(1, *SHAPE, jnp.float64)
    known = type(known)(known.total[0], known.count[0], known.shown[0])
    for image, robot in zip(images, robots, strict=True):
        known = learn_background(PARAMS, known, jnp.asarray(image), robot)
    return known


def about(rows: slice, columns: slice) -> np.ndarray:
    """These pixels and those beside them."""
    found = np.zeros(SHAPE, bool)
    found[max(rows.start - 1, 0) : rows.stop + 1, max(columns.start - 1, 0) : columns.stop + 1] = True
    return found


def seen(depth, settled, robot=NOWHERE) -> np.ndarray:
    return np.asarray(foreground(PARAMS, jnp.asarray(depth), jnp.asarray(settled), robot))


def test_the_settled_depth_is_the_mean_of_what_was_measured() -> None:
    random = np.random.default_rng(0)
    images = 2.0 + 0.01 * random.normal(size=(8, *SHAPE))
    images[:3, 4, 5] = 0.0  # holes of some images
    images[:, 7, 7] = 0.0
    known = learnt(images, [NOWHERE] * 8)
    measured = np.where(images > 0, images, np.nan)
    expected = np.full(SHAPE, 0.0)
    there = ~np.isnan(measured).all(axis=0)
    expected[there] = np.nanmean(measured[:, there], axis=0)
    np.testing.assert_allclose(settled_depth(known), expected, rtol=1e-12)
    assert float(known.count[4, 5]) == 5 and float(settled_depth(known)[7, 7]) == 0.0


def test_pixels_of_the_robot_and_beside_it_are_not_learnt() -> None:
    rows, columns = slice(3, 6), slice(4, 9)
    robot = robot_at(rows, columns, 1.0)
    shows = np.where(np.isfinite(robot), 1.0, 2.0)
    always = settled_depth(learnt([shows] * 5, [robot] * 5))
    np.testing.assert_array_equal(np.asarray(always) == 0, about(rows, columns))
    np.testing.assert_array_equal(np.asarray(always)[~about(rows, columns)], 2.0)
    # once it has moved away the scene behind it is learnt, from three images on
    for clear, known in ((2, False), (3, True)):
        both = settled_depth(learnt([shows] * 5 + [np.full(SHAPE, 2.0)] * clear, [robot] * 5 + [NOWHERE] * clear))
        assert (np.asarray(both)[about(rows, columns)] == (2.0 if known else 0.0)).all()


def test_what_is_rarely_measured_is_not_known() -> None:
    """One image in four is enough, less is not; images in which the robot was in the way don't count."""
    for measured, images, known in ((3, 12, True), (3, 13, False), (2, 4, False), (10, 40, True)):
        pictures = np.zeros((images, *SHAPE))
        pictures[:measured] = 1.5
        assert (np.asarray(settled_depth(learnt(pictures, [NOWHERE] * images))) == (1.5 if known else 0.0)).all()
    everywhere = robot_at(slice(0, 12), slice(0, 16), 1.0)
    pictures = [np.full(SHAPE, 1.5)] * 3 + [np.full(SHAPE, 1.0)] * 40
    assert (np.asarray(settled_depth(learnt(pictures, [NOWHERE] * 3 + [everywhere] * 40))) == 1.5).all()


def test_a_thing_in_front_is_foreground_from_margin_and_noise_on() -> None:
    """Two centimetres and 12 mm before a wall at 2 m; it does not matter what is beside the thing."""
    settled = np.full(SHAPE, 2.0)
    for before, expected in ((0.0, False), (0.02, False), (0.031, False), (0.033, True), (0.05, True), (1.5, True)):
        depth = settled.copy()
        depth[4:7, 5:9] -= before
        thing = np.zeros(SHAPE, bool)
        thing[4:7, 5:9] = expected
        np.testing.assert_array_equal(seen(depth, settled), thing)
    assert not seen(settled + 0.5, settled).any(), "something that stood there is gone"


def test_a_flying_pixel_at_an_edge_is_not_foreground() -> None:
    """Between a column at 1.2 m and the wall at 2 m behind it, on either side of the edge."""
    settled = np.full(SHAPE, 2.0)
    settled[:, 6:10] = 1.2
    for column in (5, 6, 9, 10):
        for depth in (1.2, 1.4, 1.7, 2.0):
            image = settled.copy()
            image[:, column] = depth
            assert not seen(image, settled).any()
    image = settled.copy()
    image[5, 5] = 1.1  # before the column's front
    assert np.argwhere(seen(image, settled)).tolist() == [[5, 5]]
    image[5, 5], image[5, 3] = 2.0, 1.3  # off the edge
    assert np.argwhere(seen(image, settled)).tolist() == [[5, 3]]


def test_without_measurement_or_without_background_nothing_is_foreground() -> None:
    settled = np.full(SHAPE, 2.0)
    settled[3:6, 3:6] = 0.0
    image = np.full(SHAPE, 1.0)
    image[8, 8] = 0.0
    expected = settled > 0
    expected[8, 8] = False
    np.testing.assert_array_equal(seen(image, settled), expected)
    assert not seen(np.full(SHAPE, 1.99), settled).any(), "beside what is unknown the same margin"


def test_the_robot_is_not_foreground_and_what_is_before_it_is() -> None:
    """Over 3 cm and the noise of the measured depth, 3 mm at 1 m, before the nearest of the robot about the pixel."""
    settled = np.full(SHAPE, 2.0)
    rows, columns = slice(2, 9), slice(4, 12)
    robot = robot_at(rows, columns, 1.0)
    image = np.where(np.isfinite(robot), 1.0, settled)
    assert not seen(image, settled, robot).any()
    flying = image.copy()
    flying[2:9, 3] = 1.5  # beside its edge, between robot and wall
    flying[2:9, 4] = 1.6
    assert not seen(flying, settled, robot).any()
    flying[2:9, 2] = 1.5  # two pixels beside it
    assert np.unique(np.argwhere(seen(flying, settled, robot))[:, 1]).tolist() == [2]
    for before, expected in ((0.02, False), (0.0325, False), (0.0335, True), (0.3, True)):
        hand = image.copy()
        hand[4:6, 6:8] -= before
        assert seen(hand, settled, robot).sum() == (4 if expected else 0)
        assert (~np.asarray(shows_robot(PARAMS, jnp.asarray(hand), robot))).sum() == SHAPE[0] * SHAPE[1] - about(
            rows, columns
        ).sum() + (4 if expected else 0)


def test_a_robot_before_an_unknown_background_hides_and_shows_nothing() -> None:
    settled = np.full(SHAPE, 0.0)
    robot = robot_at(slice(2, 9), slice(4, 12), 1.0)
    assert not seen(np.full(SHAPE, 0.5), settled, robot).any()


def test_several_cameras_settle_side_by_side() -> None:
    known = initial_background(2, *SHAPE, jnp.float32)
    assert known.total.shape == (2, *SHAPE) and known.total.dtype == jnp.float32
    assert not np.asarray(settled_depth(known)).any()
