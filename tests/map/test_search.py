"""The search for blocks against distances to all points, in a grid of odd sizes, as blocks come and go."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.map import MapLayout
from hrcjax.map.blocks import bounding_boxes, claim, store, voxel_of
from hrcjax.map.index import NO_BOX, boxes_by_place, sides
from hrcjax.map.layout import REACH, VOXELS
from hrcjax.map.level import Level, empty_level, padded_place
from hrcjax.map.search import nearest_blocks

LAYOUT = MapLayout(lower=(-0.7, -0.4, 0.1), shape=(13, 9, 7), capacity=256)
CORNER = np.asarray(LAYOUT.lower)
SIZE = np.asarray(LAYOUT.shape) * LAYOUT.edge_of(0)
GRAIN = LAYOUT.edge_of(0) / 32


def surface(seed: int) -> np.ndarray:
    """A waved sheet through the box, and a few points anywhere."""
    random = np.random.default_rng(seed)
    flat = random.uniform(0, 1, (1500, 2))
    height = 0.5 + 0.2 * np.sin(5 * flat[:, 0]) * np.cos(4 * flat[:, 1])
    sheet = np.concatenate([flat, height[:, None]], axis=1)
    return (CORNER + SIZE * np.concatenate([sheet, random.uniform(0.001, 0.999, (12, 3))])).astype(np.float32)


def stored(level: Level, slots: jax.Array, rows: jax.Array) -> Level:
    place = level.place.at[slots].get(mode="fill", fill_value=0)
    return store(level, slots.astype(jnp.int32), rows, bounding_boxes(LAYOUT, 0, place, rows))


def with_points(level: Level, points: np.ndarray) -> Level:
    """The level with a point in each voxel that one of these is in, and nothing else in their blocks."""
    x = jnp.asarray(points)
    level, slot, lost = claim(level, padded_place(LAYOUT, 0, x), jnp.ones(len(x), bool), LAYOUT.capacity)
    assert int(lost) == 0
    rows = (
        jnp.zeros((LAYOUT.capacity, 4, VOXELS), jnp.float32)
        .at[slot, :, voxel_of(LAYOUT, 0, x)]
        .set(jnp.concatenate([x, jnp.ones((len(x), 1), jnp.float32)], axis=1))
    )
    used = jnp.where(jnp.any(rows[:, 3] > 0, axis=1), jnp.arange(LAYOUT.capacity), LAYOUT.capacity)
    return stored(level, used, rows)


@pytest.fixture(scope="module")
def changed() -> Level:
    """A level in which a third of the blocks were emptied, and some of these filled anew."""
    level = with_points(empty_level(LAYOUT, 0), surface(0))
    gone = jnp.where(jnp.arange(LAYOUT.capacity) % 3 == 0, jnp.arange(LAYOUT.capacity), LAYOUT.capacity)
    level = stored(level, gone, jnp.zeros((LAYOUT.capacity, 4, VOXELS), jnp.float32))
    return with_points(level, surface(1)[:40])


@pytest.fixture(scope="module")
def scattered() -> Level:
    """Lone points: an octet holds one or two blocks, so that octets run out before blocks do."""
    random = np.random.default_rng(3)
    return with_points(
        empty_level(LAYOUT, 0), (CORNER + SIZE * random.uniform(0.001, 0.999, (150, 3))).astype(np.float32)
    )


def blocks_of(level: Level) -> dict[int, np.ndarray]:
    """Slot -> points of it."""
    rows = np.asarray(level.rows)
    return {s: rows[s, :3, rows[s, 3] > 0] for s in range(len(rows)) if (rows[s, 3] > 0).any()}


def gap(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> float:
    """From a box to the box about points [m]."""
    apart = np.maximum(np.maximum(points.min(axis=0) - high, low - points.max(axis=0)), 0)
    return float(np.linalg.norm(apart))


@pytest.mark.parametrize(("span", "count", "width"), [(1, 16, 0.0), (4, 64, 0.17), (4, 24, 0.3)])
@pytest.mark.parametrize("scene", ["changed", "scattered"])
def test_nothing_nearer_than_the_gap_is_left_out(request, scene: str, span: int, count: int, width: float) -> None:
    level = request.getfixturevalue(scene)
    blocks, place = blocks_of(level), np.asarray(level.place)
    find = jax.jit(lambda low, high: nearest_blocks(LAYOUT, 0, level, low, high, count, span))
    random = np.random.default_rng(2)
    within = missing = 0
    for _ in range(60):
        low = (CORNER + random.uniform(-0.1, 1.1, 3) * SIZE).astype(np.float32)
        high = low + np.float32(width) * random.uniform(0, 1, 3).astype(np.float32)
        slots, left = find(jnp.asarray(low), jnp.asarray(high))
        found = set(np.asarray(slots).tolist()) - {LAYOUT.capacity}
        assert found <= set(blocks)
        first, last = (np.asarray(padded_place(LAYOUT, 0, jnp.asarray(v))) for v in (low, high))
        near = [s for s in blocks if ((place[s] >= first - REACH) & (place[s] <= last + REACH)).all()]
        gaps = {s: gap(blocks[s], low, high) for s in near}
        left = float(left)
        assert all(gaps[s] ** 2 >= left - 1e-6 for s in near if s not in found)
        # and the gap is that of the last one, but for the grain of boxes, and the octets' twice as coarse
        if np.isfinite(left):
            order = sorted(gaps.values())
            assert np.sqrt(left) > order[min(count // 2, len(order) - 1)] - 4 * GRAIN
            missing += 1
        within += len(near) > 0
    assert within > 40 and (missing > 10 or count == 64)


def test_hulls_are_about_the_boxes_of_their_octets(changed) -> None:
    """A hull holds its boxes, and is a 32nd of the octet larger at most; an octet without points has none."""
    boxes, found = (np.asarray(v) for v in boxes_by_place(changed.index, changed.slot.shape))
    hull, some = np.asarray(changed.index.hull), 0
    assert (found == np.asarray(changed.slot)).all()
    assert (boxes[np.asarray(changed.slot) == LAYOUT.capacity] == NO_BOX).all()
    for at in np.ndindex(hull.shape):
        part = tuple(slice(2 * k, 2 * k + 2) for k in at)
        held = np.argwhere(boxes[part] != NO_BOX)
        assert (hull[at] == NO_BOX) == (len(held) == 0)
        for a in range(3) if len(held) else ():
            first, last = (np.asarray(v) for v in sides(jnp.asarray(boxes[part][tuple(held.T)]), a))
            low, high = (32 * held[:, a] + first).min(), (32 * held[:, a] + last).max()
            hull_first, hull_last = (int(v) for v in sides(jnp.asarray(hull[at]), a))
            assert 0 <= low - 2 * hull_first <= 1 and 0 <= 2 * hull_last + 1 - high <= 1
            some += 1
    assert some > 60
