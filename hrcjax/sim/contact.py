"""What a contact would feel of the arm's mass, in a cell that asks for it."""

from hrcjax.geom.point_motion import PointMotion
from hrcjax.robot import mass_matrix
from hrcjax.safety import ContactMobility, approach_rows, has_direction, link_neighbours
from hrcjax.sim.cell import Cell
from hrcjax.sim.govern import Rows
from hrcjax.typing import Joints


def contact_mobility_rows(cell: Cell, q: Joints, tool: PointMotion, people: Rows) -> ContactMobility | None:
    """The mobility of every row of people; None where the cell takes the standard's mass.

    Args:
        tool: motion of the tool points; the payload sits at the first.
        people: rows of the approach to people.
    """
    if cell.contact_mass == "standard":
        return None
    before, after = link_neighbours(cell.arm.control_links)
    return ContactMobility(
        M=mass_matrix(cell.arm.chain, q),
        J_payload=tool.J[0],
        A=people.A,
        before=approach_rows(people.J[before], people.g),
        after=approach_rows(people.J[after], people.g),
        counts=people.lost | has_direction(people.g).reshape(-1),
    )
