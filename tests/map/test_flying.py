"""Pixels that hang between front and back: 5 cm from their neighbours at 1 m and nearer, farther in proportion."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.map import MapParams
from hrcjax.map.take import surface_view
from hrcjax.sense import d435i
from hrcjax.sense.points import supported

ROW, COLUMN = 30, 40
"""A tile in the middle of the image."""


@pytest.fixture(scope="module")
def view():
    """(image, pixels along a tile's edge) -> view."""
    camera = d435i(jnp.zeros(3, jnp.float32), jnp.asarray([0.0, 0.0, 1.0], jnp.float32), 4)
    program = jax.jit(lambda depth, tile: surface_view(MapParams(), camera, depth, tile), static_argnums=1)
    return lambda depth, tile=2: program(jnp.asarray(depth, jnp.float32), tile)


def wall(at: float, off: float) -> np.ndarray:
    """An even wall, and one pixel before it that is the first of its tile to be asked."""
    depth = np.full((120, 160), at)
    depth[2 * ROW, 2 * COLUMN] -= off
    return depth


@pytest.mark.parametrize(("at", "gap"), [(0.6, 0.05), (1.0, 0.05), (2.0, 0.1), (3.0, 0.15)])
def test_a_pixel_flies_beyond_the_gap_alone(view, at: float, gap: float) -> None:
    """Where it flies the rest of its tile is the surface; where it does not, the tile has none that it agrees on."""
    for off, flies in ((0.9 * gap, False), (1.1 * gap, True)):
        got = view(wall(at, off))
        rows, columns = got.depth.shape
        mask, points = np.asarray(got.mask).reshape(rows, columns), np.asarray(got.points).reshape(rows, columns, 3)
        assert bool(mask[ROW, COLUMN]) == flies
        if flies:
            assert points[ROW, COLUMN, 2] == pytest.approx(at, rel=1e-5), "it does not count into the tile's mean"
        assert float(got.depth[ROW, COLUMN]) == pytest.approx(at - off, rel=1e-5), (
            "but nothing is seen through behind it"
        )


def test_large_tiles_need_no_such_test(view) -> None:
    """Among sixteen pixels a flying one that is asked first costs the tile, here as beyond the gap."""
    for off in (0.045, 0.055):
        depth = np.full((120, 160), 0.6)
        depth[4 * 15 + 1, 4 * 20 + 1] -= off
        got = view(depth, 4)
        assert not np.asarray(got.mask).reshape(got.depth.shape)[15, 20]
        assert np.asarray(got.mask).reshape(got.depth.shape)[14, 20]


def test_two_neighbours_within_the_gap_support_a_pixel() -> None:
    depth = np.full((7, 7), 1.0)
    depth[3, 3] = 1.05  # within the gap of all four
    depth[3, 2] = depth[3, 4] = 1.2  # two of them go
    for gap, expected in ((0.0501, True), (0.0499, False)):
        assert bool(supported(jnp.asarray(depth), gap)[3, 3]) == expected
    depth[2, 3] = 1.2  # and a third
    assert not bool(supported(jnp.asarray(depth), 0.0501)[3, 3]) and bool(
        supported(jnp.asarray(depth), 0.0501, 1.0)[3, 3]
    )
    assert bool(supported(jnp.asarray(depth))[0, 0]), "two of a corner's two neighbours"
    depth[0, 1] = np.nan
    assert not bool(supported(jnp.asarray(depth))[0, 0]) and not bool(supported(jnp.asarray(depth))[0, 1])
