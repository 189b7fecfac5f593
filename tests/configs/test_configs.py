"""Named settings are complete, documented, and start."""

from pathlib import Path

import pytest

from configs import CONFIGS, paper_sweep, people_sweep, quick_sweep
from experiments.sweep.__main__ import parse
from hrcjax.sweeps.settings import make_settings


def test_the_paper_sweep_is_the_default_of_the_program() -> None:
    assert parse([]) == CONFIGS["paper"]
    assert CONFIGS["paper"].scene == ("robotica",) and not CONFIGS["paper"].quick
    grid = make_settings(CONFIGS["paper"].grid, {"K_att": 0.03, "K_rep": 1e-5, "zeta": 4.0})
    assert grid.shape == (16, 16, 8)


@pytest.mark.parametrize("name", list(CONFIGS))
def test_every_config_can_be_asked_for_and_overridden(name: str) -> None:
    assert parse(["--config", name]) == CONFIGS[name]
    assert CONFIGS[name].config == name
    assert parse([f"--config={name}", "--seed", "7", "--out", "x"]).seed == (7,)
    assert parse([f"--config={name}", "--out", "x"]).out == Path("x")


@pytest.mark.parametrize("module", [paper_sweep, people_sweep, quick_sweep])
def test_every_config_says_command_minutes_and_figures(module: object) -> None:
    text = str(module.__doc__)
    for word in ("Command: python -m experiments.sweep", "Minutes on 2 cores:", "Figures:"):
        assert word in text
