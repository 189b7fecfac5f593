"""Sets of voxels as bits, against NumPy and SciPy on arrays of booleans."""

import jax.numpy as jnp
import numpy as np
import pytest
from overhead import grid_of, middles, packed
from scipy.ndimage import binary_dilation, binary_erosion, generate_binary_structure

from hrcjax.presence.voxels import (
    VoxelLayout,
    all_voxels,
    beside,
    centres,
    count_voxels,
    grow,
    inside_box,
    pack_columns,
    unpack_columns,
    voxel_of,
    within,
)

LOW = VoxelLayout((-0.2, 0.1, 0.3), (8, 6, 4), 0.05)
TOP = VoxelLayout((0.0, 0.0, 0.0), (4, 6, 32), 0.1)
CORNERS, FACES = generate_binary_structure(3, 3), generate_binary_structure(3, 1)


def sets(layout: VoxelLayout) -> list[np.ndarray]:
    """Single voxels at corners, in the middle and at the top, sparse and dense random sets, nothing, everything."""
    random = np.random.default_rng(0)
    found = [random.random(layout.shape) < share for share in (0.0, 0.01, 0.1, 0.5, 0.95, 1.0)]
    for place in (
        (0, 0, 0),
        tuple(n - 1 for n in layout.shape),
        tuple(n // 2 for n in layout.shape),
        (0, 2, layout.shape[2] - 1),
    ):
        found.append(np.zeros(layout.shape, bool))
        found[-1][place] = True
    return found


@pytest.mark.parametrize("layout", [LOW, TOP])
def test_sets_are_what_they_are_as_arrays(layout: VoxelLayout) -> None:
    for grid in sets(layout):
        columns = packed(layout, grid)
        assert columns.dtype == jnp.uint32 and columns.shape == layout.shape[:2]
        expected = np.sum(grid.astype(np.uint64) << np.arange(layout.shape[2], dtype=np.uint64), axis=2)
        np.testing.assert_array_equal(columns, expected)
        np.testing.assert_array_equal(grid_of(layout, columns), grid)
        assert int(count_voxels(columns)) == grid.sum()
    assert grid_of(layout, all_voxels(layout)).all() and int(count_voxels(all_voxels(layout))) == layout.count


@pytest.mark.parametrize("layout", [LOW, TOP])
def test_growing_and_shrinking_are_those_of_scipy(layout: VoxelLayout) -> None:
    for grid in sets(layout):
        columns = packed(layout, grid)
        for steps in (0, 1, 2, 5):
            expected = binary_dilation(grid, CORNERS, iterations=steps) if steps else grid
            np.testing.assert_array_equal(grid_of(layout, grow(layout, columns, steps)), expected)
        np.testing.assert_array_equal(grid_of(layout, beside(layout, columns)), binary_dilation(grid, FACES))
        expected = binary_erosion(grid, FACES, border_value=True)
        np.testing.assert_array_equal(grid_of(layout, within(layout, columns)), expected)


@pytest.mark.parametrize("layout", [LOW, TOP])
def test_no_bit_lies_above_the_box(layout: VoxelLayout) -> None:
    """Else it would come back as the set shrinks or moves down."""
    for columns in (
        grow(layout, all_voxels(layout)),
        beside(layout, all_voxels(layout)),
        within(layout, all_voxels(layout)),
    ):
        np.testing.assert_array_equal(columns, all_voxels(layout))


def test_every_point_is_in_the_voxel_about_it(dtype) -> None:
    x = centres(LOW, dtype)
    assert x.dtype == dtype
    np.testing.assert_allclose(np.asarray(x).reshape(*LOW.shape, 3), middles(LOW), atol=1e-6)
    for shift in (0.0, 0.4, -0.4):
        index = voxel_of(LOW, x + jnp.asarray(shift * LOW.edge, dtype))
        np.testing.assert_array_equal(index, np.arange(LOW.count))
    for axis in range(3):
        for place in (LOW.lower[axis] - 1e-4, LOW.lower[axis] + LOW.shape[axis] * LOW.edge + 1e-4):
            outside = np.asarray(LOW.lower) + 0.12
            outside[axis] = place
            assert int(voxel_of(LOW, jnp.asarray(outside, dtype))) == LOW.count
    far = jnp.asarray([[1e9, 0, 0], [-1e9, 0, 0], [np.nan, 0, 0], [np.inf, 0.2, 0.4]], dtype)
    assert np.asarray(voxel_of(LOW, far)).tolist() == [LOW.count] * 4


def test_inside_a_box_are_middles_between_its_corners() -> None:
    box = jnp.asarray([-0.11, 0.2, 0.36]), jnp.asarray([0.06, 0.9, 0.42])
    x = middles(LOW)
    expected = np.all((x > np.asarray(box[0])) & (x < np.asarray(box[1])), axis=-1)
    assert 0 < expected.sum() < LOW.count
    np.testing.assert_array_equal(np.asarray(inside_box(LOW, box)).reshape(LOW.shape), expected)


def test_index_of_a_set_is_that_of_a_point() -> None:
    index = int(voxel_of(TOP, jnp.asarray([0.25, 0.35, 3.15])))
    one = unpack_columns(TOP, pack_columns(TOP, jnp.arange(TOP.count) == index))
    assert np.flatnonzero(one).tolist() == [index]
    assert np.argwhere(np.asarray(one).reshape(TOP.shape)).tolist() == [[2, 3, 31]]


@pytest.mark.parametrize("shape", [(8, 8, 34), (8, 8, 2), (3, 8, 8), (8, 7, 8), (8, 8, 5)])
def test_boxes_that_bits_cannot_hold_are_refused(shape: tuple[int, int, int]) -> None:
    with pytest.raises(ValueError, match="even numbers of at least 4 voxels"):
        VoxelLayout((0.0, 0.0, 0.0), shape, 0.1)
