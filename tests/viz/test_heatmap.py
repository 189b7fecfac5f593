"""Cells lie where their settings are, the best one is marked, gaps are grey."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.contour import ContourSet

from hrcjax.viz.heatmap import GridAxis, best_cell, cell_edges, curve, heat_maps, sample_map
from hrcjax.viz.style import MISSING

X = GridAxis("k_att", np.array([0.01, 0.1, 1.0]), True)
Y = GridAxis("k_rep", np.array([1.0, 2.0]), False, "m^2")
PANEL = GridAxis("zeta", np.array([2.0, 4.0, 6.0, 8.0, 10.0]))


@settings(deadline=None, max_examples=30)
@given(st.lists(st.integers(1, 10_000).map(lambda n: n / 100), min_size=1, max_size=8, unique=True), st.booleans())
def test_edges_enclose_their_values(values: list[float], log: bool) -> None:
    centers = np.sort(np.array(values))
    edges = cell_edges(centers, log)
    assert len(edges) == len(centers) + 1
    assert (edges[:-1] < centers).all() and (centers < edges[1:]).all()


def test_edges_are_half_way_on_their_scale() -> None:
    np.testing.assert_allclose(cell_edges(np.array([1.0, 2.0, 4.0])), [0.5, 1.5, 3.0, 5.0])
    np.testing.assert_allclose(cell_edges(np.array([1.0, 100.0]), log=True), [0.1, 10.0, 1000.0])
    np.testing.assert_allclose(cell_edges(np.array([4.0])), [2.0, 6.0])
    np.testing.assert_allclose(cell_edges(np.array([0.0])), [-0.5, 0.5])


def test_best_cell_skips_what_is_not_finite() -> None:
    values = np.array([[3.0, np.nan], [1.0, np.inf]])
    assert best_cell(values, "low") == (1, 0)
    assert best_cell(values, "high") == (0, 0)
    assert best_cell(values, "") is None
    assert best_cell(np.full((2, 2), np.nan), "low") is None


def test_maps_have_one_scale_and_each_value_in_its_cell() -> None:
    values = np.arange(30.0).reshape(3, 2, 5)
    values[0, 1, 2] = np.nan
    figure, panels = heat_maps(values, X, Y, PANEL, "length", "m", "high", "toy")
    assert len(panels) == 5
    for i, axes in enumerate(panels):
        mesh = axes.collections[0]
        np.testing.assert_array_equal(np.ma.filled(mesh.get_array(), np.nan), values[:, :, i].T)
        assert mesh.get_clim() == (0, 29)
        assert (axes.get_xscale(), axes.get_yscale()) == ("log", "linear")
        assert axes.get_title() == rf"$\zeta$ = {PANEL.values[i]:.3g}"
    stars = [(i, line) for i, axes in enumerate(panels) for line in axes.lines]
    assert [(i, line.get_xydata().tolist()) for i, line in stars] == [(4, [[1.0, 2.0]])]
    assert panels[0].get_ylabel() == "$K_{rep}$" and panels[4].get_xlabel() == "$K_{att}$"
    bar = figure.axes[-1]
    assert bar.get_ylabel() == "length [m]"
    assert "toy" in figure.get_suptitle() and "best" in figure.get_suptitle()
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]
    bad = panels[2].collections[0].get_cmap().get_bad()
    assert np.allclose(bad[:3], np.array([int(MISSING[i : i + 2], 16) / 255 for i in (1, 3, 5)]))


def hatched(axes: Axes) -> list[list[float]]:
    """Middles of the hatched cells."""
    paths = [path for part in axes.collections if part.get_gid() == "failed" for path in part.get_paths()]
    return [path.vertices[:4].mean(axis=0).tolist() for path in paths]


@pytest.mark.parametrize(
    ("low", "high"), [(0.03, 0.2), (0.3, 0.9), (1.0, 9.0), (1e-6, 1e-3), (0.11, 0.19), (0.9, 1.1), (99.0, 101.0)]
)
def test_numbers_of_a_logarithmic_axis_do_not_overlap(low: float, high: float) -> None:
    x = GridAxis("k_att", np.geomspace(low, high, 16), True)
    figure, panels = heat_maps(np.zeros((16, 2, 4)), x, Y, GridAxis("zeta", np.arange(4.0)), "score")
    figure.draw_without_rendering()
    shown = panels[0].get_xaxis()
    texts = [text for text in (*shown.get_ticklabels(), *shown.get_ticklabels(minor=True)) if text.get_text()]
    left, right = shown.get_view_interval()
    boxes = sorted(
        t.get_window_extent().extents[[0, 2]].tolist() for t in texts if left <= t.get_position()[0] <= right
    )
    assert len(boxes) >= 2 and all(one[1] < other[0] for one, other in pairwise(boxes))


def test_settings_that_failed_are_hatched_and_never_best() -> None:
    values = np.arange(6.0).reshape(3, 2, 1)
    failed = np.zeros((3, 2, 1), bool)
    failed[2, 1] = failed[0, 1] = True
    x = GridAxis("a", np.array([1.0, 2.0, 3.0]))
    figure, (axes,) = heat_maps(values, x, Y, PANEL._replace(values=np.ones(1)), "length", "m", "high", "", failed)
    np.testing.assert_allclose(hatched(axes), [[1.0, 2.0], [3.0, 2.0]])
    assert axes.collections[-1].get_hatch()
    assert axes.lines[0].get_xydata().tolist() == [[3.0, 1.0]]
    assert figure.get_suptitle() == "length  (★ best, hatched: failed)"
    assert axes.collections[0].get_clim() == (0, 4), "what failed does not stretch the colours"


def test_where_all_failed_the_values_are_seen_below_the_hatching() -> None:
    values, failed = np.arange(6.0).reshape(3, 2, 1), np.ones((3, 2, 1), bool)
    figure, (axes,) = heat_maps(values, X, Y, PANEL._replace(values=np.ones(1)), "length", "m", "high", "", failed)
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]
    assert len(hatched(axes)) == 6 and axes.collections[0].get_clim() == (0, 5) and not axes.lines
    assert axes.collections[-1].get_facecolor().size == 0


def test_contours_are_at_their_values() -> None:
    """Of x + y the lines of equal value are straight; none where a setting failed, none on a coarse grid."""
    x, y = GridAxis("a", np.arange(6.0)), GridAxis("b", np.arange(5.0))
    values = (x.values[:, None] + y.values)[..., None]
    failed = np.zeros(values.shape, bool)
    failed[0, 0] = True
    _, (axes,) = heat_maps(values, x, y, PANEL._replace(values=np.ones(1)), "length", failed=failed)
    (lines,) = [part for part in axes.collections if isinstance(part, ContourSet)]
    assert len(lines.levels) > 3
    for level, path in zip(lines.levels, lines.get_paths(), strict=True):
        np.testing.assert_allclose(path.vertices.sum(axis=1), level, atol=1e-9)
    few = heat_maps(values[:4], x._replace(values=np.arange(4.0)), y, PANEL._replace(values=np.ones(1)), "length")[1][0]
    assert not [part for part in few.collections if isinstance(part, ContourSet)]


def test_maps_of_nothing_finite_still_draw() -> None:
    figure, panels = heat_maps(np.full((3, 2, 1), np.nan), X, Y, GridAxis("", np.zeros(1)), "score", better="low")
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]
    assert not panels[0].lines and "best" not in figure.get_suptitle()


def test_curve_marks_its_best() -> None:
    _, axes = curve(np.array([3.0, 1.0, 2.0]), X, "length", "m", "low")
    assert axes.lines[1].get_xydata().tolist() == [[0.1, 1.0]]
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_xscale()) == ("$K_{att}$", "length [m]", "log")
    _, again = curve(np.array([3.0, 1.0, 2.0]), X, "length", axes=axes)
    assert again is axes


def test_rounding_is_no_effect_in_a_curve() -> None:
    _, flat = curve(np.array([2.0, 2.0, 2.0 + 1e-5]), X, "length")
    assert flat.get_ylim() == (pytest.approx(1.0, rel=1e-4), pytest.approx(3.0, rel=1e-4))
    _, steep = curve(np.array([2.0, 2.0, 2.01]), X, "length")
    assert 1.99 < steep.get_ylim()[0] < 2.0 and 2.01 < steep.get_ylim()[1] < 2.02


def test_the_best_of_several_maps_is_in_its_own_alone() -> None:
    values = np.zeros((3, 2, 5))
    values[1, 0, 1] = 1.0
    _, panels = heat_maps(values, X, Y, PANEL, "length", better="high")
    assert [len(axes.lines) for axes in panels] == [0, 1, 0, 0, 0]
    assert [axes.get_subplotspec().get_gridspec().ncols for axes in panels] == [4] * 5
    _, few = heat_maps(values[:, :, :2], X, Y, PANEL._replace(values=PANEL.values[:2]), "length")
    assert [axes.get_subplotspec().get_gridspec().ncols for axes in few] == [2, 2]


def test_samples_that_failed_are_not_best() -> None:
    x = GridAxis("a", np.array([1.0, 2.0, 3.0]))
    y = GridAxis("b", np.array([4.0, 5.0, 6.0]), unit="m")
    feasible = np.array([False, True, True])
    _, axes = sample_map(np.array([9.0, 8.0, np.inf]), x, y, "score", better="high", feasible=feasible)
    assert axes.lines[0].get_xydata().tolist() == [[2.0, 5.0]]
    failed, good = axes.collections[:2]
    assert len(failed.get_offsets()) == 2 and good.get_array().tolist() == [8.0]
    assert axes.get_ylabel() == "b [m]"


def test_wrong_shapes_are_refused() -> None:
    with pytest.raises(Exception, match="heat_maps"):
        heat_maps(np.zeros((3, 2)), X, Y, PANEL, "length")  # pyright: ignore[reportArgumentType]
