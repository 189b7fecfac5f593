"""Frames into a map: a still scene, a thing that moves, a thing that passes in front, and all that can be missing."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.map import DYNAMIC, NEW, MapLayout, MapParams, View, empty_map, fuse, make_view
from hrcjax.map.index import NO_BOX, boxes_by_place
from hrcjax.map.layout import REACH
from hrcjax.sense import NoiseParams, d435i
from hrcjax.sense.camera import render_scene
from hrcjax.sense.noise import measure
from hrcjax.world.scene import BOX, scene_distance
from hrcjax.world.scenes import Obstacle, make_scene

EYE = (0.0, -0.9, 0.8)
ROOM = ((0.0,) * 3, (0.1,) * 3, (0.0,) * 3, (1.0,) * 3)


def scene_with(*boxes):
    """The table, and upright boxes given by middle and half extents."""
    return make_scene([Obstacle(BOX, middle, half, 0.0, 0.1) for middle, half in boxes], *ROOM)


@pytest.fixture(scope="module")
def camera():
    return d435i(jnp.asarray(EYE, jnp.float32), jnp.asarray([0.0, 0.05, 0.05], jnp.float32), 1)


@pytest.fixture(scope="module")
def look(camera):
    """(scene, number of the frame) -> a measured image."""
    render = jax.jit(lambda scene: render_scene(camera, scene))
    noisy = jax.jit(lambda image, key: measure(image, camera, key, NoiseParams()))
    return lambda scene, k: noisy(render(scene), jax.random.key(k))


def points_of(state) -> tuple[np.ndarray, np.ndarray]:
    rows = np.asarray(state.levels[0].rows)
    there = rows[:, 3] > 0
    return np.moveaxis(rows[:, :3], 1, 2)[there], np.asarray(state.label)[there]


def within(points: np.ndarray, middle, half, margin: float = 0.02) -> np.ndarray:
    return (np.abs(points - np.asarray(middle)) < np.asarray(half) + margin).all(axis=1)


BOX_A, BOX_B, HALF = (-0.15, 0.1, 0.06), (0.2, 0.1, 0.06), (0.05, 0.05, 0.06)


@pytest.fixture(scope="module")
def still(layout, program, camera, look):
    """The map after six frames of a box on the table, and the last report."""
    state, scene = empty_map(layout), scene_with((BOX_A, HALF))
    for k in range(6):
        state, report = program(state, camera, look(scene, k))
    return state, report, scene


def test_points_lie_on_the_surfaces(still) -> None:
    state, report, scene = still
    points, _ = points_of(state)
    d = np.abs(jax.vmap(lambda x: scene_distance(scene, x))(jnp.asarray(points)))
    assert len(points) > 1000 and int(report.lost) == int(report.unseen) == 0
    assert np.median(d) < 0.001 and np.percentile(d, 95) < 0.004
    assert int(report.new) < 0.01 * len(points) and int(report.removed) == 0


def test_boxes_about_points_and_slots_are_true(still, layout) -> None:
    """Boxes hold the points of level 0, and are a 32nd of the block larger on every side at most, on coarse levels somewhat
    more, as they are about boxes."""
    state, _, _ = still
    fine = points_of(state)[0]
    for number, level in enumerate(state.levels):
        edge = layout.edge_of(number)
        slot, place, rows = (np.asarray(v) for v in (level.slot, level.place, level.rows))
        box, found = (np.asarray(v) for v in boxes_by_place(level.index, slot.shape))
        assert (found == slot).all()
        used = np.flatnonzero(place[:, 0])
        assert len(used) == (slot < len(place)).sum() > 0
        assert (slot[tuple(place[used].T)] == used).all()
        block = np.floor((fine - np.asarray(layout.lower)) / edge).astype(int) + REACH
        for s in used:
            points = fine[(block == place[s]).all(axis=1)] if number else rows[s, :3, rows[s, 3] > 0]
            corner = np.asarray(layout.lower) + (place[s] - REACH) * edge
            parts = (box[tuple(place[s])] >> np.arange(0, 30, 5)) & 31
            low, high = corner + parts[:3] * edge / 32, corner + (parts[3:] + 1) * edge / 32
            under, over = points.min(axis=0) - low, high - points.max(axis=0)
            assert (np.minimum(under, over) > -1e-5).all() and (
                np.maximum(under, over) < (1.4 if number else 1.0) * edge / 32 + 1e-5
            ).all()
        assert (box[slot >= len(place)] == NO_BOX).all() and (box[tuple(place[used].T)] != NO_BOX).all()


def test_what_moved_away_goes_and_what_came_is_new_with_one_frame(still, program, camera, look) -> None:
    state, _, _ = still
    moved = scene_with((BOX_B, HALF))
    before, _ = points_of(state)
    stale = within(before, BOX_A, HALF) & (before[:, 2] > 0.03)
    state, first = program(state, camera, look(moved, 10))
    points, label = points_of(state)
    came = within(points, BOX_B, HALF) & (points[:, 2] > 0.03)
    assert came.sum() > 40 and (label[came] == NEW).mean() > 0.95
    assert int(first.dynamic) > 0.95 * stale.sum() and not (label == DYNAMIC).any()
    left = within(points, BOX_A, HALF) & (points[:, 2] > 0.03)
    assert stale.sum() > 40 and left.sum() <= 0.05 * stale.sum()


def test_holes_in_the_image_keep_no_ghosts(still, program, camera, look) -> None:
    """One pixel in twenty without depth: what moved away goes all the same."""
    state, _, _ = still
    stale = (lambda p: within(p, BOX_A, HALF) & (p[:, 2] > 0.03))(points_of(state)[0]).sum()
    moved = scene_with((BOX_B, HALF))
    for k in range(3):
        holes = jax.random.bernoulli(jax.random.key(k), 0.05, (480, 640))
        state, _ = program(state, camera, jnp.where(holes, 0.0, look(moved, 30 + k)))
    points, _ = points_of(state)
    assert (within(points, BOX_A, HALF) & (points[:, 2] > 0.03)).sum() < 0.05 * stale


def test_what_is_met_again_has_not_been_missed(still, layout, camera, look) -> None:
    """Seen through once, met at its depth, and seen through once more: that is once in a row, not twice."""
    patient = MapParams(patience=2.0)
    points_program = jax.jit(lambda state, camera, view: fuse(layout, patient, state, camera, view))
    state, _, scene = still
    before = (lambda p: within(p, BOX_A, HALF) & (p[:, 2] > 0.03))(points_of(state)[0]).sum()
    for k, image in enumerate((scene_with(), scene, scene_with())):
        view = make_view(camera, look(image, 40 + k), 4e-3)
        if k == 1:  # tells the depth, but has no points that could count as observations
            view = dataclasses.replace(view, mask=jnp.zeros_like(view.mask))
        state, report = points_program(state, camera, view)
    after = (lambda p: within(p, BOX_A, HALF) & (p[:, 2] > 0.03))(points_of(state)[0]).sum()
    assert int(report.dynamic) > 40 and after > 0.5 * before  # at the rims the nearest of 144 pixels is another's


def test_what_a_frame_cannot_hold_comes_in_turn(camera, look) -> None:
    """A view of more blocks than one frame sees: all are seen in the end, and what is behind is said."""
    few = MapLayout(lower=(-0.6, -0.6, -0.2), shape=(12, 12, 8), capacity=512, seen=40, born=512, refitted=512)
    step = jax.jit(lambda state, depth: fuse(few, MapParams(), state, camera, make_view(camera, depth, 4e-3)))
    state, scene, unseen = empty_map(few), scene_with((BOX_A, HALF)), 0
    for k in range(16):
        state, report = step(state, look(scene, k))
        unseen = max(unseen, int(report.unseen))
    filled = (np.asarray(state.levels[0].rows[:, 3]) > 0).any(axis=1).sum()
    assert unseen > 40 and filled > 0.95 * int(report.blocks)


def test_what_is_hidden_stays(still, program, camera, look) -> None:
    """A board before the camera: of all the points behind it none goes."""
    state, _, _ = still
    before, _ = points_of(state)
    board = scene_with((BOX_A, HALF), ((0.0, -0.45, 0.35), (0.3, 0.01, 0.25)))
    for k in range(4):
        state, _ = program(state, camera, look(board, 20 + k))
    points, _ = points_of(state)
    behind = before[:, 1] > -0.3
    kept = sum(1 for p in before[behind] if np.min(np.sum((points - p) ** 2, axis=1)) < 0.01**2)
    assert behind.sum() > 500 and kept > 0.99 * behind.sum()


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf, -1.0, 65.535])
def test_an_image_without_depth_changes_nothing(still, program, camera, value: float) -> None:
    state, _, _ = still
    after, report = program(state, camera, jnp.full((480, 640), value, jnp.float32))
    assert int(report.removed) == int(report.new) == int(report.dynamic) == 0
    assert (points_of(after)[0] == points_of(state)[0]).all()


def test_no_capacity_is_a_number_in_the_report(camera, look) -> None:
    small = MapLayout(lower=(-0.6, -0.6, -0.2), shape=(12, 12, 8), capacity=32, seen=512, born=512, refitted=64)
    step = jax.jit(lambda state, depth: fuse(small, MapParams(), state, camera, make_view(camera, depth, 4e-3)))
    state, report = step(empty_map(small), look(scene_with((BOX_A, HALF)), 0))
    assert int(report.lost) > 50 and int(report.blocks) == 32
    assert np.isfinite(points_of(state)[0]).all()


def test_one_program_whatever_the_map_holds(layout, camera, look) -> None:
    traces = []

    @jax.jit
    def step(state, camera, depth):
        traces.append(1)
        return fuse(layout, MapParams(), state, camera, make_view(camera, depth, 4e-3))

    state = empty_map(layout)
    for k, scene in enumerate((scene_with(), scene_with((BOX_A, HALF)), scene_with((BOX_A, HALF), (BOX_B, HALF)))):
        state, _ = step(state, camera, look(scene, k))
    other = dataclasses.replace(camera, position=camera.position + 0.1)
    step(state, other, look(scene_with(), 9))
    assert len(traces) == 1


def test_memory_of_a_point_is_bounded(still) -> None:
    state, _, _ = still
    most = MapParams().memory / MapParams().least_deviation ** 2
    assert float(jnp.max(state.information)) <= most * (1 + 1e-6)


def test_a_far_point_that_is_unsure_stays_where_it_was_measured() -> None:
    layout = MapLayout(lower=(-0.8, -0.8, 19.2), shape=(8, 8, 8), spacing=0.05, levels=2, seen=512, born=512)
    x = jnp.asarray([[0.11, 0.22, 20.01], [-0.31, 0.12, 20.01]], jnp.float32)
    view = View(x, jnp.ones(2, bool), jnp.full(2, 2.7, jnp.float32), jnp.zeros((1, 1), jnp.float32))  # 1.6 m deviation
    camera = d435i(jnp.zeros(3, jnp.float32), jnp.asarray([0.0, 0.0, 1.0], jnp.float32), 1)
    take = jax.jit(lambda state, view: fuse(layout, MapParams(far=30.0), state, camera, view))
    state, _ = take(empty_map(layout), view)
    np.testing.assert_allclose(np.sort(points_of(state)[0], axis=0), np.sort(x, axis=0), atol=1e-4)
    moved = dataclasses.replace(view, points=x.at[:, 2].add(0.02))
    state, _ = take(state, moved)  # and goes half the way to the second measurement
    np.testing.assert_allclose(points_of(state)[0][:, 2], 20.02, atol=1e-4)


def test_pixels_fewer_than_a_tile_are_refused(camera) -> None:
    with pytest.raises(ValueError, match="4 x 4 and more"):
        make_view(camera, jnp.ones((3, 640)), 0.01)


def test_points_for_which_a_frame_has_no_entry_are_told() -> None:
    layout = MapLayout(lower=(-0.2, -0.2, 0.9), shape=(4, 4, 4), levels=2, seen=2, born=2)
    a = 0.0125 + 0.025 * np.arange(4)
    x = np.stack(np.meshgrid(a, a, 1.0 + a, indexing="ij"), axis=-1).reshape(-1, 3)  # one full block
    view = View(
        jnp.asarray(x, jnp.float32),
        jnp.ones(64, bool),
        jnp.full(64, 1e-6, jnp.float32),
        jnp.zeros((1, 1), jnp.float32),
    )
    camera = d435i(jnp.zeros(3, jnp.float32), jnp.asarray([0.0, 0.0, 1.0], jnp.float32), 1)
    _, report = jax.jit(lambda view: fuse(layout, MapParams(), empty_map(layout), camera, view))(view)
    assert layout.entries == 32 and int(report.left_out) == 32 and int(report.points) == 32
    few = dataclasses.replace(view, mask=view.mask.at[20:].set(False))
    _, report = jax.jit(lambda view: fuse(layout, MapParams(), empty_map(layout), camera, view))(few)
    assert int(report.left_out) == 0 and int(report.points) == 20


def test_a_point_beside_the_origin_is_as_new_as_any(layout, points_program) -> None:
    """Places without a point are kept as zeros, which must not count as points there."""
    x = jnp.asarray([[0.005, 0.005, 0.005], [0.3, 0.3, 0.1]], jnp.float32)
    view = View(x, jnp.ones(2, bool), jnp.full(2, 1e-6, jnp.float32), jnp.zeros((4, 4), jnp.float32))
    camera = d435i(jnp.asarray([0.0, -1.4, 1.4], jnp.float32), jnp.zeros(3, jnp.float32), 1)
    _, report = points_program(empty_map(layout), camera, view)
    assert int(report.new) == int(report.points) == 2
