"""The measures of the program: places on surfaces, what is seen, and rows of made-up tracks."""

import numpy as np
import pytest

from experiments.body.rows import BARS, all_rows, definition, deviation_rows, exchanges, holds, sure_images, unnoticed
from experiments.body.run import with_other_parts
from experiments.body.truth import (
    BOX,
    approach_speeds,
    axis_distance,
    exposed,
    outside_places,
    part_speeds,
    seen_from,
    surface_places,
)


def test_places_lie_on_the_surface_and_all_around() -> None:
    a, b = np.array([0.2, 0.1, 0.3]), np.array([0.5, 0.2, 0.6])
    p = surface_places(a, b, 0.07)
    np.testing.assert_allclose(axis_distance(p, a, b), 0.07, atol=1e-9)
    assert np.linalg.norm(p.mean(0) - 0.5 * (a + b)) < 0.03


def test_a_place_behind_another_capsule_is_not_seen() -> None:
    a = np.array([[0.0, 0.0, 0.5], [1.0, 0.0, 0.5]])
    b, radius = a + np.array([0.0, 0.0, 0.3]), np.array([0.1, 0.1])
    p = np.array([[1.0 + 0.1, 0.0, 0.6], [1.0 - 0.1, 0.0, 0.6]])
    assert seen_from(p, np.array([3.0, 0.0, 0.6]), a, b, radius).tolist() == [True, False]
    assert seen_from(p, np.array([-3.0, 0.0, 0.6]), a, b, radius).tolist() == [False, False]
    assert exposed(p, a, b, radius, 1).all()
    assert not exposed(p + np.array([0.0, 0.0, BOX[1][2]]), a, b, radius, 1).any()


def test_approach_is_the_rate_of_the_distance() -> None:
    t = np.arange(12) / 30
    a = np.stack([1.0 - 0.5 * t, 0 * t, 0 * t], axis=1)[:, None]
    seen = {"a": a, "b": a + np.array([0.0, 0.0, 0.2]), "radius": np.full((12, 1), 0.1), "stamps": t}
    now, most = approach_speeds(seen, 4, np.zeros(3), 0.1)
    assert np.shape(now) == np.shape(most) == ()
    np.testing.assert_allclose([now, most], 0.5, atol=1e-6)


def deviations(images: int) -> dict[str, np.ndarray]:
    """Errors of parts as they are told: of a normal distribution."""
    draw = np.random.default_rng(0)
    told = draw.uniform(0.05, 0.2, (2, images, 10))
    error = told * draw.normal(size=told.shape)
    true = draw.normal(size=told.shape)
    return {
        "true_speeds": true[0], "speeds": true[0] + error[0], "deviations": told[0],
        "true_distances": true[1], "distances": true[1] + error[1], "place_deviations": told[1],
    }  # fmt: skip


def _case(wrong: slice, frames: int = 60) -> dict[str, np.ndarray]:
    compared = np.arange(0, frames, 4)
    error = np.full((len(compared), 6, 8), 0.01)
    error[wrong] = 0.3
    every, some = np.ones(frames, bool), np.ones(error.shape, bool)
    speed = np.zeros(len(compared))
    return {
        "clean": np.asarray(True), "frames": compared, "error": error, "outside": some, "visible": some, "tracked": every, "age": np.arange(frames) / 30 + 1,
        "explained": np.ones(frames), "exchanged": ~every, "clear": every, "seconds": np.full(frames, 0.002), "count": np.full(frames, 100),
        "region": speed, "true_region": speed, "sure": speed + 1, "speed": speed, "bound": speed + 0.5, "true_speed": speed,
        "true_most": speed, "point_speed": speed, "looked": compared, "wrong": ~every,
        "known": np.ones((len(compared), 10), bool), **deviations(len(compared)),
    }  # fmt: skip


def test_rows_of_a_good_track_hold_all_bars() -> None:
    rows = all_rows({"full": {"somebody": _case(slice(0, 0))}})
    assert set(BARS) <= set(rows)
    assert all(holds(name, entry["value"]) is not False for name, entry in rows.items())
    assert all(definition(name) != name for name in rows)


def test_a_wrong_track_that_counts_as_sure_and_exchanged_sides_are_found() -> None:
    case = _case(slice(3, 6))
    case["wrong"][[7, 20, 21, 22, 23, 24, 40, 41, 42, 43, 59]] = True
    assert unnoticed(case) == 5
    case["exchanged"][30:] = True
    assert exchanges(case) == exchanges(case, sure_images(case)) == 1
    dip = case | {"explained": np.where(np.arange(60) == 29, 0.8, 1.0)}  # one image before it
    assert exchanges(dip, sure_images(dip)) == 1
    anew = case | {
        "age": np.where(np.arange(60) < 30, 1.0 + np.arange(60) / 30, np.arange(60) / 30 + 0.1)
    }  # age falls: another track
    assert exchanges(anew) == 0 and exchanges(anew, anew=True) == 1
    assert exchanges(anew | {"tracked": np.arange(60) != 29}, anew=True) == 0
    quarter = case | {"clear": np.arange(60) < 30}
    assert exchanges(quarter) == 0 and exchanges(quarter, clear=False) == 1
    through = case | {"clear": abs(np.arange(60) - 30) > 4}
    assert exchanges(through) == 1
    young = case | {"age": np.arange(60) / 30}
    assert exchanges(young) == 1 and exchanges(young, sure_images(young)) == 0
    rows = all_rows({"full": {"somebody": case}, "cold": {"somebody": case}})
    assert holds("unnoticed_frames_max", rows["unnoticed_frames_max"]["value"]) is False
    assert holds("exchanges", rows["exchanges"]["value"]) is False
    assert rows["visible_error_p95_cold"]["value"] == pytest.approx(300)


def test_told_deviations_are_held_against_the_errors() -> None:
    case = _case(slice(0, 0), 800)
    rows = deviation_rows({"somebody": case})
    assert rows["speed_sigma_ratio"]["value"] == pytest.approx(1, abs=0.05)
    assert rows["speed_within_2_sigma"]["value"] == pytest.approx(0.954, abs=0.02)
    assert rows["place_within_2_sigma"]["value"] == pytest.approx(0.954, abs=0.02)
    wide = case | {"deviations": 4 * case["deviations"]}
    assert deviation_rows({"somebody": wide})["speed_sigma_ratio"]["value"] == pytest.approx(0.25, abs=0.02)
    far = case["speeds"].copy()
    far[:, 3] = 1e3
    unknown = case["known"].copy()
    unknown[:, 3] = False
    case |= {"speeds": far, "known": unknown}
    assert deviation_rows({"somebody": case})["speed_sigma_ratio"]["value"] == pytest.approx(1, abs=0.06)
    assert deviation_rows({"somebody": case | {"age": np.zeros(800)}}) == {}


def _walker() -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Fourteen capsules that go at their own speeds, and these."""
    draw = np.random.default_rng(1)
    t = np.arange(8) / 30
    v = draw.normal(size=(14, 3))
    a = draw.normal(size=(14, 3)) + t[:, None, None] * v
    still = np.zeros((8, 14, 3)) + 1e-6
    return {"a": a, "b": a + still, "radius": np.full((8, 14), 0.1), "stamps": t}, v


def test_speeds_of_parts_are_the_rates_of_their_distances() -> None:
    seen, v = _walker()
    x = np.array([5.0, 4.0, 3.0])
    speeds, distances = part_speeds(seen, 4, x)
    u = x - seen["a"][4]
    size = np.linalg.norm(u, axis=1)
    np.testing.assert_allclose(speeds, (v * u).sum(1)[:10] / size[:10], atol=1e-3)
    np.testing.assert_allclose(distances, size[:10] - 0.1, atol=1e-5)


def test_nobody_has_no_places() -> None:
    seen, _ = _walker()
    assert not outside_places(seen | {"radius": np.full((8, 14), -1.0)}, 4)[1].any()


def test_rows_of_a_part_that_is_not_run_stay() -> None:
    def one(value: float) -> dict[str, float | str]:
        return {"value": value, "unit": "1"}

    before = {"region_right": one(0.1), "gone": one(0.2), "stopped_time_ratio": one(0.3), "red_time_body": one(0.4)}
    track, loop = {"region_right": one(0.9)}, {"stopped_time_ratio": one(0.7)}
    kept = with_other_parts(before, track, {})
    assert list(kept) == ["region_right", "stopped_time_ratio", "red_time_body"]
    assert kept["region_right"] == one(0.9) and kept["stopped_time_ratio"] == one(0.3)
    assert list(with_other_parts(before, {}, loop)) == ["region_right", "gone", "stopped_time_ratio"]
    assert with_other_parts({}, track, loop) == track | loop
