"""Rows of the gradient over the horizon: what agrees, what does not, what is not a number."""

import numpy as np
import pytest

from experiments.benchmark.horizon import compared, run

SLOPE = np.array([[1.0, -2.0, 0.0], [4.0, 0.5, 1e-3]])
CROSSED = SLOPE.copy()
CROSSED[1, 0] += 0.3  # a switch between the two points
DIFFERENCE = np.stack([CROSSED, SLOPE])


def values(found: dict) -> dict:
    return {name: row["value"] for name, row in found.items()}


def test_equal_derivatives_agree_and_a_wrong_sign_does_not() -> None:
    same = values(compared(10, SLOPE * (1 + 5e-4), DIFFERENCE))
    assert same["within_10_s"] == 1 and same["error_10_s"] == pytest.approx(5e-4) and same["not_finite_10_s"] == 0
    assert same["norm_10_s"] == pytest.approx(np.linalg.norm(SLOPE.mean(axis=0)), rel=1e-3)
    wrong = SLOPE.copy()
    wrong[0, 1] *= -1
    found = values(compared(10, wrong, DIFFERENCE))
    assert found["error_10_s"] == 2 and found["within_10_s"] == pytest.approx(5 / 6)


def test_what_is_no_number_is_counted_and_agrees_with_nothing() -> None:
    broken = SLOPE.copy()
    broken[1, 2] = np.nan
    found = values(compared(1, broken, DIFFERENCE))
    assert found["not_finite_1_s"] == 1 and np.isinf(found["error_1_s"]) and found["within_1_s"] == pytest.approx(5 / 6)


def test_every_horizon_has_its_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("experiments.benchmark.horizon.slopes", lambda seconds: (SLOPE, DIFFERENCE))
    assert set(run((1, 30))) == {
        f"{name}_{end}" for name in ("error", "within", "norm", "not_finite") for end in ("1_s", "30_s")
    }
