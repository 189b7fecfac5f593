"""Zones have their colours, curves their runs."""

import numpy as np
import pytest
from matplotlib.colors import to_hex

from hrcjax.safety.zones import ZONE_NAMES as SAFETY_ZONE_NAMES
from hrcjax.viz.style import ZONE_COLOURS, ZONE_NAMES, finite_range, label, parameter_label
from hrcjax.viz.zones_view import zones_view

TIME = np.array([0.0, 0.5, 1.0, 1.5])
ZONE = np.array([[0, 1, 2, 3], [0, 0, 1, 0]])
NEAR = np.array([[1.0, 0.6, 0.4, np.inf], [1.0, 1.0, 0.8, 1.0]])


def test_zones_are_named_as_the_safety_layer_names_them() -> None:
    assert ZONE_NAMES == SAFETY_ZONE_NAMES


def test_strips_and_curves() -> None:
    figure, (strips, upper, lower) = zones_view(
        TIME, ZONE, NEAR, 2 * NEAR, ["best", "worst"], thresholds={"green": 0.9, "stop": 0.3}, title="toy"
    )
    mesh = strips.collections[0]
    np.testing.assert_array_equal(mesh.get_array(), ZONE)
    assert [to_hex(mesh.cmap(mesh.norm(z))) for z in range(4)] == list(ZONE_COLOURS)
    np.testing.assert_allclose(mesh.get_coordinates()[0, :, 0], [0, 0.5, 1.0, 1.5, 2.0])
    assert [text.get_text() for text in strips.get_yticklabels()] == ["best", "worst"]
    assert strips.yaxis_inverted()
    np.testing.assert_array_equal(upper.lines[0].get_ydata(), [1.0, 0.6, 0.4, np.nan])
    np.testing.assert_array_equal(lower.lines[1].get_ydata(), 2 * NEAR[1])
    assert (upper.get_ylabel(), lower.get_ylabel(), lower.get_xlabel()) == ("separation [m]", "speed [m/s]", "time [s]")
    assert [line.get_ydata()[0] for line in upper.lines[2:]] == [0.9, 0.3]
    assert to_hex(upper.lines[3].get_color()) == ZONE_COLOURS[3]
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]


def test_curves_begin_at_zero_or_where_they_overlap() -> None:
    _, (_, upper, lower) = zones_view(TIME, ZONE, NEAR, NEAR, ["best", "worst"])
    assert upper.get_ylim()[0] == lower.get_ylim()[0] == 0.0 and len(upper.lines) == 2
    _, (_, upper, lower) = zones_view(TIME, ZONE, NEAR - 0.5, NEAR, ["best", "worst"])
    assert upper.get_ylim()[0] == pytest.approx(-0.11) and lower.get_ylim()[0] == 0.0
    assert [line.get_ydata()[0] for line in upper.lines[2:]] == [0] and len(lower.lines) == 2
    assert [line.get_linestyle() for line in upper.lines[:2]] == ["-", "-"]
    assert lower.get_xlim() == (0.0, 2.0)


def test_each_run_needs_a_name() -> None:
    with pytest.raises(ValueError, match="1 names for 2 runs"):
        zones_view(TIME, ZONE, NEAR, NEAR, ["best"])


def test_labels_and_ranges() -> None:
    assert label("bending_energy", "1/m") == "bending energy [1/m]"
    assert label("score", "1") == "score"
    assert parameter_label("zeta", "radii") == r"$\zeta$"
    assert parameter_label("length_scale", "m") == "length scale [m]"
    assert finite_range([1.0, np.nan, 3.0, np.inf]) == (1, 3)
    assert finite_range([2.0]) == (1.5, 2.5)
    assert finite_range([np.nan]) == (0, 1)
