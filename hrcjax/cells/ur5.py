"""The built-in cells: a UR5 or a UR5e on its table."""

from hrcjax.body import BodyParams
from hrcjax.cells.named_cell import NamedCell
from hrcjax.robot import load_arm, with_tool
from hrcjax.sim import Cell

TOOL = (0.12, 0.03)
"""Length and radius of the tool: with the bare flange at the paper's goal, 5 cm above the table, the forearm would
collide with the 20 cm column beside it [m]."""
EPISODE = 12.0
"""Length of an episode: a person comes and goes within 6 s, and the slowest arm still arrives [s]."""


def make_cell(
    backend: str = "folded", variant: str = "ur5", contact_mass: str = "standard", body: BodyParams | None = None
) -> Cell:
    """A UR5 or UR5e with the default parts."""
    return Cell(
        arm=with_tool(load_arm(variant), *TOOL),
        ticks=round(EPISODE / Cell.dt),
        contact_mass=contact_mass,
        backend=backend,
        body=body,
    )


def ur5_cell() -> NamedCell:
    """The UR5 of the Robotica paper."""
    return _named("ur5")


def ur5e_cell() -> NamedCell:
    """The UR5e of the HRI paper."""
    return _named("ur5e")


def ur5_reflected_cell() -> NamedCell:
    """The UR5 whose speed near people follows the mass that a contact would feel."""
    cell = make_cell(contact_mass="reflected")
    return NamedCell(cell, identity=f"cell ur5-reflected {TOOL} {cell.ticks} x {cell.dt}")


def ur5_body_cell() -> NamedCell:
    """The UR5 whose monitor follows the body of the person: measured speeds, regions, the head."""
    cell = make_cell(body=BodyParams())
    return NamedCell(cell, identity=f"cell ur5-body {TOOL} {cell.ticks} x {cell.dt}")


def _named(variant: str) -> NamedCell:
    cell = make_cell(variant=variant)
    return NamedCell(cell, identity=f"cell {variant} {TOOL} {cell.ticks} x {cell.dt}")


CELLS = {"ur5": ur5_cell, "ur5e": ur5e_cell, "ur5-reflected": ur5_reflected_cell, "ur5-body": ur5_body_cell}
"""Built-in cells by name."""
