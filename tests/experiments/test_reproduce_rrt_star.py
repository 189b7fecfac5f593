"""RRT* of OMPL as the program runs it: free paths, the same for the same seed, shorter with more iterations."""

import numpy as np
import pytest

from experiments.reproduce.paths import clearance, even
from experiments.reproduce.printed import GOAL, START, TIMES
from experiments.reproduce.readings import row_scene
from experiments.reproduce.rrt_star import CHECK, STAGES, free_of, rrt_case

pytest.importorskip("ompl")

ROW = next(row for row in TIMES if row.key == "I.4")


@pytest.mark.parametrize("reading", ["spheres", "columns", "clearance"])
def test_the_check_is_the_distance(reading: str) -> None:
    free, scene = free_of(reading, ROW), row_scene(reading, ROW)
    middles = np.asarray(scene.center)[np.arange(300) % 4]
    points = middles + np.random.default_rng(0).uniform(-0.05, 0.05, (300, 3))
    gaps = np.array([clearance(point[None], scene) for point in points])
    sure = np.abs(gaps) > 1e-9
    np.testing.assert_array_equal([free(*point) for point in points[sure]], gaps[sure] > 0)
    assert (gaps < 0).sum() > 20


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
