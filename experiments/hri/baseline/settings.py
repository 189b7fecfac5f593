"""The numbers of the baseline. Defaults are what tuning chose: docs/hri-baseline.md."""

from dataclasses import dataclass


@dataclass(frozen=True)
class BaselineSettings:
    """Octree, collision check, planner, timing and monitor. Units in the fields' text."""

    resolution: float = 0.04
    """Edge of the octree's voxels [m]."""
    hit: float = 0.7
    """Probability of occupied after one hit, OctoMap's default [1]."""
    miss: float = 0.4
    """After one miss, OctoMap's default [1]."""
    clamp: tuple[float, float] = (0.29, 0.85)
    """Least and greatest probability of a voxel: two hits make a free voxel occupied, and five misses an occupied one
    free. OctoMap's defaults, 0.12 and 0.97, take three and nine [1]."""
    table_margin: float = 0.05
    """Voxels whose middle is lower than this above the table are not obstacles: the table is a known solid, and its noise
    ends there [m]."""
    plan_gap: float = 0.05
    """Padding of the arm in planning [m]."""
    watch_gap: float = 0.03
    """Padding of the arm while a path runs: smaller, so that noise does not stop a path just planned [m]."""
    step: float = 0.05
    """Largest change of a joint between two checked configurations of a motion [rad]."""
    samples: int = 500
    """Samples of BFMT*; on failure it adds as many again, up to the time limit."""
    window: float = 0.7
    """The planner samples joints from the least to the greatest of start, goal and waypoints, and this beyond [rad]."""
    direct: bool = True
    """A straight motion of the joints is taken where it is free: what BFMT* tends to."""
    shortcuts: int = 30
    """Steps of OMPL's partial shortcuts, between two passes that remove vertices; 0: no simplification."""
    blend: float = 0.8
    """Spacing of the control points of the cubic B-spline that rounds the corners of the path [rad]."""
    speed_scale: float = 1.0
    """Share of the joints' largest speeds, MoveIt's velocity scaling [1]."""
    acceleration_scale: float = 0.1
    """Share of their largest accelerations, MoveIt's acceleration scaling [1]."""
    tool_speed: float = 0.5
    """Largest speed of the tool point, MoveIt's limit of the Cartesian speed [m/s]."""
    jerk_time: float = 0.2
    """Width of the moving average over the law of time: accelerations ramp in this time. 0: none [s]."""
    brake_scale: float = 0.3
    """Share of the joints' largest accelerations in a stop [1]."""
    horizon: float = float("inf")
    """The path is checked this far ahead; MoveIt checks all that remains [s]."""
    overhead: float = 0.05
    """Planning time beside the collision checks: scene copy, simplification, timing [s]."""
    check_time: float = 1e-5
    """Planning time of a checked configuration [s]."""
    time_limit: float = 0.5
    """Longest search; then it has failed, and the next one begins [s]."""

    @property
    def most_checks(self) -> int:
        """Configurations that a search may check within the time limit."""
        return int((self.time_limit - self.overhead) / self.check_time)

    def planning_time(self, checks: int) -> float:
        """Time on the simulated clock of a search with so many checked configurations [s].

        A model, so that results do not depend on the machine: 10 us a configuration is what compiled checkers of coarse
        shapes reach.
        """
        return min(self.overhead + self.check_time * checks, self.time_limit)
