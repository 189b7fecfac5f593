"""Every panel shows its own setting, and the one that all rows share behind it."""

import numpy as np
import pytest

from hrcjax.viz import KnobRow, Obstacles, PersonPoses, knobs_view

TIME = np.linspace(0, 4, 21)
OBSTACLES = Obstacles(
    np.array([1]), np.array([[0.3, 0.1, 0.1]]), np.array([[0.03, 0.03, 0.1]]), np.zeros(1), np.array([True])
)
PERSON = PersonPoses(np.array([[[0.3, 0.6, 0.2]]]), np.array([[[0.3, 0.8, 0.2]]]), np.array([0.1]), np.array([1.5]))


def row(symbol: str, count: int, base: int, fault: int | None = None) -> KnobRow:
    bow = np.linspace(0.0, 0.2, count)[:, None]
    way = np.stack(np.broadcast_arrays(TIME / 4, bow * np.sin(TIME * np.pi / 4), 0.1), axis=-1)
    speed = 0.25 * (1 + bow) * np.sin(TIME * np.pi / 4)
    faults = ["the arm touched an obstacle" if i == fault else "" for i in range(count)]
    return KnobRow(symbol, "what it is", np.linspace(1, 2, count), way, speed, np.linspace(3, 4, count), faults, base)


def test_panels_show_their_settings() -> None:
    rows = [row("$K$", 4, 1), row("stiffness of the leaf", 3, 2, fault=0)]
    ends = {"start": np.array([0.0, 0.0, 0.1]), "goal": np.array([1.0, 0.0, 0.1])}
    figure, drawn = knobs_view(rows, TIME, OBSTACLES, PERSON, **ends, title="toy")
    figure.canvas.draw()  # pyright: ignore[reportAttributeAccessIssue]
    for knob, panels in zip(rows, drawn, strict=True):
        count = len(knob.values)
        assert len(panels) == 2 * count
        for c in range(count):
            upper, lower = panels[c], panels[count + c]
            np.testing.assert_allclose(upper.lines[0].get_xydata(), knob.tool[knob.base, :, :2])
            np.testing.assert_allclose(upper.lines[1].get_xydata(), knob.tool[c, :, :2])
            np.testing.assert_allclose(lower.lines[0].get_ydata(), knob.speed[knob.base])
            np.testing.assert_allclose(lower.lines[1].get_ydata(), knob.speed[c])
            assert upper.get_title().startswith("★") == (c == knob.base)
            pieces = upper.collections[0]
            np.testing.assert_allclose(pieces.get_array(), (knob.speed[c][1:] + knob.speed[c][:-1]) / 2)
            assert pieces.get_clim() == (0, max(float(r.speed.max()) for r in rows))
            arrived = [line for line in lower.lines if line.get_linestyle() == ":"]
            assert [line.get_xdata()[0] for line in arrived] == ([] if knob.fault[c] else [knob.arrival[c]])
    said = [text.get_text().replace("\n", " ") for text in drawn[1][0].texts]
    assert "the arm touched an obstacle" in said and "stiffness of the leaf" in said
    limits = {
        panel.get_ylim() for panels, knob in zip(drawn, rows, strict=True) for panel in panels[: len(knob.values)]
    }
    assert len(limits) == 1, "one window for all"


def test_notes_are_below_the_values() -> None:
    noted = row("$K$", 2, 0)._replace(notes=["first", "second"])
    _, drawn = knobs_view([noted], TIME)
    assert "second" in [text.get_text() for text in drawn[0][1].texts]


def test_wrong_shapes_are_refused() -> None:
    with pytest.raises(Exception, match="knobs_view"):
        knobs_view([row("$K$", 2, 0)], TIME[:, None])  # pyright: ignore[reportArgumentType]
