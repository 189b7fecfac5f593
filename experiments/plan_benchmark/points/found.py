"""What a planner hands over."""

from typing import NamedTuple

from numpy.typing import NDArray


class Found(NamedTuple):
    """A planner's answer."""

    points: NDArray
    """(point 3) from start to goal; the straight line if it has none [m]."""
    claimed: bool
    """Whether the planner itself says that it succeeded."""
    seconds: float
    """Planning time, without compiling [s]."""
