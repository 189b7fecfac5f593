"""The numbers of the arm's path optimiser, and the sizes of its arrays."""

from dataclasses import dataclass

import equinox as eqx


class ArmPathParams(eqx.Module):
    """Minimise omega1 length + omega2 bending energy + omega3 integral of repulsion over attraction (Robotica 2025, eq. 5a,
    and the potential of section 2.3 beside it). Lengths are those of the curve z = (tool_weight tool point, joint_weight q)."""

    omega1: float = 1.0
    """Weight of the length [1/m]."""
    omega2: float = 0.01
    """Weight of the bending energy [m]."""
    omega3: float = 1.0
    """Weight of the line integral of repulsion over attraction [1/m]."""
    tool_weight: float = 1.0
    """Share of the tool point in the length [1]."""
    joint_weight: float = 0.1
    """Length that a turn of any joint counts as [m/rad]."""
    opening: float = 0.5
    """Where a sphere is nearer to an obstacle than required at start or goal: growth of the distance asked for, per length
    of the straight way between the ends [1]."""
    opening_from: float = 0.05
    """Share of the way at either end over which no more is asked than is there, as between two samples the distance is not
    watched; below 0.5 [1]."""
    penalty: float = 20000.0
    """Stiffness of a violated constraint [1/m]."""
    penalty_first: float = 0.03
    """Share of this stiffness in the first iteration [1]."""
    margin: float = 0.001
    """Distance beyond the required one that the penalties ask for [m]."""
    self_gap: float = 0.0
    """Distance that links which are not neighbours keep from each other [m]."""
    lever: float = 0.3
    """Length that an angle beyond a joint's range counts as [m/rad]."""
    damping: float = 0.001
    """Added to the diagonal of the Gauss-Newton matrix, as a share of it [1]."""
    move_max: float = 0.5
    """Longest move of a control point in one iteration [rad]."""
    tolerance: float = 0.0005
    """Violation of distances, bounds and ranges that still counts as kept [m]."""


@dataclass(frozen=True)
class ArmPlanSizes:
    """Sizes of arrays and numbers of iterations: static."""

    control: int = 10
    """Control points of the spline, start and goal among them."""
    samples: int = 32
    """Configurations at which the path is checked, start and goal among them."""
    iterations: int = 10
    """Gauss-Newton steps for every guess, with the penalty growing."""
    polish: int = 20
    """Most Levenberg-Marquardt steps for the best one."""
    guesses: int = 5
    """Straight line, descent, arch over, arches to both sides, then seeded random detours."""
    waypoints: int = 48
    """Waypoints of the path, start and goal among them."""
    descent: int = 100
    """Steps of the descent of the potential."""

    def __post_init__(self) -> None:
        """Raises: ValueError if a size is too small."""
        least = {"control": 5, "samples": 5, "iterations": 1, "polish": 0, "guesses": 1, "waypoints": 4, "descent": 1}
        for name, value in least.items():
            if getattr(self, name) < value:
                raise ValueError(f"{name} is {getattr(self, name)}; accepted are {value} or more")
