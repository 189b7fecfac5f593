"""Slices show the field where it is, and arrows point where it grows."""

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.contour import ContourSet
from matplotlib.quiver import Quiver

from hrcjax.viz.field_slice import LINES, FieldSlice, contour_levels, field_slices


def slice_of(across: int, at: float, right: int, up: int) -> FieldSlice:
    """The distance to a ball of 0.2 m at (0.1, -0.2, 0.3)."""
    middle = np.array([0.1, -0.2, 0.3])
    low, high = np.array([-1.0, -0.6, 0.0]), np.array([1.0, 0.6, 0.8])
    a, b = (np.linspace(low[k], high[k], n) for k, n in ((right, 41), (up, 21)))
    places = np.empty((41, 21, 3))
    places[..., across], places[..., right], places[..., up] = at, a[:, None], b
    offset = places - middle
    radius = np.linalg.norm(offset, axis=-1)
    few = (slice(None, None, 5), slice(None, None, 5))
    g = (offset / radius[..., None])[few].reshape(-1, 3)
    arrows = np.column_stack([places[few].reshape(-1, 3)[:, [right, up]], 3.0 * g[:, [right, up]]])
    return FieldSlice(at, a, b, radius - 0.2, arrows, middle[None, [right, up]] + [[0.2, 0.0]])


@pytest.fixture(scope="module")
def slices():
    return [slice_of(2, 0.35, 0, 1), slice_of(1, -0.15, 0, 2), slice_of(0, 0.05, 1, 2)]


def test_colours_axes_and_units(slices) -> None:
    figure, views = field_slices(slices, title="a ball", highest=0.8)
    assert [axes.get_title() for axes in views] == ["z = 0.35 m", "y = -0.15 m", "x = 0.05 m"]
    labels = [(axes.get_xlabel(), axes.get_ylabel()) for axes in views]
    assert labels == [("x [m]", "y [m]"), ("x [m]", "z [m]"), ("y [m]", "z [m]")]
    for axes, part in zip(views, slices, strict=True):
        mesh = axes.collections[0]
        np.testing.assert_array_equal(mesh.get_array(), part.distance.T)
        assert mesh.get_clim() == (0.0, 0.8)
        corners = mesh.get_coordinates()
        assert corners[0, 0, 0] < part.right[0] < corners[0, 1, 0] and corners[0, 0, 1] < part.up[0] < corners[1, 0, 1]
    texts = [axes.get_ylabel() for axes in figure.axes] + [
        child.get_ylabel() for a in figure.axes for child in a.child_axes
    ]
    assert "distance [m]" in texts
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]


def test_colours_end_where_nearly_all_distances_do(slices) -> None:
    everything = np.concatenate([part.distance.ravel() for part in slices])
    for given, highest in ((None, np.quantile(everything, 0.98)), (0.3, 0.3)):
        _, views = field_slices(slices, highest=given)
        for axes in views:
            (mesh,) = (part for part in axes.collections if isinstance(part, QuadMesh))
            np.testing.assert_allclose(mesh.get_clim(), (0.0, highest))


def test_arrows_point_away_and_are_not_longer_than_their_step(slices) -> None:
    _, views = field_slices(slices)
    for axes, part in zip(views, slices, strict=True):
        (quiver,) = [c for c in axes.collections if isinstance(c, Quiver)]
        np.testing.assert_allclose(quiver.XY, part.arrows[:, :2])
        u, v = np.asarray(quiver.U), np.asarray(quiver.V)
        assert (u * part.arrows[:, 2] + v * part.arrows[:, 3] >= 0).all() and np.hypot(u, v).max() <= 1 + 1e-9
        assert np.hypot(u, v).max() / quiver.scale < np.diff(np.unique(part.arrows[:, 0])).min()


def test_contour_lines_are_round_and_few() -> None:
    np.testing.assert_allclose(contour_levels(0.21), 0.02 * np.arange(1, 11))
    np.testing.assert_allclose(contour_levels(2.1), 0.2 * np.arange(1, 11))
    np.testing.assert_allclose(contour_levels(0.12), 0.01 * np.arange(1, 13))
    np.testing.assert_allclose(contour_levels(0.13), 0.02 * np.arange(1, 7))  # thirteen would be too many
    assert len(contour_levels(0.001)) == 1 and len(contour_levels(50.0)) == 10
    for highest in (61.0, 777.0, 1e5, 3e30):
        levels = contour_levels(highest)
        assert 1 <= len(levels) <= LINES and levels[-1] <= highest * (1 + 1e-6)


def test_a_field_that_is_nowhere_known_is_drawn(slices) -> None:
    figure, views = field_slices([part._replace(distance=np.full_like(part.distance, np.nan)) for part in slices])
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]
    for axes in views:
        (mesh,) = (part for part in axes.collections if isinstance(part, QuadMesh))
        assert np.ma.getmaskarray(mesh.get_array()).all() and mesh.get_clim() == (0.0, 1.0)
        assert not any(isinstance(part, ContourSet) for part in axes.collections)


def test_three_slices_are_needed(slices) -> None:
    with pytest.raises(ValueError, match="2 slices; three"):
        field_slices(slices[:2])
