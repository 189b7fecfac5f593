"""Named cells: parts with defaults, domains and metrics, ready to be swept."""

from hrcjax.cells.named_cell import NamedCell
from hrcjax.cells.ur5 import CELLS, make_cell, ur5_cell, ur5_reflected_cell, ur5e_cell
from hrcjax.cells.worlds import build_world

__all__ = ["CELLS", "NamedCell", "build_world", "make_cell", "ur5_cell", "ur5_reflected_cell", "ur5e_cell"]
