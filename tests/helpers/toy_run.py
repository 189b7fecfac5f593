"""A finished run of the sweep with the toy cell in place of the real one."""

import io
import sys
from pathlib import Path

import pytest
import toy_cell

from experiments.sweep.__main__ import main


def make_run(folder: Path, *options: str) -> Path:
    """Runs the sweep into the folder, silently and without figures; returns the folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "hrcjax.cells.problem", toy_cell)
        patch.setattr(sys, "stderr", io.StringIO())
        assert main([*options, "--no-figures", "--out", str(folder)]) == 0
    return folder
