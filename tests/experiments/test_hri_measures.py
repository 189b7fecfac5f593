"""The measures of the HRI experiment against closed forms: straight line, sine, circle, minimum-jerk reach."""

import jax.numpy as jnp
import numpy as np
import pytest

from experiments.hri.measures import Measured, at_rate, contacts, measured, share

DT = 0.008
T = np.arange(1001) * DT


def measures(tool: np.ndarray, **other: object) -> Measured:
    n = len(tool)
    given = {
        "qd": np.ones((n, 6)), "separation": np.full(n, 0.5), "clearance": np.full(n, 0.3), "arrivals": [2.0, 4.0],
        "probe_true": np.ones((3, 4)), "probe_known": np.ones((3, 4)), "gap": 0.03,
    }  # fmt: skip
    return measured(tool, dt=DT, **(given | other))  # type: ignore[arg-type]


def test_a_straight_line_at_constant_speed_has_neither_jerk_nor_curvature() -> None:
    found = measures(np.outer(T, [0.3, 0.4, 0.0]), arrivals=[2.0, 4.0, 6.0, 7.9])
    for name in ("variance_x", "variance_y", "variance_z", "total_jerk", "msj", "curvature", "variance_si", "msj_si"):
        assert getattr(found, name) < 1e-10, name
    assert found.curvature_si < 1e-6 and found.jerk_si < 1e-6
    assert found.cycle_time == pytest.approx(7.9 / 2) and found.leg_length == pytest.approx(0.5 * 7.9 / 4, rel=1e-3)
    assert found.legs == 4 and found.success


def test_a_sine_has_the_differences_of_a_sine() -> None:
    """The n-th difference of A sin(w t) at steps h has the amplitude A (2 sin(w h / 2))^n."""
    amplitude, w = 0.2, 2 * np.pi * 0.5  # whole periods in 8 s
    found = measures(np.stack([amplitude * np.sin(w * T), 0 * T, 0 * T], axis=1))
    step = 2 * np.sin(w * 0.25 / 2)
    # 31 and 30 differences are not whole periods of 8 samples: their mean squares are those of these samples
    second = -amplitude * step**2 * np.sin(w * 0.25 * np.arange(1, 32))
    third = -amplitude * step**3 * np.cos(w * 0.25 * (np.arange(30) + 1.5))
    assert found.variance_x == pytest.approx(second.var(), rel=1e-4)
    assert found.total_jerk == pytest.approx(np.abs(third).sum(), rel=1e-4)
    assert found.msj == pytest.approx((third**2).mean() / 3, rel=1e-4)
    assert found.msj_si == pytest.approx((amplitude * w**3) ** 2 / 2, rel=0.02)
    assert found.variance_si == pytest.approx((amplitude * w**2) ** 2 / 2, rel=0.02)
    assert found.jerk_si == pytest.approx(amplitude * w**3 * 2 / np.pi, rel=0.02)


def test_a_circle_has_constant_curvature_and_a_spiral_has_not() -> None:
    w = 1.0
    circle = 0.3 * np.stack([np.cos(w * T), np.sin(w * T), 0 * T], axis=1)
    assert measures(circle).curvature < 1e-4
    assert measures(circle).curvature_si < 1e-2
    # curvature of an ellipse with half axes a > b goes between b / a^2 and a / b^2, four times in a turn
    a, b = 0.3, 0.2
    one_turn = np.arange(int(2 * np.pi / DT) + 1) * DT
    ellipse = np.stack([a * np.cos(one_turn), b * np.sin(one_turn), 0 * one_turn], axis=1)
    swing = 4 * (a / b**2 - b / a**2) / (2 * np.pi)
    assert measures(ellipse).curvature_si == pytest.approx(swing, rel=0.02)


def test_where_the_tool_stands_there_is_no_curvature() -> None:
    rest = np.tile([[0.1, 0.2, 0.3]], (len(T), 1)) + 1e-6 * np.random.default_rng(0).normal(size=(len(T), 3))
    assert measures(rest).curvature == 0 and measures(rest).curvature_si == 0


def test_minimum_jerk_reach() -> None:
    """Its mean squared jerk over its duration D is 720 L^2 / D^6 (Flash and Hogan 1985)."""
    u = T / T[-1]
    reach = np.outer(10 * u**3 - 15 * u**4 + 6 * u**5, [0.5, 0.0, 0.0])
    found = measures(reach)
    assert found.msj_si == pytest.approx(
        720 * 0.25 / T[-1] ** 6, rel=0.03
    )  # the differences at both ends, the largest, are missing
    shaky = reach + 0.002 * np.sin(2 * np.pi * 3 * T)[:, None]
    assert found.sparc > measures(shaky).sparc  # nearer to 0
    assert measures(shaky).msj_si > 100 * found.msj_si


def test_resampling_keeps_a_cubic() -> None:
    x = np.stack([T**3, T, 0 * T], axis=1)
    slow = np.arange(33) / 4
    assert np.allclose(at_rate(jnp.asarray(x), DT, 4.0), np.stack([slow**3, slow, 0 * slow], axis=1), atol=1e-9)


def test_contacts_are_counted_by_touch_and_told_by_motion() -> None:
    separation = np.array([0.1, -0.01, -0.02, 0.1, -0.01, 0.2, -0.01])
    qd = np.zeros((7, 6))
    qd[2, 3] = 0.2
    assert contacts(separation, qd) == (1, 2)
    found = measures(np.outer(T[:7], [1.0, 0, 0]).repeat(30, 0), separation=np.repeat(separation, 30), qd=np.repeat(qd, 30, 0),
                     clearance=np.ones(210), arrivals=[0.5, 1.0])  # fmt: skip
    assert not found.success and found.contacts == 1


def test_recall_is_of_true_collisions() -> None:
    true = np.array([[-0.1, 0.0, 0.3, 0.4]])
    known = np.array([[0.02, 0.2, 0.01, 0.5]])
    found = measures(np.outer(T, [1.0, 0, 0]), probe_true=true, probe_known=known)
    assert found.recall == 0.5 and found.false_alarms == 0.5
    assert np.isnan(share(true < -1, true < -1))


def test_who_stands_to_the_end_is_not_quick() -> None:
    tool = np.outer(T, [1.0, 0, 0])
    assert measures(tool, arrivals=[2.0]).cycle_time == pytest.approx(2 * 8.008 / 2)
    never = measures(tool, arrivals=[])
    assert never.cycle_time == pytest.approx(2 * 8.008) and not never.success and np.isnan(never.leg_length)
