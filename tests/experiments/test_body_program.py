"""The measures of the program: places on surfaces, what is seen, and rows of made-up tracks."""

import numpy as np
import pytest

from experiments.body.rows import BARS, all_rows, definition, exchanges, holds, unnoticed
from experiments.body.truth import BOX, approach_speeds, axis_distance, exposed, seen_from, surface_places


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


def _case(wrong: slice, frames: int = 60) -> dict[str, np.ndarray]:
    compared = np.arange(0, frames, 4)
    error = np.full((len(compared), 6, 8), 0.01)
    error[wrong] = 0.3
    every, some = np.ones(frames, bool), np.ones(error.shape, bool)
    speed = np.zeros(len(compared))
    return {
        "clean": np.asarray(True), "frames": compared, "error": error, "outside": some, "visible": some, "tracked": every, "age": np.arange(frames) / 30 + 1,
        "explained": np.ones(frames), "exchanged": ~every, "seconds": np.full(frames, 0.002), "count": np.full(frames, 100),
        "region": speed, "true_region": speed, "sure": speed + 1, "speed": speed, "bound": speed + 0.5, "true_speed": speed,
        "true_most": speed, "point_speed": speed,
    }  # fmt: skip


def test_rows_of_a_good_track_hold_all_bars() -> None:
    rows = all_rows({"full": {"somebody": _case(slice(0, 0))}})
    assert set(BARS) <= set(rows)
    assert all(holds(name, entry["value"]) is not False for name, entry in rows.items())
    assert all(definition(name) != name for name in rows)


def test_a_wrong_track_that_counts_as_sure_and_exchanged_sides_are_found() -> None:
    case = _case(slice(3, 6))
    assert unnoticed(case) == 12
    case["exchanged"][30:] = True
    assert exchanges(case) == 1
    rows = all_rows({"full": {"somebody": case}, "cold": {"somebody": case}})
    assert holds("unnoticed_frames_max", rows["unnoticed_frames_max"]["value"]) is False
    assert holds("exchanges", rows["exchanges"]["value"]) is False
    assert rows["visible_error_p95_cold"]["value"] == pytest.approx(300)
