"""The papers' figures, and laws of the clutter."""

import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.world.scene import BOX, COLUMN, SPHERE, obstacle_distances, scene_distance
from hrcjax.world.scenes import CAPACITY, SCENES, Obstacle, clutter, hri, make_scene, robotica, scene_named


def _line_clearance(scene):
    start, goal = np.asarray(scene.start, float), np.asarray(scene.goal, float)
    points = [jnp.asarray(start + s * (goal - start), scene.start.dtype) for s in np.linspace(0, 1, 60)]
    return min(float(jnp.min(obstacle_distances(scene, x))) for x in points)


@pytest.mark.parametrize("reading", ["columns", "spheres", "clearance"])
def test_robotica_figures(reading):
    scene = robotica(reading)
    np.testing.assert_allclose(scene.start, [0.10, 0.70, 0.15])
    np.testing.assert_allclose(scene.goal, [0.70, 0.30, 0.05])
    assert np.linalg.norm(np.asarray(scene.goal - scene.start)) == pytest.approx(0.7280, abs=1e-4)  # table VIII's line
    printed = np.array([(30, 55, 20), (25, 30, 20), (52, 50, 20), (55, 20, 20)]) / 100
    assert np.asarray(scene.mask).sum() == 4 and scene.mask.shape == (CAPACITY,)
    center, size = np.asarray(scene.center)[:4], np.asarray(scene.size)[:4]
    np.testing.assert_allclose(center[:, :2], printed[:, :2], atol=1e-6)
    np.testing.assert_allclose(np.asarray(scene.radius)[:4], 0.03)
    if reading == "columns":
        assert (np.asarray(scene.kind)[:4] == COLUMN).all()
        np.testing.assert_allclose(center[:, 2] + size[:, 2], 0.20, atol=1e-6)
        np.testing.assert_allclose(center[:, 2] - size[:, 2], 0.0, atol=1e-6)
        np.testing.assert_allclose(size[:, 0], 0.03)
        assert _line_clearance(scene) < 0  # the first column blocks the straight line
    else:
        assert (np.asarray(scene.kind)[:4] == SPHERE).all()
        np.testing.assert_allclose(center[:, 2], 0.20)
        np.testing.assert_allclose(size[:, 0], 0.03 if reading == "spheres" else 0.12)
        expected = 0.085 - 0.03 if reading == "spheres" else 0.085 - 0.12  # the nearest centre is 8.5 cm away
        assert _line_clearance(scene) == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize(("reading", "optimum"), [("columns", 0.7288), ("clearance", 0.7320)])
def test_shortest_ways_are_the_known_ones(reading, optimum):
    """Tangent, arc, tangent about the first obstacle: 72.88 cm beside the column, 73.20 cm at 12 cm from the centre."""
    scene = robotica(reading, jnp.float64)
    flat = 2 if reading == "columns" else 3  # a column is passed in plan, and the height changes evenly
    start, goal, center = (np.asarray(v)[:flat] for v in (scene.start, scene.goal, scene.center[0]))
    r = float(scene.size[0, 0])
    u, v = start - center, goal - center
    a, b = np.linalg.norm(u), np.linalg.norm(v)
    arc = np.arccos(u @ v / (a * b)) - np.arccos(r / a) - np.arccos(r / b)
    assert arc > 0
    length = np.sqrt(a**2 - r**2) + np.sqrt(b**2 - r**2) + r * arc
    climb = 0.0 if flat == 3 else float(scene.goal[2] - scene.start[2])
    assert np.hypot(length, climb) == pytest.approx(optimum, abs=1.5e-4)


def test_hri_waypoints():
    scene = hri()
    np.testing.assert_allclose(scene.start, [0, 0.53, 0.25])
    np.testing.assert_allclose(scene.goal, [-0.53, 0.03, 0.25])
    assert not np.asarray(scene.mask).any()


@pytest.mark.parametrize("seed", range(12))
def test_clutter_keeps_its_promises(seed):
    scene = clutter(seed, jnp.float64)
    n = int(np.asarray(scene.mask).sum())
    assert 6 <= n <= 12
    center, size, kind = (np.asarray(v)[:n] for v in (scene.center, scene.size, scene.kind))
    for end in (scene.start, scene.goal):
        assert float(scene_distance(scene, end, table=False)) > 0.1
        assert (np.asarray(end) > np.asarray(scene.lower)).all() and (np.asarray(end) < np.asarray(scene.upper)).all()
        assert 0.5 <= np.hypot(end[0], end[1]) <= 0.7
    for z in np.linspace(0, 0.4, 5):
        assert float(scene_distance(scene, jnp.asarray([0.0, 0.0, z]), table=False)) > 0.19
    hull = np.where(kind == BOX, np.hypot(size[:, 0], size[:, 1]), size[:, 0])
    apart = np.linalg.norm(center[:, None, :2] - center[None, :, :2], axis=-1) - hull[:, None] - hull
    assert (apart[~np.eye(n, dtype=bool)] > 0.12).all()
    height = np.where(kind == SPHERE, size[:, 0], size[:, 2])
    assert (center[:, 2] - height > -1e-9).all() and (center[:, 2] + height < 0.4 + 1e-9).all()
    assert (center[kind != SPHERE, 2] - height[kind != SPHERE] < 1e-9).all()  # these stand
    again = clutter(seed, jnp.float64)
    np.testing.assert_array_equal(scene.center, again.center)


def test_clutter_differs_by_seed_and_has_all_kinds():
    kinds = np.concatenate([np.asarray(clutter(seed).kind)[np.asarray(clutter(seed).mask)] for seed in range(4)])
    assert set(kinds.tolist()) == {SPHERE, COLUMN, BOX}
    assert not np.array_equal(clutter(0).start, clutter(1).start)


def test_registry_and_errors():
    assert list(SCENES) == ["robotica", "robotica-spheres", "robotica-clearance", "hri", "clutter"]
    shapes = None
    for name, entry in SCENES.items():
        scene = entry(1)
        assert entry.description and "\n" not in entry.description
        assert scene.start.dtype == jnp.float32
        now = [x.shape for x in (scene.kind, scene.center, scene.yaw, scene.mask)]
        assert shapes in (None, now)
        shapes = now
        np.testing.assert_array_equal(scene_named(name, 1).center, scene.center)
    np.testing.assert_array_equal(scene_named("robotica").kind, robotica("columns").kind)
    np.testing.assert_array_equal(scene_named("robotica-spheres").size, robotica("spheres").size)
    np.testing.assert_array_equal(scene_named("robotica-clearance").size, robotica("clearance").size)
    with pytest.raises(ValueError, match="unknown scene 'moon': accepted are robotica, robotica-spheres"):
        scene_named("moon")
    with pytest.raises(ValueError, match="unknown reading"):
        robotica("boxes")
    many = [Obstacle(SPHERE, (0.0, 0.0, 0.0), (0.1, 0.1, 0.1), 0.0, 0.1)] * 17
    with pytest.raises(ValueError, match="17 obstacles do not fit a scene of 16"):
        make_scene(many, (0.0,) * 3, (1.0,) * 3, (0.0,) * 3, (1.0,) * 3)
