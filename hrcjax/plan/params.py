"""The numbers of the planner: the potential field, the path optimiser, and the sizes of arrays."""

from dataclasses import dataclass

import equinox as eqx


class PotentialParams(eqx.Module):
    """The improved artificial potential field (Robotica 2025, section 2.3)."""

    k_att: float = 0.03
    """Attraction K_att: part of the way to the goal covered in one step; above 1 the path overshoots [1/step]."""
    k_rep: float = 1e-5
    """Repulsion K_rep [m^(4-n)/step]. The force is K_rep (1/rho) (1/rho^2) d^n, a length per step, so K_rep is a
    length to the power 4 - n, and a value in centimetres is multiplied by 0.01^(4-n): the paper's 0.1 cm^2 with n = 2
    is 1e-5 m^2."""
    zeta: float = 4.0
    """Safety factor: obstacle i repels within zeta radius_i of its surface; the optimised path keeps zeta radius_i
    from its centre, that is (zeta - 1) radius_i from its surface [radii]."""
    d_star: float = 1.0
    """Distance to the goal where the attraction turns from quadratic to linear [m]."""
    exponent: float = 2.0
    """Exponent n of the factor d^n, d the distance to the goal, that fades repulsion at the goal [1]."""
    rho_min: float = 0.005
    """Surface distance below which 1/rho is continued by its tangent, to stay finite on and inside an obstacle [m]."""
    step_max: float = 0.05
    """Longest step [m]."""
    arrival: float = 0.01
    """Distance to the goal that counts as arrived [m]."""
    sensed_radius: float = 0.03
    """Radius that zeta multiplies where an obstacle is only sensed: the paper's obstacles' [m]."""
    person_radius: float = 0.1
    """The same for people: a forearm with its hand; our choice [m]."""


class PathParams(eqx.Module):
    """The path optimiser: minimise omega1 length + omega2 bending energy (Robotica 2025, eq. 5a)."""

    omega1: float = 1.0
    """Weight of the length [1/m]."""
    omega2: float = 0.01
    """Weight of the bending energy [m]."""
    opening: float = 0.5
    """Where start or goal are nearer to an obstacle than required: growth of the distance asked for per length of path
    travelled from there, below 1 to be attainable [1]."""
    penalty: float = 1000.0
    """Stiffness of a violated constraint over the stiffness of the path [1]."""
    softness_first: float = 0.005
    """Reach of the push of a constraint that is kept, at the first iteration [m]."""
    softness_last: float = 0.0003
    """Reach of that push at the end [m]."""
    move_max: float = 0.05
    """Longest move of a waypoint in one iteration [m]."""
    tolerance: float = 0.0005
    """Violation of the required distances and of the bounds that still counts as kept [m]."""


class PlanParams(eqx.Module):
    """All numbers of the planner of a point."""

    potential: PotentialParams = eqx.field(default_factory=PotentialParams)
    """Potential field."""
    path: PathParams = eqx.field(default_factory=PathParams)
    """Path optimiser."""


@dataclass(frozen=True)
class PlanSizes:
    """Sizes of arrays and numbers of iterations: static."""

    steps: int = 300
    """Steps of the descent; the paper takes 30 in a second."""
    waypoints: int = 48
    """Waypoints of the path, start and goal among them."""
    iterations: int = 10
    """Iterations of the path optimiser; in each the obstacles' distances are evaluated once, and two Newton steps taken."""

    def __post_init__(self) -> None:
        """Raises: ValueError if a size is too small."""
        if self.steps < 1 or self.iterations < 0 or self.waypoints < 4:
            raise ValueError(f"{self}: accepted are steps >= 1, waypoints >= 4, iterations >= 0")
