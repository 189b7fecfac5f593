"""Measures, rows and page of the functions beside people, on motions that are known."""

import numpy as np
import pytest

from experiments.interact.config import InteractConfig
from experiments.interact.measures import (
    contacts,
    follow_measures,
    give_way_measures,
    hand_over_measures,
    keep_away_measures,
)
from experiments.interact.page import page
from experiments.interact.people import GIVES_UP
from experiments.interact.rows import all_rows

DT = 0.008
ENDS = np.array([[0.0, 0.5, 0.25], [-0.5, 0.0, 0.25]])
UP = np.array([0.0, 0.0, 1.0])


def case_of(ticks: int, **given) -> dict[str, np.ndarray]:
    """A run in which nothing happens, but for what is given."""
    still = {
        "tool": np.tile([0.3, 0.2, 0.5], (ticks, 1)), "qd": np.zeros((ticks, 6)), "separation_true": np.full(ticks, 1.0),
        "tool_distance": np.full(ticks, 1.0), "hand_true": np.zeros((ticks, 3)), "hand_radius": np.asarray(0.1),
        "axis": np.tile(-UP, (ticks, 1)), "active": np.ones(ticks), "zone": np.zeros(ticks, int), "approach": np.zeros(ticks),
        "speed_limit": np.full(ticks, 1.0), "fastest": np.zeros(ticks), "person": np.full(ticks, 10.0),
    }  # fmt: skip
    return still | given


def test_the_error_of_following_is_the_distance_to_the_place_beside_the_true_hand() -> None:
    t = np.arange(1250) * DT
    hand = np.stack([0.3 * t, 0 * t, 0.2 + 0 * t], axis=1)  # 0.3 m/s
    off = np.array([0.03, 0.0, 0.0])
    case = case_of(len(t), hand_true=hand, tool=hand + 1.0 * UP + off)  # 0.1 of the hand and 0.9 m
    found = follow_measures("follow", case, UP, DT)
    np.testing.assert_allclose(found["error"], 0.03, atol=1e-9)
    assert len(found["error"]) == 750 and len(found["fast"]) == 750  # after 4 s, all of them fast
    np.testing.assert_allclose(found["distance"], np.hypot(1.0, 0.03) - 1.0, atol=1e-9)
    slow = case_of(len(t), hand_true=hand / 3, tool=hand / 3 + UP)
    assert len(follow_measures("follow", slow, UP, DT)["fast"]) == 0


def test_a_handover_is_held_from_when_it_is_reached() -> None:
    t = np.arange(1250) * DT
    place, x = 0.55 * UP, np.array([1.0, 0.0, 0.0])  # 0.45 m, and the hand's radius
    tool = np.where((t < 2)[:, None], place + 0.5 * x, place + 0.01 * x)
    tool = np.where((abs(t - 4) < 0.25)[:, None], place + 0.05 * x, tool)
    active = (t < GIVES_UP + 0.3).astype(float)
    found = hand_over_measures("hand_over", case_of(len(t), tool=tool, active=active), UP, DT)
    assert found["reached"] == pytest.approx(2.0, abs=2 * DT)
    assert found["held"] == pytest.approx(1 - 0.5 / (GIVES_UP - 2.0), abs=0.01)
    assert found["error"] == pytest.approx(0.01, abs=1e-9) and found["angle"] == pytest.approx(0.0, abs=1e-6)
    assert found["withdrawn"] == pytest.approx(0.3, abs=2 * DT)


def way_back(step: float) -> dict[str, np.ndarray]:
    """Refuge, and a way back in which the tool's velocity jumps once; then one end of the task and the other."""
    ticks = 2000
    active = np.ones(ticks)
    active[:200] = np.linspace(0, 1, 200)
    active[600:1100] = np.linspace(1, 0, 500)
    active[1100:] = 0
    v = np.zeros((ticks, 3))
    v[800:1000, 0] = step  # a jump at tick 800, and one at 1000
    tool = np.array([0.3, 0.2, 0.5]) + np.cumsum(v, axis=0) * DT
    tool[1300:1600], tool[1600:] = ENDS[1], ENDS[0]
    return case_of(ticks, active=active, tool=tool)


def test_a_jump_on_the_way_back_is_found_where_the_function_has_the_say() -> None:
    found = give_way_measures(way_back(0.02), ENDS, DT)
    assert found["step"] == pytest.approx(0.02, rel=1e-6) and found["limited_step"] == 0
    assert found["resumes"] == 1 and found["turns"] == 2 and found["done"] == 1.0
    stopped = way_back(0.02)
    stopped["zone"][790:1010] = 3
    found = give_way_measures(stopped, ENDS, DT)
    assert found["step"] == 0 and found["limited_step"] == pytest.approx(0.02, rel=1e-6)
    assert found["stopped"] == pytest.approx(220 * DT)
    near = way_back(0.0)
    near["person"][-100:] = 0.2  # somebody is still in the way
    assert np.isnan(give_way_measures(near, ENDS, DT)["done"])


def test_touches_of_a_moving_arm_and_of_a_standing_one() -> None:
    case = case_of(100)
    case["separation_true"][20:30] = -0.01
    case["separation_true"][60:70] = -0.01
    case["qd"][65, 2] = 0.2
    assert contacts(case) == (1, 1)


def test_keeping_away_falls_short_where_a_person_is_near() -> None:
    d = np.full(1250, 1.0)
    d[500:625] = 0.5
    found = keep_away_measures(case_of(1250, tool_distance=d), 0.7, DT)
    assert found["least"] == 0.5 and found["share"] == pytest.approx(0.125) and found["gone"] == 1.0
    assert found["short"] == pytest.approx(0.2)


def test_rows_and_page_say_which_bars_are_missed() -> None:
    cases = {"give_way": {"reach_in 0": way_back(0.02)}, "give_way_off": {"reach_in 0": way_back(0.0)}}
    rows = all_rows(cases, {}, ENDS, DT)
    assert rows["resume_jump"]["value"] == pytest.approx(0.02 / DT)
    assert rows["resume_jump_off"]["value"] == 0 and rows["yield_done"]["value"] == 1.0
    text = page(rows, cases, InteractConfig(), [])
    assert (
        "| resume_jump | 2.5 | 1 | <= 1 (missed) |" in text
        and "(missed)" not in text.split("| yield_done |")[1].split("\n")[0]
    )
    assert "In no run did arm and person touch." in text
