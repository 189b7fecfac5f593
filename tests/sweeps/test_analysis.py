"""Indices of a run with known answers: line ranges, distinct outcomes, the place of the best, rows by name."""

import numpy as np
import pytest
import xarray as xr

from hrcjax.sweeps.analysis import (
    KnobEffects,
    analysis_rows,
    best_inside_axes,
    distinct_share,
    effects_of,
    knob_effects,
    line_range,
    success_share,
)

K_ATT, K_REP, ZETA = np.geomspace(0.01, 0.1, 4), np.geomspace(1e-6, 1e-3, 5), np.linspace(1.5, 4.5, 3)
U, V, W = np.meshgrid(np.linspace(0, 1, 4), np.linspace(0, 1, 5), np.linspace(0, 1, 3), indexing="ij")
LENGTH = 1 + 3 * U + 1 * V
"""Additive: K_att has three quarters of the range, K_rep one, zeta none."""


def run(status: np.ndarray | None = None, worlds: int = 1, **metrics: np.ndarray) -> xr.Dataset:
    """A run on the grid, by default with all settings successful and alike in every world."""
    dims = ("scene", "person", "seed", "k_att", "k_rep", "zeta")

    def stored(values: np.ndarray) -> np.ndarray:
        return np.broadcast_to(values, (1, 1, worlds, *U.shape)).copy()

    better = {"time_to_goal": "low", "tool_length": "low"}
    variables = {k: (dims, stored(v), {"better": better.get(k, "high"), "units": "1"}) for k, v in metrics.items()}
    variables["status"] = (dims, stored(np.zeros(U.shape, int) if status is None else status), {})
    coords = {
        "k_att": ("k_att", K_ATT, {"parameter": "potential.k_att", "alias": "K_att"}),
        "k_rep": ("k_rep", K_REP, {"parameter": "potential.k_rep", "alias": "K_rep"}),
        "zeta": ("zeta", ZETA, {"parameter": "potential.zeta", "alias": "zeta"}),
    }
    return xr.Dataset(variables, coords, {"rank": "score_sound"})


def test_line_ranges_of_an_additive_function() -> None:
    effects = knob_effects(run(score_sound=50 + LENGTH, tool_length=LENGTH))
    assert (effects.knobs, effects.metrics) == (["K_att", "K_rep", "zeta"], ["score_sound", "tool_length"])
    np.testing.assert_allclose(effects.line_range, [[0.75, 0.75], [0.25, 0.25], [0, 0]], atol=1e-12)


def test_line_ranges_are_medians_over_lines() -> None:
    """x y^2 on 0, 1: along x the range is y^2; of the lines at y = 0, 1/4, 1/2, 3/4, 1 the median is a quarter."""
    effects = knob_effects(run(score_sound=U * V**2))
    np.testing.assert_allclose(effects.line_range[:, 0], [0.25, (1 / 3 + 2 / 3) / 2, 0], atol=1e-12)


def test_line_range_by_hand_with_failures() -> None:
    values = np.array([[0.0, 5.0, 9.0], [2.0, 3.0, 7.0], [99.0, 4.0, 99.0]])
    good = np.array([[True, True, False], [True, True, True], [False, True, False]])
    np.testing.assert_allclose(line_range(values, 1, good), [5 / 7, 5 / 7])  # the last row has one point
    np.testing.assert_allclose(line_range(values, 0, good), [2 / 7, 2 / 7])  # so has the last column
    assert line_range(values, 0, np.zeros((3, 3), bool)).size == 0
    np.testing.assert_array_equal(line_range(np.ones((2, 2)), 0, np.ones((2, 2), bool)), [0, 0])
    np.testing.assert_array_equal(line_range(1 + 1e-8 * np.eye(2), 0, np.ones((2, 2), bool)), [0, 0])


def test_failed_settings_do_not_count() -> None:
    """The upper half of K_rep fails, with wild values: what is left has no effect of K_rep within rounding."""
    bad = V > 0.6
    wild = np.where(bad, 1e3 * V, 3 * U)
    effects = knob_effects(run(bad.astype(int), score_sound=wild))
    np.testing.assert_allclose(effects.line_range[:, 0], [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(effects.first[:, 0], [1, 0, 0], atol=1e-9)
    np.testing.assert_allclose(effects.total[:, 0], [1, 0, 0], atol=1e-9)


def test_sobol_indices_of_an_additive_function() -> None:
    effects = knob_effects(run(score_sound=LENGTH))
    share = np.var(3 * U) / np.var(LENGTH)
    np.testing.assert_allclose(effects.first[:, 0], [share, 1 - share, 0], atol=1e-12)
    np.testing.assert_allclose(effects.total[:, 0], effects.first[:, 0], atol=1e-12)


def test_worlds_are_analysed_by_themselves() -> None:
    """A large offset between two worlds is no effect of a knob, and hides none."""
    two = run(worlds=2, score_sound=LENGTH)
    two.score_sound[0, 0, 1] += 1000
    np.testing.assert_allclose(knob_effects(two).line_range, knob_effects(run(score_sound=LENGTH)).line_range)
    np.testing.assert_allclose(knob_effects(two).first, knob_effects(run(score_sound=LENGTH)).first, atol=1e-9)


def test_distinct_outcomes() -> None:
    """Sixty settings; differences below the rounding, or among the failed, do not count."""
    same = run(score_sound=50 + 1e-4 * U, tool_length=1 + 1e-5 * V, clearance=np.full(U.shape, np.nan))
    assert distinct_share(same, "score_sound") == pytest.approx(1 / 60)
    some = run(score_sound=50 + 0 * U, tool_length=1 + 0.009 * U, time_to_goal=5 + 0.4 * V)
    assert distinct_share(some, "score_sound") == pytest.approx(4 * 5 / 60)
    scores = run(score_sound=50 * 1.01 ** (U * 3), tool_length=1 + 0 * U)
    assert distinct_share(scores, "score_sound") == pytest.approx(4 / 60)
    half = run((W < 0.6).astype(int), score_sound=50 + 10 * U + V, tool_length=LENGTH)
    assert distinct_share(half, "score_sound") == 1 and success_share(half) == pytest.approx(1 / 3)
    assert np.isnan(distinct_share(run(np.ones(U.shape, int), score_sound=LENGTH), "score_sound"))


def test_axes_in_which_the_best_is_inside() -> None:
    def peak(u: float, v: float, w: float) -> int:
        return best_inside_axes(run(score_sound=-((U - u) ** 2) - (V - v) ** 2 - (W - w) ** 2), "score_sound")

    assert [peak(0.3, 0.5, 0.5), peak(0.3, 0.5, 1.0), peak(0, 0.25, 0), peak(1, 1, 0)] == [3, 2, 1, 0]
    inside = -((U - 0.3) ** 2) - (V - 0.5) ** 2 - (W - 0.5) ** 2
    assert best_inside_axes(run(np.ones(U.shape, int), score_sound=inside), "score_sound") == 0


def test_rows_by_name() -> None:
    results = run(score_sound=LENGTH, clearance=np.full(U.shape, np.nan), tool_length=LENGTH)
    rows = analysis_rows(results, "score_sound", effects_of(results, "score_sound"))
    assert rows["line_range_K_att_tool_length"] == {"value": pytest.approx(0.75), "unit": "1"}
    expected = {f"{kind}_{knob}_{metric}" for kind in ("line_range", "sobol_first", "sobol_total")
                for knob in ("K_att", "K_rep", "zeta") for metric in ("score_sound", "tool_length")}  # fmt: skip
    assert set(rows) == expected | {"success_share", "distinct_share", "best_inside_axes"}


def test_all_failed_and_samples_give_what_they_can() -> None:
    failed = run(np.ones(U.shape, int), score_sound=LENGTH)
    assert effects_of(failed, "score_sound") is None
    rows = analysis_rows(failed, "score_sound", None)
    assert {name: row["value"] for name, row in rows.items()} == {"success_share": 0.0, "best_inside_axes": 0.0}
    sample = xr.Dataset(
        {"score_sound": (("scene", "person", "seed", "sample"), [[[[1.0, 2.0]]]], {"better": "high"}),
         "status": (("scene", "person", "seed", "sample"), [[[[0, 0]]]])}
    )  # fmt: skip
    assert effects_of(sample, "score_sound") is None
    assert set(analysis_rows(sample, "score_sound", None)) == {"success_share", "distinct_share"}
    with pytest.raises(ValueError, match="full grid is needed"):
        knob_effects(sample)


def test_axes_with_one_value_are_no_knobs() -> None:
    effects = knob_effects(run(score_sound=LENGTH).isel(zeta=[1]))
    assert isinstance(effects, KnobEffects) and effects.knobs == ["K_att", "K_rep"]
    np.testing.assert_allclose(effects.line_range[:, 0], [0.75, 0.25])
