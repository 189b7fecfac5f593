"""Coarse levels: mean points, boxes about all that is below them, and what they lead to."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial import cKDTree

from hrcjax.map import FieldMap, MapLayout, MapParams, View, empty_map, fuse, map_distance
from hrcjax.map.descent import descend
from hrcjax.map.index import NO_BOX, boxes_by_place, sides
from hrcjax.map.layout import EDGE, REACH
from hrcjax.sense import d435i

LAYOUT = MapLayout(lower=(-2.0, -2.0, -0.4), shape=(40, 40, 24), capacity=2048)
PARAMS = MapParams(near=0.0, far=20.0)
GRAIN = 1 / 32


def points_of(state: FieldMap) -> np.ndarray:
    rows = np.asarray(state.levels[0].rows)
    return np.moveaxis(rows[:, :3], 1, 2)[rows[:, 3] > 0]


@pytest.fixture(scope="module")
def take():
    camera = d435i(jnp.asarray([0.0, 0.0, 5.0], jnp.float32), jnp.asarray([0.01, 0.0, 0.0], jnp.float32), 1)
    once = jax.jit(lambda state, view: fuse(LAYOUT, PARAMS, state, camera, view))

    def take(state: FieldMap, points: np.ndarray) -> FieldMap:
        x = jnp.asarray(points, jnp.float32)
        view = View(x, jnp.ones(len(x), bool), jnp.full(len(x), 1e-6, jnp.float32), jnp.zeros((1, 1), jnp.float32))
        state, report = once(state, view)
        assert int(report.lost) == int(report.unseen) == int(report.outside) == 0
        return state

    return take


def aslant() -> np.ndarray:
    """A board of 2 m, turned out of all axes, a floor, and a ball."""
    random = np.random.default_rng(0)
    a = np.arange(-1.0, 1.0, 0.022)
    u, v = (c.ravel() for c in np.meshgrid(a, a))
    n = np.array([0.5, 0.62, 0.6]) / np.linalg.norm([0.5, 0.62, 0.6])
    first = np.cross(n, [0, 0, 1.0])
    first /= np.linalg.norm(first)
    board = np.array([0.0, 0.0, 0.7]) + u[:, None] * first + v[:, None] * np.cross(n, first)
    ball = random.normal(size=(800, 3))
    ball = 0.1 * ball / np.linalg.norm(ball, axis=1)[:, None] + np.array([-1.2, -1.2, 1.5])
    everything = np.concatenate([board, ball]) + random.normal(scale=0.002, size=(len(board) + 800, 3))
    return everything[everything[:, 2] > -0.39][:8000].astype(np.float32)


@pytest.fixture(scope="module")
def state(take) -> FieldMap:
    points = aslant()
    state = empty_map(LAYOUT)
    for part in (points, points + np.float32(0.003)):  # the second frame moves the points
        state = take(state, part)
    return state


def test_coarse_points_are_means_and_boxes_hold_all_below(state) -> None:
    p = points_of(state)
    for level in (1, 2):
        blocks, edge = state.levels[level], LAYOUT.edge_of(level)
        boxes = np.asarray(boxes_by_place(blocks.index, blocks.slot.shape)[0])
        place = np.floor((p - np.asarray(LAYOUT.lower)) / edge).astype(int) + REACH
        used = {tuple(v) for v in np.asarray(blocks.place)[np.asarray(blocks.place)[:, 0] > 0]}
        assert used == {tuple(v) for v in place} and np.sum(boxes != NO_BOX) == len(used)
        for own in used:
            held = p[(place == own).all(axis=1)]
            corner = np.asarray(LAYOUT.lower) + (np.asarray(own) - REACH) * edge
            for a in range(3):
                first, last = (int(v) for v in sides(jnp.asarray(boxes[own]), a))
                low, high = corner[a] + edge * GRAIN * first, corner[a] + edge * GRAIN * (last + 1)
                assert low - 1e-5 <= held[:, a].min() <= low + edge * GRAIN * 1.3
                assert high - edge * GRAIN * 1.3 <= held[:, a].max() <= high + 1e-5
    rows = np.asarray(state.levels[1].rows)
    means = np.moveaxis(rows[:, :3], 1, 2)[rows[:, 3] > 0]
    block = np.floor((p - np.asarray(LAYOUT.lower)) / LAYOUT.edge_of(0)).astype(int) @ np.array([10**6, 10**3, 1])
    expected = np.stack([p[block == b].mean(axis=0) for b in np.unique(block)])
    gaps = cKDTree(means).query(expected)[0]
    # a block whose points have hardly moved does not tell the level above
    assert len(means) == len(expected) and gaps.max() < PARAMS.drift * LAYOUT.spacing * 2 and EDGE == 4


@pytest.fixture(scope="module")
def queries() -> np.ndarray:
    """All around, also outside of the mapped box."""
    random = np.random.default_rng(1)
    way = random.normal(size=(1500, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    return (way * random.uniform(0.3, 4.0, (1500, 1)) + np.array([0.0, 0.0, 0.6])).astype(np.float32)


def test_the_nearest_point_is_found_from_anywhere(state, queries) -> None:
    """Aslant to the axes, at up to 4 m: hundreds of boxes there are as near as that of the point."""

    def nearest(x):
        rows = state.levels[0].rows.at[descend(LAYOUT, state.levels, x, x)[0]].get(mode="fill", fill_value=0)
        r2 = sum((rows[:, a] - x[a]) ** 2 for a in range(3))
        return jnp.sqrt(jnp.min(jnp.where(rows[:, 3] > 0, r2, jnp.inf)))

    found = np.asarray(jax.jit(lambda x: jax.lax.map(nearest, x, batch_size=64))(queries))
    truth = cKDTree(points_of(state)).query(queries)[0]
    assert (found - truth).max() < 5e-4 and np.mean(found - truth > 1e-5) < 0.01


def test_every_block_is_chosen_once(state, queries) -> None:
    slots = np.asarray(jax.jit(jax.vmap(lambda x: descend(LAYOUT, state.levels, x, x)[0]))(queries[:100]))
    for row in slots:
        real = row[row < LAYOUT.capacity]
        assert len(real) == len(set(real)) > 30


def test_what_is_left_unread_is_farther_than_the_gap(state, queries) -> None:
    find = jax.jit(lambda low, high: descend(LAYOUT, state.levels, low, high))
    rows = np.asarray(state.levels[0].rows)
    for x in queries[:40]:
        slots, unread = find(jnp.asarray(x), jnp.asarray(x + np.float32(0.1)))
        rest = np.ones(len(rows), bool)
        rest[np.asarray(slots)[np.asarray(slots) < LAYOUT.capacity]] = False
        left = np.moveaxis(rows[rest, :3], 1, 2)[rows[rest, 3] > 0]
        apart = np.maximum(np.maximum(x - left, left - x - np.float32(0.1)), 0)
        assert np.sum(apart**2, axis=1).min() > float(unread) - 1e-5


def test_distance_far_away_is_that_to_the_nearest_point_and_its_gradient_is_finite(state, queries) -> None:
    read = jax.jit(
        lambda x: jax.lax.map(
            jax.value_and_grad(lambda x: map_distance(LAYOUT, state.levels, PARAMS.ratio, x)), x, batch_size=64
        )
    )
    d, g = (np.asarray(v) for v in read(queries))
    truth, index = cKDTree(points_of(state)).query(queries)
    far = truth > 0.3
    assert far.sum() > 600 and np.isfinite(g).all()
    assert np.abs(d - truth)[far].max() < 0.012 and np.sqrt(np.mean((d - truth)[far] ** 2)) < 0.002
    away = (queries - points_of(state)[index]) / truth[:, None]
    assert np.mean(np.sum(g * away, axis=1)[far] > 0.98) > 0.99  # the others lie between two surfaces


def test_a_block_without_points_is_forgotten_on_all_levels(take) -> None:
    """Points that the camera sees through go, and with them their blocks."""
    layout, params = LAYOUT, MapParams(near=0.0, far=20.0)
    camera = d435i(jnp.asarray([0.0, 0.0, 3.0], jnp.float32), jnp.asarray([0.01, 0.0, 0.0], jnp.float32), 1)
    lone = np.tile(np.array([[0.51, 0.13, 1.0]], np.float32), (8000, 1))
    state = take(empty_map(layout), lone)
    assert all(int(jnp.sum(level.place[:, 0] > 0)) == 1 for level in state.levels)
    deep = View(
        jnp.zeros((1, 3), jnp.float32),
        jnp.zeros(1, bool),
        jnp.ones(1, jnp.float32),
        jnp.full((120, 160), 9.0, jnp.float32),
    )
    once = jax.jit(lambda state: fuse(layout, params, state, camera, deep)[0])
    for _ in range(3):
        state = once(state)
    assert all(int(jnp.sum(level.place[:, 0] > 0)) == 0 for level in state.levels)
    assert all((np.asarray(boxes_by_place(v.index, v.slot.shape)[0]) == NO_BOX).all() for v in state.levels)
