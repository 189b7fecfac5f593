"""The front by definition, and its picture."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from matplotlib.colors import to_hex

from hrcjax.viz.front import pareto_mask
from hrcjax.viz.pareto import pareto_figure
from hrcjax.viz.style import INFEASIBLE

NAMES = ["length", "bending_energy", "clearance"]


def by_definition(values: np.ndarray, better: tuple[str, ...]) -> list[bool]:
    """Row by row, in plain words."""
    rows = [[x if side == "low" else -x for x, side in zip(row, better, strict=True)] for row in values]
    beats = lambda a, b: all(x <= y for x, y in zip(a, b, strict=True)) and a != b  # noqa: E731
    return [all(np.isfinite(b)) and not any(all(np.isfinite(a)) and beats(a, b) for a in rows) for b in rows]


VALUES = st.one_of(
    st.integers(0, 3).map(float),
    st.integers(0, 3).map(float),
    st.floats(-1, 1),
    st.sampled_from([0.0, -0.0, np.nan, np.inf]),
)


@settings(deadline=None, max_examples=150)
@given(st.data(), st.integers(1, 5), st.sampled_from([2, 3, 512]))
def test_front_by_definition(data: st.DataObject, columns: int, block: int) -> None:
    """Ties, equal rows and values that are not finite, in blocks smaller than the rows."""
    values = data.draw(arrays(float, st.tuples(st.integers(0, 14), st.just(columns)), elements=VALUES))
    better = data.draw(st.tuples(*[st.sampled_from(["low", "high"])] * columns))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hrcjax.viz.front.BLOCK", block)
        assert pareto_mask(values, better).tolist() == by_definition(values, better)


@pytest.mark.parametrize("columns", [2, 3, 4])
def test_a_large_front_by_definition(columns: int) -> None:
    """Points of a sphere, none of which beats another, and what lies behind some of them."""
    rng = np.random.default_rng(columns)
    sphere = np.abs(rng.normal(size=(1500, columns)))
    sphere = -sphere / np.linalg.norm(sphere, axis=1, keepdims=True)
    behind = sphere[:700] + rng.random((700, columns)) + 1e-9
    order = rng.permutation(2200)
    expected = np.arange(2200) < 1500
    assert (pareto_mask(np.concatenate([sphere, behind])[order], ["low"] * columns) == expected[order]).all()


def test_rows_that_are_not_finite_are_never_on_the_front() -> None:
    values = np.array([[1.0, 1.0], [np.nan, 0.0], [0.0, -np.inf], [2.0, 2.0]])
    assert pareto_mask(values, ["low", "low"]).tolist() == [True, False, False, False]


def test_sums_that_round_to_the_same_do_not_hide_a_better_row() -> None:
    values = np.array([[1e20, 2.0], [1e20, 1.0]])
    assert pareto_mask(values, ["low", "low"]).tolist() == [False, True]


def test_wrong_sides_are_refused() -> None:
    for better in (["low"], ["low", "up"]):
        with pytest.raises(ValueError, match="'low' or 'high' for each of 2 columns"):
            pareto_mask(np.zeros((1, 2)), better)


def test_figure_shows_every_setting_once_in_each_panel() -> None:
    rng = np.random.default_rng(0)
    values = rng.random((50, 3))
    feasible = values[:, 0] > 0.2
    figure, panels = pareto_figure(
        values,
        ["length", "bending_energy", "clearance"],
        ["m", "1/m", "m"],
        ["low", "low", "high"],
        feasible,
        {"best": 3},
    )
    front = pareto_mask(values[feasible], ["low", "low", "high"])
    for axes in panels:
        failed, beaten, best = axes.collections[:3]
        assert len(failed.get_offsets()) == (~feasible).sum()
        assert to_hex(failed.get_facecolor()[0]) == INFEASIBLE
        assert (len(beaten.get_offsets()), len(best.get_offsets())) == ((~front).sum(), front.sum())
    assert panels[0].get_xlabel() == "length [m] (lower is better)"
    assert panels[2].get_ylabel() == "clearance [m] (higher is better)"
    assert f"{front.sum()} of {feasible.sum()}" in figure.get_suptitle()
    np.testing.assert_allclose(panels[1].collections[2].get_offsets(), values[feasible][front][:, [0, 2]])
    np.testing.assert_allclose(panels[1].collections[2].get_array(), values[feasible][front][:, 1])
    assert panels[0].lines[0].get_xydata().tolist() == [values[3, :2].tolist()]


def test_figure_of_failures_alone() -> None:
    values = np.full((4, 3), np.nan)
    values[1] = 1.0, 2.0, 3.0  # failed, but finite: shown in grey
    figure, panels = pareto_figure(values, ["a", "b", "c"], ["1"] * 3, ["low"] * 3, np.zeros(4, bool))
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]
    assert "0 of 0" in figure.get_suptitle()
    for axes, place in zip(panels, ([1, 2], [1, 3], [2, 3]), strict=True):
        failed, beaten, best = axes.collections[:3]
        assert failed.get_offsets().tolist() == [place]
        assert len(beaten.get_offsets()) == len(best.get_offsets()) == 0
