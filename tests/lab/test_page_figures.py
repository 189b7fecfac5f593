"""Figures beside a page: copied with the program's name, films left out; bars that do not hold are told."""

from pathlib import Path

import pytest

from hrcjax.lab.page_figures import copy_figures
from hrcjax.lab.rows import report


def test_figures_lie_beside_the_page(tmp_path: Path) -> None:
    run = tmp_path / "run"
    run.mkdir()
    (run / "a.png").write_bytes(b"picture")
    (run / "film.mp4").write_bytes(b"film")
    page = tmp_path / "docs" / "page.md"
    page.parent.mkdir()
    assert copy_figures(run, page, [], "hri") == [] and not (tmp_path / "docs" / "figures").exists()
    assert copy_figures(run, page, ["a.png", "film.mp4"], "hri") == ["figures/hri-a.png"]
    assert (page.parent / "figures/hri-a.png").read_bytes() == b"picture"
    assert [p.name for p in (page.parent / "figures").iterdir()] == ["hri-a.png"]


def test_a_report_names_the_bars_that_do_not_hold(capsys: pytest.CaptureFixture[str]) -> None:
    rows = {
        "low": {"value": 1.0, "unit": "1"},
        "high": {"value": 3.0, "unit": "m"},
        "free": {"value": 9.0, "unit": "s"},
    }
    report("part", rows, lambda name, value: None if name == "free" else value < 2)
    told = capsys.readouterr().out
    assert "1 bars do not hold: high" in told and "free" in told
