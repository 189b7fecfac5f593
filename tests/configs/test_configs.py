"""Named settings are complete, documented, and start."""

from pathlib import Path

import pytest

from experiments.sweep.config import SweepConfig, parse
from hrcjax.lab.configs import config_names, configs_folder, read_config
from hrcjax.sweeps.settings import make_settings

NAMES = config_names("sweep")


def test_the_paper_sweep_is_the_default_of_the_program() -> None:
    assert NAMES == ["paper", "people", "quick"]
    assert parse([]) == parse(["--config", "paper"]) == SweepConfig()
    assert parse([]).scene == ("robotica",) and not parse([]).quick
    grid = make_settings(parse([]).grid, {"K_att": 0.03, "K_rep": 1e-5, "zeta": 4.0})
    assert grid.shape == (16, 16, 8)


def test_what_a_file_says_is_what_the_program_gets() -> None:
    people = parse(["--config", "people"])
    assert people.person == ("reach_in", "pass_by", "stand_and_work", "nobody") and people.seed == (0, 1, 2)
    assert people.grid == ("K_rep=log:1e-6:1e-3:8", "zeta=lin:1.5:5:8") and people.scene == ("robotica",)
    assert parse(["--config", "quick"]).quick


@pytest.mark.parametrize("name", NAMES)
def test_every_config_can_be_asked_for_and_overridden(name: str) -> None:
    whole = parse(["--config", name])
    assert whole.config == name
    assert vars(read_config(SweepConfig, "sweep", name)) == {**vars(whole), "config": SweepConfig.config}
    assert parse([f"--config={name}", "--seed", "7", "--out", "x"]).seed == (7,)
    assert parse([f"--config={name}", "--out", "x"]).out == Path("x")


@pytest.mark.parametrize("file", sorted(configs_folder().glob("*/*.toml")), ids=lambda file: file.stem)
def test_every_config_says_command_minutes_and_figures(file: Path) -> None:
    text = file.read_text()
    if file.parent.name == "tuned":  # written by a program
        assert "Command: python -m experiments.tune" in text and "[parameters]" in text
        return
    for word in (f"Command: python -m experiments.{file.parent.name}", "Minutes on 2 cores:", "Figures:"):
        assert word in text
