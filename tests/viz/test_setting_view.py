"""A setting in blue, the other one grey, in the paths and in every curve."""

import numpy as np

from hrcjax.viz import setting_view
from hrcjax.viz.style import BEST

TIME = np.linspace(0, 1, 6)


def test_both_settings_are_drawn() -> None:
    way, other = np.random.default_rng(0).normal(size=(2, 6, 3))
    speed, gap = (TIME, 2 * TIME), (np.append(TIME[1:], np.inf), 3 + TIME)
    curves = {("speed", "m/s"): speed, ("separation", "m"): gap}
    figure, (above, *panels) = setting_view(way, other, curves, TIME, ("this", "best"), title="toy")
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]
    lines = {line.get_label(): line for line in above.lines}
    np.testing.assert_array_equal(lines["this"].get_xydata(), way[:, :2])
    np.testing.assert_array_equal(lines["best"].get_xydata(), other[:, :2])
    assert [axes.get_ylabel() for axes in panels] == ["speed [m/s]", "separation [m]"]
    for axes, (values, others) in zip(panels, curves.values(), strict=True):
        drawn = {line.get_color(): line.get_ydata() for line in axes.lines[:2]}
        np.testing.assert_array_equal(drawn.pop(BEST), np.where(np.isfinite(values), values, np.nan))
        np.testing.assert_array_equal(drawn.popitem()[1], others)


def test_paths_alone() -> None:
    _, axes = setting_view(np.zeros((6, 3)), np.ones((6, 3)), {}, TIME, ("this", "best"))
    assert len(axes) == 1
