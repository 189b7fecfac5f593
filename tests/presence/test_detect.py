"""People in one image: pixels that support each other, in voxels."""

import jax
import jax.numpy as jnp
import numpy as np
from overhead import EXACT, down, grid_of, packed

from hrcjax.presence.detect import find_people
from hrcjax.presence.voxels import VoxelLayout

BOX = VoxelLayout((-0.4, -0.4, 0.0), (8, 8, 8), 0.1)
EYE = down(32, 24, 32.0, 2.05)
"""At a depth of 1.6 m a pixel is 5 cm."""
FLOOR = np.full((24, 32), 2.05)
NOWHERE = jnp.full((24, 32), jnp.inf)
CROP = jnp.asarray([-0.4, -0.4, 0.02]), jnp.asarray([0.4, 0.4, 0.75])
_find = jax.jit(
    lambda depth, before, box, robot: find_people(BOX, EXACT, EYE, depth, jnp.asarray(FLOOR), robot, box, before)
)


def find(depth, before=None, box=CROP, robot=NOWHERE):
    before = np.zeros(BOX.shape, bool) if before is None else before
    return _find(jnp.asarray(depth), packed(BOX, before), box, robot)


def points(depth, rows, columns) -> np.ndarray:
    """Where pixels look, on paper."""
    return np.stack([(columns - 15.5) / 32 * depth, -(rows - 11.5) / 32 * depth, 2.05 - depth], axis=-1)


def voxel(point) -> tuple[int, ...]:
    return tuple(np.floor((np.asarray(point) - [-0.4, -0.4, 0.0]) / 0.1).astype(int))


def block(size: int, depth: float = 1.6, row: int = 10, column: int = 14) -> np.ndarray:
    """A thing of size x size pixels above the floor."""
    image = FLOOR.copy()
    image[row : row + size, column : column + size] = depth
    return image


def test_nobody_is_found_on_the_empty_floor() -> None:
    found = find(FLOOR)
    assert (
        not grid_of(BOX, found.occupied).any()
        and not np.asarray(found.sums).any()
        and not np.asarray(found.shown).any()
    )


def test_sums_are_of_the_points_in_each_voxel() -> None:
    depth = block(4)
    depth[10:14, 14:18] += 0.01 * np.arange(4)  # a slope
    found = find(depth)
    rows, columns = (a.ravel() for a in np.mgrid[10:14, 14:18])
    at = points(depth[rows, columns], rows, columns)
    expected = np.zeros((*BOX.shape, 4))
    for point in at:
        expected[voxel(point)] += [1.0, *point]
    np.testing.assert_allclose(np.asarray(found.sums).reshape(expected.shape), expected, atol=1e-9)
    shown = np.zeros_like(depth)
    shown[10:14, 14:18] = depth[10:14, 14:18]
    np.testing.assert_array_equal(found.shown, shown)
    np.testing.assert_array_equal(grid_of(BOX, found.occupied), expected[..., 0] >= 3)
    assert (expected[..., 0] >= 3).sum() >= 1


def test_flying_pixels_make_no_voxel() -> None:
    """A flying pixel and a pair: one neighbour is not enough. Nor are neighbours at other depths."""
    for rows, columns in ((slice(5, 6), slice(6, 7)), (slice(5, 6), slice(6, 8)), (slice(5, 7), slice(6, 7))):
        image = FLOOR.copy()
        image[rows, columns] = 1.6
        assert not np.asarray(find(image).shown).any()
    steps = FLOOR.copy()
    steps[3:8, 4:9] = 1.0 + 0.12 * np.arange(25).reshape(5, 5) % 0.7  # neighbours that are not of one surface
    assert not grid_of(BOX, find(steps).occupied).any()


def test_a_neighbour_supports_within_a_gap_that_grows_with_depth() -> None:
    """5 cm up to 1 m away, 8 cm at 1.6 m."""
    for gap, kept in ((0.07, True), (0.09, False)):
        image = block(2)
        image[10, 14] += gap  # one of four: its three neighbours are this far from it
        assert (np.asarray(find(image).shown) > 0).sum() == (4 if kept else 3)


def test_two_pixels_make_a_voxel_and_fewer_only_beside_where_somebody_was() -> None:
    image = block(2, row=11, column=15)  # a pixel in each of four voxels
    rows, columns = (a.ravel() for a in np.mgrid[11:13, 15:17])
    holders = {voxel(p) for p in points(np.full(4, 1.6), rows, columns)}
    assert len(holders) == 4 and not grid_of(BOX, find(image).occupied).any()
    for one in holders:
        for away, there in (([0, 0, -1], True), ([0, 0, -2], False)):
            before = np.zeros(BOX.shape, bool)
            before[tuple(np.add(one, away))] = True
            occupied = grid_of(BOX, find(image, before).occupied)
            assert bool(occupied[one]) == there
    whole = block(2)  # four pixels in one voxel
    assert np.argwhere(grid_of(BOX, find(whole).occupied)).tolist() == [list(voxel((-0.05, 0.05, 0.45)))]
    bent = whole.copy()
    bent[10, 14] = bent[11, 15] = bent[11, 14] = 1.67  # three of them in the voxel below
    upper = voxel((-0.05, 0.05, 0.45))
    assert not grid_of(BOX, find(bent).occupied)[upper]
    bent[11, 15] = 1.6
    assert grid_of(BOX, find(bent).occupied)[upper]


def test_where_somebody_was_and_nothing_is_shown_nobody_is_found() -> None:
    assert not grid_of(BOX, find(FLOOR, np.ones(BOX.shape, bool)).occupied).any()


def test_outside_of_the_crop_box_nothing_counts_but_is_shown() -> None:
    small = jnp.asarray([-0.4, -0.4, 0.5]), jnp.asarray([0.4, 0.4, 0.75])
    found = find(block(4), box=small)  # at a height of 0.45
    assert not np.asarray(found.sums).any() and (np.asarray(found.shown) > 0).sum() == 16
    beside = FLOOR.copy()
    beside[4:8, 4:7] = 1.6  # 0.5 m beside the middle: outside of the voxels
    assert not np.asarray(find(beside, box=(jnp.full(3, -9.0), jnp.full(3, 9.0))).sums).any()


def test_the_robot_is_nobody() -> None:
    robot = NOWHERE.at[10:14, 14:18].set(1.6)
    assert not np.asarray(find(block(4), robot=robot).sums).any()
