"""RRT* of OMPL as the program runs it: free paths, the same for the same seed, shorter with more iterations."""

import numpy as np
import pytest

from experiments.reproduce.paths import clearance, even
from experiments.reproduce.printed import GOAL, START, TIMES
from experiments.reproduce.readings import row_scene
from experiments.reproduce.rrt_star import CHECK, STAGES, free_of, rrt_case

pytest.importorskip("ompl")

ROW = next(row for row in TIMES if row.key == "I.4")


@pytest.mark.parametrize(("reading", "spread"), [("spheres", 0.05), ("columns", 0.12), ("clearance", 0.13)])
def test_the_check_is_the_distance(reading: str, spread: float) -> None:
    free, away, scene = free_of(reading, ROW), free_of(reading, ROW, 0.02), row_scene(reading, ROW)
    middles = np.asarray(scene.center)[np.arange(1000) % 4]
    points = middles + np.random.default_rng(0).uniform(-spread, spread, (1000, 3))
    gaps = np.array([clearance(point[None], scene) for point in points])
    for check, margin in ((free, 0.0), (away, 0.02)):
        sure = np.abs(gaps - margin) > 1e-9
        np.testing.assert_array_equal([check(*point) for point in points[sure]], gaps[sure] > margin)
    assert (gaps < 0).sum() > 20 and ((gaps > 0) & (gaps < 0.02)).sum() > 10 and (gaps > 0.02).sum() > 10


def test_paths_are_free_repeat_and_shorten() -> None:
    found, again = (rrt_case("columns", ROW, 2, 600) for _ in range(2))
    np.testing.assert_array_equal(found["path"], again["path"])
    assert found["length"][0] != found["length"][1]
    scene = row_scene("columns", ROW)
    for path, length, best in zip(found["path"], found["length"], found["best"], strict=True):
        np.testing.assert_allclose(path[0], np.array(START) / 100)
        np.testing.assert_allclose(path[-1], np.array(GOAL) / 100, atol=1.1e-3)
        assert clearance(even(path, 2000), scene) > -CHECK  # edges are checked at steps of CHECK
        assert length > 0.7289  # the least way round O1
        assert best[0] >= best[1] >= length - 1e-9 and np.isinf(best[2]) and STAGES[1] <= 600 < STAGES[2]


def test_a_margin_is_kept_and_costs_way() -> None:
    near, far = rrt_case("columns", ROW, 1, 600), rrt_case("columns", ROW, 1, 600, 0.04)
    scene = row_scene("columns", ROW)
    assert clearance(even(far["path"][0], 2000), scene) > 0.04 - CHECK > clearance(even(near["path"][0], 2000), scene)
    assert far["length"][0] > 0.7289
