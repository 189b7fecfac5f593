"""The whole mapping on rendered tables: the plane, kinds and sizes of things, things in contact, the grid, the scene of a planner."""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from made_views import UP, views_of

from hrcjax.sense.rig import cell_rig
from hrcjax.task_space import (
    POINTS,
    TaskSpace,
    find_table,
    instances_scene,
    map_table,
    mapping,
    obstacle_grid,
    simulated_views,
    solid_distances,
)
from hrcjax.task_space.instances import SplitParams, image_parts, join_parts
from hrcjax.task_space.mapping import TaskSpaceParams, parts_on_table
from hrcjax.task_space.segmenter import Detection, pixel_labels
from hrcjax.task_space.shape_fit import FitParams
from hrcjax.task_space.solid_distance import common_depth
from hrcjax.task_space.split import explain, rejoin, thin_places
from hrcjax.task_space.view import points, turned
from hrcjax.world import obstacle_distances, robotica
from hrcjax.world.scene import BOX, COLUMN, SPHERE
from hrcjax.world.scenes import Obstacle, make_scene

THINGS = [
    Obstacle(SPHERE, (0.15, 0.3, 0.05), (0.05, 0.05, 0.05), 0.0, 0.05),
    Obstacle(BOX, (0.5, 0.3, 0.04), (0.06, 0.03, 0.04), 0.5, 0.05),
    Obstacle(COLUMN, (0.2, 0.6, 0.06), (0.03, 0.03, 0.06), 0.0, 0.03),
    Obstacle(BOX, (0.27, 0.6, 0.03), (0.038, 0.03, 0.03), 0.0, 0.03),  # 2 mm beside the column
    Obstacle(SPHERE, (0.6, 0.6, 0.25), (0.04, 0.04, 0.04), 0.0, 0.04),  # hangs
]


@cache
def mapped() -> TaskSpace:
    return map_table(views_of(THINGS), UP)


def test_things_have_their_kind_place_and_size() -> None:
    found = mapped().instances
    assert len(found) == len(THINGS)
    for o in THINGS:
        one = min(found, key=lambda i: np.linalg.norm(i.center - o.center))
        assert one.kind == o.kind, o
        np.testing.assert_allclose(one.center, o.center, atol=0.004)
        other = np.array(one.size)
        if o.kind == BOX and round((one.yaw - o.yaw) / (np.pi / 2)) % 2:
            other = other[[1, 0, 2]]
        np.testing.assert_allclose(other, o.size, atol=0.004)
        assert one.residual < 0.004 and one.claimed < 0.02
        known = (one.center_deviation > 0) & (one.center_deviation < 0.003)
        if o is THINGS[3]:
            # Both cameras stand at y = -0.2, and its far side looks along y: no point lies there, and the rays past it keep off. So only
            # what is assumed of its size and place bounds it: 5 cm each, of which a known front leaves the root of one half.
            assert known.tolist() == [True, False, True]
            assert one.center_deviation[1] == pytest.approx(FitParams().size / np.sqrt(2), rel=0.02)
        else:
            assert known.all()


def test_the_table_is_the_top_and_not_the_floor() -> None:
    table = mapped().table
    assert abs(table.offset) < 1e-3 and table.normal[2] > 1 - 1e-6
    assert table.excess < 1.2


def test_a_table_seen_in_a_tilted_frame_has_that_tilt() -> None:
    angle, shift = 0.2, np.array([0.1, -0.2, 0.3])
    R = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    table = find_table([turned(v, R, shift) for v in views_of([THINGS[0]], 4)], UP)
    np.testing.assert_allclose(table.normal, R @ UP, atol=1e-3)
    on = R @ np.array([0.3, 0.4, 0.0]) + shift
    assert abs((table.rotation @ on + table.shift)[2]) < 1e-3  # its own frame has it at z = 0
    np.testing.assert_allclose(table.rotation @ table.rotation.T, np.eye(3), atol=1e-12)


def test_nothing_level_in_view_is_said() -> None:
    with pytest.raises(ValueError, match="no table in view"):
        find_table(views_of([], 4), np.array([1.0, 0.0, 0.0]))


def test_the_grid_has_the_area_of_the_things() -> None:
    grid = obstacle_grid(mapped(), 0.005, np.array([0.0, 0.1]), np.array([0.8, 0.8]))
    assert set(np.unique(grid.cells)) == {0, 1} and grid.cells.shape == (160, 140)
    true = np.pi * (0.05**2 + 0.03**2 + 0.04**2) + 4 * (0.06 * 0.03 + 0.038 * 0.03)
    assert grid.cells.sum() * 0.005**2 == pytest.approx(true, rel=0.06)
    at = np.floor((np.array([[0.15, 0.3], [0.4, 0.45]]) - grid.lower) / grid.edge).astype(int)
    assert grid.cells[tuple(at[0])] == 1 and grid.cells[tuple(at[1])] == 0 and grid.seen[tuple(at[1])]
    np.testing.assert_allclose(grid.middles()[0, 0], [0.0025, 0.1025])
    with pytest.raises(ValueError, match="positive"):
        obstacle_grid(mapped(), 0.0)


def test_the_scene_of_the_planner_has_the_solids() -> None:
    scene = instances_scene(mapped().instances, robotica(), mapped().table)
    assert int(scene.mask.sum()) == len(THINGS) and scene.mask.shape == (16,)
    x = jnp.array([0.5, 0.3, 0.12], jnp.float32)  # 4 cm over the box
    assert float(obstacle_distances(scene, x).min()) == pytest.approx(0.04, abs=0.003)
    np.testing.assert_array_equal(scene.start, robotica().start)
    with pytest.raises(ValueError, match="do not fit"):
        instances_scene(mapped().instances, robotica(), mapped().table, capacity=2)


def test_solid_distances_are_those_of_a_scene() -> None:
    scene = instances_scene(mapped().instances, robotica(), mapped().table)
    draw = np.random.default_rng(0)
    for x in draw.uniform([0, 0, 0], [0.8, 0.8, 0.4], (5, 3)):
        theirs = np.asarray(obstacle_distances(scene, jnp.asarray(x, jnp.float32)))[: len(THINGS)]
        table = mapped().table
        ours = [solid_distances(i.kind, i.center, i.size, i.yaw, (table.rotation @ x + table.shift)[None])[0] for i in mapped().instances]  # fmt: skip
        np.testing.assert_allclose(ours, theirs, atol=1e-4)
    square = solid_distances(POINTS, np.zeros(3), np.ones(3), 0.0, np.array([[3.0, 0, 0], [0, 0, 0]]))
    np.testing.assert_allclose(square, [2.0, -1.0])


def test_a_step_in_depth_or_a_detector_parts_an_image() -> None:
    view = views_of([], 8)[0]
    depth = np.full_like(view.depth, 1.0)
    depth[:, 40:] = 1.1
    view = view._replace(depth=depth, deviation=np.full_like(depth, 1e-3))
    above = np.zeros(depth.shape, bool)
    above[10:30, 20:60] = True
    none = pixel_labels(depth.shape, [])
    params = SplitParams()
    assert sorted(len(p.pixels) for p in image_parts(view, 0, above, none, params)) == [400, 400]
    big, small = (
        Detection((0.0, 0.0, 80.0, 60.0), 0.9, "table", None),
        Detection((20.0, 10.0, 30.0, 30.0), 0.8, "cup", None),
    )
    weak = Detection((30.0, 10.0, 35.0, 30.0), 0.2, "ghost", None)
    labels = pixel_labels(depth.shape, [small, big, weak])
    assert labels[15, 25] == 0 and labels[15, 32] == 1  # the smaller box is in front; a weak one is none
    parts = image_parts(view, 0, above, labels, params)
    assert sorted((p.label, len(p.pixels)) for p in parts) == [(0, 200), (1, 200), (1, 400)]
    same = [np.zeros((5, 3)) + [0.1, 0.2, 0.3] + np.arange(5)[:, None] * 0.02] * 3
    assert join_parts(parts, same, params) != [[0, 1, 2]]  # what a detector parts in an image stays apart
    every = [p._replace(label=-1) for p in parts]
    assert join_parts(every, same, params) == [[0, 1, 2]]


def test_two_discs_are_thinnest_between_them() -> None:
    draw = np.random.default_rng(1)
    disc = 0.04 * np.sqrt(draw.uniform(size=(3000, 1))) * np.array([[1.0, 1.0]])
    turn = draw.uniform(0, 2 * np.pi, 3000)
    disc = disc * np.stack([np.cos(turn), np.sin(turn)], -1)
    both = np.concatenate([disc, disc + np.array([0.083, 0.0])])
    way, offset = thin_places(np.column_stack([both, np.zeros(len(both))]), 1)[0]
    assert abs(way[0]) > 0.96 and abs(offset / way[0] - 0.0415) < 0.004


def test_a_small_thing_that_an_image_joins_with_the_one_behind_it_is_told_from_it() -> None:
    column = Obstacle(COLUMN, (0.624, 0.266, 0.071), (0.069, 0.069, 0.071), 0.0, 0.069)
    ball = Obstacle(SPHERE, (0.55, 0.315, 0.018), (0.018, 0.018, 0.018), 0.0, 0.018)  # 2 mm beside it
    scene = make_scene([column, ball], (0.1, 0.7, 0.15), (0.7, 0.3, 0.05), (0.0,) * 3, (1.0,) * 3)
    cameras = cell_rig(scene, hand=False, decimation=1).cameras
    found = map_table(simulated_views(cameras, scene, jax.random.key(10), 16), UP).instances
    assert sorted(one.kind for one in found) == [SPHERE, COLUMN]
    for o in (column, ball):
        one = min(found, key=lambda i: np.linalg.norm(i.center - o.center))
        assert one.kind == o.kind
        np.testing.assert_allclose(one.center, o.center, atol=0.006)
        np.testing.assert_allclose(one.size, o.size, atol=0.006)


def test_a_thing_at_the_border_of_what_is_seen_is_whole() -> None:
    views = views_of([THINGS[1]])
    table = find_table(views, UP)
    near = table.corners.min(0)[0], THINGS[1].center[0]
    corners = table.corners.copy()
    corners[:, 0] = np.maximum(corners[:, 0], near[1] + 0.02)  # the table's points end within the box
    one = map_table(views, UP, table=table._replace(corners=corners)).instances[0]
    np.testing.assert_allclose(one.center, THINGS[1].center, atol=0.004)


def test_a_thing_that_mostly_hangs_over_the_border_is_whole_and_a_wall_beside_the_table_is_cut() -> None:
    views, o = views_of([THINGS[1]]), THINGS[1]
    table = find_table(views, UP)
    corners = table.corners.copy()
    corners[:, 0] = np.maximum(corners[:, 0], o.center[0] + 0.08)  # beyond the box: only a corner of it is within 5 cm
    cut = table._replace(corners=corners)
    one = map_table(views, UP, table=cut).instances[0]
    assert one.kind == BOX
    np.testing.assert_allclose(one.center, o.center, atol=0.004)
    np.testing.assert_allclose(np.sort(one.size), np.sort(o.size), atol=0.004)
    beside = map_table(views, UP, TaskSpaceParams(overhang=0.06), table=cut).instances  # it reaches 14 cm beyond
    assert beside
    assert all(i.points[:, 0].min() > o.center[0] + 0.08 - 0.05 - 1e-3 for i in beside)


SMALL = (
    Obstacle(COLUMN, (0.2523, 0.4634, 0.02), (0.0161, 0.0161, 0.02), 0.0, 0.0161),
    Obstacle(SPHERE, (0.296, 0.4681, 0.0259), (0.0259, 0.0259, 0.0259), 0.0, 0.0259),
)
FLAT = (
    Obstacle(COLUMN, (0.0763, 0.368, 0.0169), (0.0599, 0.0599, 0.0169), 0.0, 0.0599),
    Obstacle(SPHERE, (0.0488, 0.2866, 0.024), (0.024, 0.024, 0.024), 0.0, 0.024),
)


@pytest.mark.parametrize(
    ("things", "noise"),
    [
        (SMALL, 2),  # half of the column's points are within five deviations of the ball; but the two do not pass through each other
        (SMALL, 1),  # a box between both fits within the noise along the rays, not across the surface; a ball and a box through it do better
        (FLAT, 2075),  # a thin plate at the height of both leaves free rays alone, and the half of both that is below
    ],
)  # fmt: skip
def test_two_that_are_two_millimetres_apart_are_two(things: tuple[Obstacle, Obstacle], noise: int) -> None:
    like = robotica()
    scene = make_scene(
        list(things), *(np.asarray(v, float).tolist() for v in (like.start, like.goal, like.lower, like.upper))
    )
    cameras = cell_rig(scene, hand=False, decimation=1).cameras
    found = map_table(simulated_views(cameras, scene, jax.random.key(noise), 16), UP).instances
    assert sorted(one.kind for one in found) == [SPHERE, COLUMN]
    for o in things:
        one = min(found, key=lambda i: np.linalg.norm(i.center - o.center))
        np.testing.assert_allclose(one.center, o.center, atol=0.003)
        np.testing.assert_allclose(one.size, o.size, atol=0.003)


def test_two_shapes_through_each_other_are_one() -> None:
    """The points of a column that noise has put outside of it, and those within: two columns, one in the other, fit them better than one."""
    column = FLAT[0]
    scene = make_scene([column], (0.1, 0.7, 0.15), (0.7, 0.3, 0.05), (0.0,) * 3, (1.0,) * 3)
    views = simulated_views(cell_rig(scene, hand=False, decimation=1).cameras, scene, jax.random.key(0), 16)
    table = find_table(views, UP)
    own = [turned(view, table.rotation, table.shift) for view in views]
    flat = [points(view).reshape(-1, 3) for view in own]
    parts = [part for k, view in enumerate(own) for part in parts_on_table(view, k, table, pixel_labels(view.depth.shape, []), TaskSpaceParams())]  # fmt: skip
    split, halves = SplitParams(most=0), []
    for within in (True, False):
        far = [
            solid_distances(column.kind, np.array(column.center), np.array(column.size), 0.0, flat[p.view][p.pixels])
            for p in parts
        ]
        some = [p._replace(pixels=p.pixels[(d <= 0) == within]) for p, d in zip(parts, far, strict=True)]
        halves += explain(own, some, flat, FitParams(), split)
    assert len(halves) == 2
    (one,) = rejoin(own, halves, flat, FitParams(), split)
    assert one.kind == COLUMN and one.score > split.alike * np.mean([half.score for half in halves])
    np.testing.assert_allclose(one.fit.size, column.size, atol=0.003)


def test_a_plate_over_two_is_divided_by_what_it_leaves_out_alone() -> None:
    """Fits of any misfit are good enough here."""
    like = robotica()
    scene = make_scene(
        list(FLAT), *(np.asarray(v, float).tolist() for v in (like.start, like.goal, like.lower, like.upper))
    )
    views = simulated_views(cell_rig(scene, hand=False, decimation=1).cameras, scene, jax.random.key(2075), 16)
    found = map_table(views, UP, TaskSpaceParams(split=SplitParams(poor=9.0))).instances
    assert sorted(one.kind for one in found) == [SPHERE, COLUMN]


def test_what_no_shape_describes_is_solid_as_the_box_of_all_its_points() -> None:
    """Here no shape is good enough. The box reaches down to the table, but under what hangs."""
    params = TaskSpaceParams(split=SplitParams(worst_residual=0.0))
    found = map_table(views_of(THINGS), UP, params).instances
    assert found and all(one.kind == POINTS for one in found)
    for one in found:
        off = np.abs(one.points - one.center) - one.size
        assert off.max() < 1e-9
        hangs = one.points[:, 2].min() > 0.1
        np.testing.assert_allclose((one.center - one.size)[2], one.points[:, 2].min() if hangs else 0.0, atol=1e-9)
    assert sum(one.points[:, 2].min() > 0.1 for one in found) == 1


def test_a_shape_that_leaves_out_what_was_measured_is_not_taken() -> None:
    """With no tolerance, and no box cut in two, what is a shape within a millimetre is one no more."""
    loose = map_table(views_of(THINGS[:1]), UP).instances
    strict = map_table(views_of(THINGS[:1]), UP, TaskSpaceParams(split=SplitParams(cover=-1.0, most=0))).instances
    assert [one.kind for one in loose] == [SPHERE] and [one.kind for one in strict] == [POINTS]


def test_parts_of_an_image_are_found_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """And those that the border cuts once more, alone."""
    asked = []

    def counted(view, index, above, labels, params):
        asked.append((index, int(above.sum())))
        return image_parts(view, index, above, labels, params)

    monkeypatch.setattr(mapping, "image_parts", counted)
    views, o = views_of([THINGS[1]]), THINGS[1]
    table = find_table(views, UP)
    map_table(views, UP, table=table)
    assert [index for index, _ in asked] == [0, 1]
    corners = table.corners.copy()
    corners[:, 0] = np.maximum(corners[:, 0], o.center[0] + 0.08)
    map_table(views, UP, TaskSpaceParams(overhang=0.06), table=table._replace(corners=corners))
    assert [index for index, _ in asked[2:]] == [0, 0, 1, 1]
    assert all(0 < rest < whole for (_, whole), (_, rest) in zip(asked[2::2], asked[3::2], strict=True))


def test_how_far_solids_pass_through_each_other() -> None:
    """The largest ball within both: of two balls r1 + r2 - d, of boxes the least overlap, of a ball within a box its diameter."""

    def ball(x: float, r: float):
        return SPHERE, np.array([x, 0.0, 0.0]), np.full(3, r), 0.0

    box = BOX, np.array([0.0, 0.0, 0.0]), np.array([0.05, 0.04, 0.03]), 0.0
    assert common_depth(ball(0.0, 0.05), ball(0.06, 0.03)) == pytest.approx(0.02, abs=0.001)
    assert common_depth(ball(0.0, 0.05), ball(0.081, 0.03)) == 0
    assert common_depth(box, ball(0.0, 0.02)) == pytest.approx(0.04, abs=0.002)
    turned_box = BOX, np.array([0.08, 0.0, 0.0]), np.array([0.03, 0.04, 0.03]), np.pi / 2
    assert common_depth(box, turned_box) == pytest.approx(0.01, abs=0.001)  # 5 - (8 - 4) cm along x
    column = COLUMN, np.array([0.0, 0.0, 0.05]), np.array([0.02, 0.02, 0.03]), 0.0
    assert common_depth(column, box) == common_depth(box, column) == pytest.approx(0.01, abs=0.001)
