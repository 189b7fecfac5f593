"""Outlines and surfaces against closed forms, and what the views contain."""

import matplotlib.pyplot as plt
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.patches import Circle, Polygon, Rectangle

from hrcjax.viz.path_view import (
    Obstacles,
    PathLine,
    PersonPoses,
    _capsule_surface,
    _solid,
    capsule_outline,
    path_views,
    plan_view,
    view_3d,
    window,
)
from hrcjax.viz.style import OBSTACLE, PERSON

OBSTACLES = Obstacles(
    np.array([0, 1, 2, 0]),
    np.array([[0.3, 0.4, 0.1], [0.2, 0.2, 0.1], [0.5, 0.6, 0.2], [9.0, 9, 9]]),
    np.array([[0.05, 0.05, 0.05], [0.03, 0.03, 0.1], [0.1, 0.05, 0.2], [1.0, 1, 1]]),
    np.array([0.0, 0, np.pi / 2, 0]),
    np.array([True, True, True, False]),
)
PERSON_POSES = PersonPoses(
    np.array([[[1.0, 1, 0], [1, 1, 0.5]], [[1.1, 1, 0], [1, 1, 0.5]]]),
    np.array([[[1.0, 1, 1], [0.8, 0.7, 0.4]], [[1.1, 1, 1], [0.5, 0.6, 0.4]]]),
    np.array([0.2, -1.0]),
    np.array([0.0, 2.0]),
)
PATH = PathLine(np.array([[0.1, 0.7, 0.15], [0.4, 0.6, 0.2], [0.7, 0.3, 0.05]]), "tool")
START, GOAL = PATH.points[0], PATH.points[-1]


def distance(x: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    """Of a point to a segment."""
    along = b - a
    t = np.clip((x - a) @ along / max(along @ along, 1e-30), 0, 1)
    return float(np.linalg.norm(x - a - t * along))


coordinate = st.floats(-2, 2).map(lambda v: round(v, 3))


@settings(deadline=None, max_examples=30)
@given(st.tuples(coordinate, coordinate), st.tuples(coordinate, coordinate), st.floats(0.01, 1))
def test_outline_is_at_the_radius(a: tuple, b: tuple, radius: float) -> None:
    ends = np.array(a), np.array(b)
    outline = capsule_outline(*ends, radius)
    np.testing.assert_allclose([distance(x, *ends) for x in outline], radius, rtol=1e-6)


def test_area_of_outline() -> None:
    x, y = capsule_outline(np.zeros(2), np.array([0.0, 3.0]), 0.5, arc=200).T
    area = abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2
    np.testing.assert_allclose(area, 3.0 + np.pi * 0.25, rtol=1e-3)


@settings(deadline=None, max_examples=30)
@given(st.tuples(*[coordinate] * 3), st.tuples(*[coordinate] * 3), st.floats(0.01, 1))
def test_surface_is_at_the_radius_all_around(a: tuple, b: tuple, radius: float) -> None:
    ends = np.array(a), np.array(b)
    points = _capsule_surface(*ends, radius).reshape(-1, 3)
    np.testing.assert_allclose([distance(x, *ends) for x in points], radius, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose((points.max(0) + points.min(0)) / 2, (ends[0] + ends[1]) / 2, atol=0.6 * radius)


def test_solids_have_their_extents() -> None:
    extents = []
    for i in range(3):
        corners = np.concatenate(_solid(OBSTACLES, i))
        np.testing.assert_allclose((corners.max(0) + corners.min(0)) / 2, OBSTACLES.center[i], atol=2e-3)
        extents.append((corners.max(0) - corners.min(0)) / 2)
    np.testing.assert_allclose(extents, [[0.05, 0.05, 0.05], [0.03, 0.03, 0.1], [0.05, 0.1, 0.2]], rtol=0.02)


def test_a_turned_box_points_the_right_way_in_both_views() -> None:
    turned = OBSTACLES._replace(yaw=np.array([0, 0, 0.4, 0]))
    corners = np.concatenate(_solid(turned, 2))[:, :2]
    _, axes = plan_view([PATH], turned)
    box = next(p for p in axes.patches if isinstance(p, Rectangle) and p.get_width() > 0)
    drawn = box.get_corners()
    for corner in drawn:
        assert np.linalg.norm(corners - corner, axis=1).min() < 1e-9
    longest = corners[np.argmax(corners @ [np.cos(0.4), np.sin(0.4)])] - turned.center[2, :2]
    np.testing.assert_allclose(longest @ [np.cos(0.4), np.sin(0.4)], 0.1)


def test_plan_shows_what_exists_and_nothing_else() -> None:
    figure, axes = plan_view([PATH], OBSTACLES, PERSON_POSES, START, GOAL, "toy")
    circles = [p for p in axes.patches if isinstance(p, Circle)]
    assert [(c.center, c.radius) for c in circles] == [((0.3, 0.4), 0.05), ((0.2, 0.2), 0.03)]
    bodies = [p for p in axes.patches if isinstance(p, Polygon)]
    assert len(bodies) == 2  # one capsule at two times; the other has a negative radius
    assert bodies[0].get_alpha() < bodies[1].get_alpha()
    for body, pose in zip(bodies, PERSON_POSES.a[:, 0], strict=True):  # upright: a circle of its radius
        np.testing.assert_allclose(np.linalg.norm(body.get_xy() - pose[:2], axis=1), 0.2)
    np.testing.assert_array_equal(axes.lines[0].get_xydata(), PATH.points[:, :2])
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_title()) == ("x [m]", "y [m]", "toy")
    at = {line.get_label(): line.get_xydata()[0].tolist() for line in axes.lines}
    assert at["start"] == START[:2].tolist() and at["goal"] == GOAL[:2].tolist()
    texts = [text.get_text() for text in axes.get_legend().get_texts()]
    assert texts == ["person at 0.0, 2.0 s", "obstacle", "tool", "start", "goal"]
    assert axes.get_aspect() == 1.0
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]


def test_window_holds_paths_and_obstacles_but_not_all_of_the_person() -> None:
    low, high = window([PATH], OBSTACLES, START, GOAL, None)
    np.testing.assert_allclose(low, [0.1 - 0.12, 0.17 - 0.12, 0.0])
    np.testing.assert_allclose(high, [0.82, 0.82, 0.52])
    across = PERSON_POSES._replace(a=-PERSON_POSES.a, b=-PERSON_POSES.b)
    beneath, _ = window([PATH], OBSTACLES, START, GOAL, across)
    np.testing.assert_allclose(beneath, [0.1 - 0.12 - 0.35, 0.17 - 0.12 - 0.35, 0.0])
    near = PERSON_POSES._replace(a=0.0 * PERSON_POSES.a + 0.1, b=0.0 * PERSON_POSES.b + 0.1)
    np.testing.assert_allclose(window([PATH], OBSTACLES, START, GOAL, near)[0], [-0.02, -0.02, 0.0])
    _, wide = window([PATH], OBSTACLES, START, GOAL, PERSON_POSES)
    np.testing.assert_allclose(wide, [0.82 + 0.35, 0.82 + 0.3, 0.52 + 0.5])


def test_views_in_three_dimensions_draw_without_person_and_obstacles() -> None:
    before = plt.get_fignums()
    figure, axes = view_3d([PATH])
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]
    assert axes.get_zlabel() == "z [m]"
    figure, (flat, deep) = path_views([PATH], OBSTACLES, PERSON_POSES, START, GOAL, "toy")
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]
    assert figure.get_suptitle() == "toy" and flat.get_legend() is None and len(figure.legends) == 1
    colours = {tuple(np.round(c.get_facecolor()[0][:3], 3)) for c in deep.collections}
    parts = {tuple(round(int(c[i : i + 2], 16) / 255, 3) for i in (1, 3, 5)) for c in (PERSON, OBSTACLE)}
    assert parts <= colours
    np.testing.assert_array_equal(np.array(deep.lines[0].get_data_3d()).T, PATH.points)
    low, high = window([PATH], OBSTACLES, START, GOAL, PERSON_POSES)
    np.testing.assert_allclose(np.transpose([deep.get_xlim(), deep.get_ylim(), deep.get_zlim()]), [low, high])
    for body in deep.collections:
        middles = np.nanmean(np.where(body._invalid_vertices[..., None], np.nan, body._faces), axis=1)
        assert (middles >= low - 1e-9).all() and (middles <= high + 1e-9).all()
    assert plt.get_fignums() == before  # nothing enters pyplot's global state
