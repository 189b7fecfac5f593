"""Which coarse blocks are fitted anew after what happens below them."""

import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.map import MapLayout, MapParams
from hrcjax.map.coarse import Changed, update_coarse
from hrcjax.map.layout import REACH, VOXELS
from hrcjax.map.level import empty_level

LAYOUT = MapLayout(lower=(0.0, 0.0, 0.0), shape=(16, 4, 4), capacity=64)
HERE, BESIDE, FAR = (3, 1, 2), (4, 1, 2), (12, 1, 2)
"""Blocks of level 0: in the first coarse block, in the one beside it, and in one that is no neighbour."""


def changed(places, points) -> Changed:
    """Blocks of level 0 with one point each, or none."""
    rows = np.zeros((len(places), 4, VOXELS), np.float32)
    for row, point in zip(rows, points, strict=True):
        if point is not None:
            row[:, 0] = (*point, 1.0)
    return Changed(
        jnp.asarray(np.asarray(places) + REACH, jnp.int32),
        jnp.asarray(rows),
        jnp.zeros((len(places), VOXELS), jnp.float32),
        jnp.ones(len(places), bool),
    )


def middle(place) -> tuple[float, ...]:
    return tuple((k + 0.5) * LAYOUT.edge_of(0) for k in place)


@pytest.fixture(scope="module")
def known():
    """Three coarse blocks with a point each, all fitted."""
    capacity = LAYOUT.capacity_of(1)
    level, extent, stale, lost, _ = update_coarse(
        LAYOUT, 1, empty_level(LAYOUT, 1), jnp.zeros((capacity, VOXELS), jnp.float32), jnp.zeros(capacity, bool),
        changed((HERE, BESIDE, FAR), (middle(HERE), middle(BESIDE), middle(FAR))), MapParams(),
    )  # fmt: skip
    assert int(lost) == 0 and int(jnp.sum(stale)) == 3
    return level, extent


@pytest.mark.parametrize(
    ("place", "point", "expected"),
    [
        (HERE, (0.36, 0.14, 0.24), {0}),  # moved
        ((2, 1, 2), middle((2, 1, 2)), {0, 1}),  # came
        (BESIDE, None, {0}),  # went, and its block with it
        (HERE, None, {1}),
        (FAR, None, set()),
        (FAR, (1.21, 0.11, 0.21), {3}),
    ],
)
def test_neighbours_are_fitted_where_points_came_or_went(known, place, point, expected: set[int]) -> None:
    level, extent = known
    capacity = LAYOUT.capacity_of(1)
    after, _, stale, _, _ = update_coarse(
        LAYOUT, 1, level, extent, jnp.zeros(capacity, bool), changed((place,), (point,)), MapParams()
    )
    found = {int(after.place[k][0]) - REACH for k in np.flatnonzero(np.asarray(stale))}
    assert found == expected
