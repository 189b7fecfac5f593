"""Bars are as long as their indices, cells say their numbers."""

import numpy as np

from hrcjax.viz import range_table, sensitivity_bars

KNOBS, METRICS = ["k_att", "zeta"], ["time_to_goal", "clearance", "score", "length", "separation"]
FIRST = np.linspace(0.05, 0.5, 10).reshape(2, 5)
TOTAL = FIRST + 0.2


def test_bars_are_the_indices() -> None:
    total = TOTAL.copy()
    total[1, 2] = np.nan
    figure, panels = sensitivity_bars(FIRST, total, KNOBS, METRICS, "toy")
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]
    assert [axes.get_title() for axes in panels] == ["time to goal", "clearance", "score", "length", "separation"]
    for m, axes in enumerate(panels):
        pale, dark = ([bar.get_width() for bar in bars] for bars in axes.containers)
        np.testing.assert_allclose(dark, FIRST[:, m])
        np.testing.assert_allclose(pale, np.nan_to_num(total[:, m]))
        assert axes.containers[0][0].get_alpha() < 1 and axes.containers[1][0].get_alpha() is None
    assert [text.get_text() for text in panels[2].texts] == ["0.15 / 0.35", "not known"]
    assert [label.get_text() for label in panels[0].get_yticklabels()] == ["$K_{att}$", r"$\zeta$"]


def test_table_says_its_numbers() -> None:
    ranges = np.array([[0.0, 0.12, 0.99], [0.5, np.nan, 0.0999]])
    figure, axes = range_table(ranges, KNOBS, METRICS[:3], "toy")
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]
    assert [text.get_text() for text in axes.texts] == ["0.00", "0.12", "0.99", "0.50", "–", "0.10"]
    assert [text.get_fontweight() == "bold" for text in axes.texts] == [False, True, True, True, False, False]
    np.testing.assert_array_equal(np.ma.filled(axes.images[0].get_array(), np.nan), ranges)
