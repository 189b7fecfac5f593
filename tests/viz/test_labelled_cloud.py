"""Points stand where they are in each view, in the colour of their label, the nearest on top."""

import numpy as np
from matplotlib.colors import to_rgb

from hrcjax.map import DYNAMIC, LABELS, NEW, STATIC
from hrcjax.viz.labelled_cloud import NAMES, POINT_COLOURS, cloud_views

POINTS = np.array([[0.0, 0.0, 0.0], [1.0, 0.2, 0.5], [0.4, 0.6, 0.1], [0.2, 0.1, 0.3]])
KINDS = np.array([STATIC, NEW, DYNAMIC, NEW])


def test_labels_are_those_of_the_map() -> None:
    assert NAMES == LABELS


def test_views_and_colours() -> None:
    figure, views = cloud_views(POINTS, KINDS, "toy")
    for axes, (right, up), towards in zip(
        views, ((0, 1), (0, 2), (1, 2)), (POINTS[:, 2], -POINTS[:, 1], POINTS[:, 0]), strict=True
    ):
        others, dynamic = axes.collections
        assert dynamic.get_sizes()[0] == 2 * others.get_sizes()[0], "what moves stands out"
        order = [i for i in np.argsort(towards) if KINDS[i] != DYNAMIC]
        np.testing.assert_allclose(others.get_offsets(), POINTS[order][:, [right, up]])
        np.testing.assert_allclose(dynamic.get_offsets(), POINTS[[2]][:, [right, up]])
        np.testing.assert_allclose(dynamic.get_facecolor()[0, :3], to_rgb(POINT_COLOURS[DYNAMIC]))
        for i, colour in zip(order, others.get_facecolor()[:, :3], strict=True):
            pure = np.array(to_rgb(POINT_COLOURS[KINDS[i]]))
            light = (colour - pure) / (1 - pure)  # the same for all three: lighter, of the same hue
            assert np.ptp(light) < 1e-6 and -1e-6 <= light[0] < 0.7
        assert axes.get_xlabel() == f"{'xyz'[right]} [m]" and axes.get_ylabel() == f"{'xyz'[up]} [m]"
    legend = [text.get_text() for axes in figure.axes if axes.get_legend() for text in axes.get_legend().get_texts()]
    assert legend == ["static  1", "new  2", "dynamic  1"]
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]


def test_the_farther_the_lighter() -> None:
    _, (above, *_) = cloud_views(POINTS, np.full(4, STATIC))
    shades = above.collections[0].get_facecolor()[:, :3].sum(axis=1)
    assert (np.diff(shades) < 0).all()


def test_a_map_without_points() -> None:
    figure, views = cloud_views(np.zeros((0, 3)), np.zeros(0, int))
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]
    assert not any(axes.collections for axes in views)
    legend = [text.get_text() for axes in figure.axes if axes.get_legend() for text in axes.get_legend().get_texts()]
    assert legend == ["static  0", "new  0", "dynamic  0"]
