"""The sweep's program with the toy cell in place of the real one: `python toy_sweep.py OPTIONS`."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[2])]
import toy_cell  # noqa: E402  # found through the line above

sys.modules["hrcjax.cells.problem"] = toy_cell
import experiments.sweep.__main__  # noqa: E402
import experiments.sweep.run  # noqa: E402  # it imports the cell

experiments.sweep.run.LOADED_CODE = "toy"  # somebody may edit the package meanwhile
sys.exit(experiments.sweep.__main__.main())
