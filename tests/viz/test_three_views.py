"""Three views of one box: each shows its two axes, all of the box, at one scale."""

import numpy as np
import pytest

from hrcjax.viz.three_views import three_views


@pytest.mark.parametrize("high", [(2.0, 1.0, 0.5), (0.4, 1.5, 3.0)])
def test_each_view_shows_its_axes_and_all_of_the_box(high) -> None:
    low, high = np.array([-1.0, -0.25, 0.125]), np.array(high)
    figure, views, corner = three_views(low, high)
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]
    scales = []
    for axes, (right, up) in zip(views, ((0, 1), (0, 2), (1, 2)), strict=True):
        assert axes.get_xlim() == (low[right], high[right]) and axes.get_ylim() == (low[up], high[up])
        assert (axes.get_xlabel(), axes.get_ylabel()) == (f"{'xyz'[right]} [m]", f"{'xyz'[up]} [m]")
        box = axes.get_window_extent()
        scales += [box.width / (high - low)[right], box.height / (high - low)[up]]
    assert max(scales) / min(scales) < 1.15, "a centimetre is as long in every view, to what labels take"
    assert [axes.get_title() for axes in views] == ["from above", "from the front", "from the side"]
    assert not corner.axison
