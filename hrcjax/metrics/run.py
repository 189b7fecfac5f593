"""A run as it is measured, and what it is measured against."""

import equinox as eqx

from hrcjax.metrics.score import ScoreParams
from hrcjax.metrics.sound_score import SoundScoreParams
from hrcjax.typing import Array, Bool, Float, Int, Scalar, Vector3


class Run(eqx.Module):
    """Arrays over time of one run, and its plan. Those over "sample" may be every k-th of the run, the first included."""

    dt: Scalar
    """Time between samples of the arrays over time [s]."""
    tool: Float[Array, "time 3"]
    """Tool positions [m]."""
    q: Float[Array, "time joint"]
    """Joint positions [rad]."""
    qd: Float[Array, "time joint"]
    """Joint speeds [rad/s]."""
    qdd: Float[Array, "time joint"]
    """Joint accelerations [rad/s^2]."""
    tau: Float[Array, "time joint"]
    """Joint torques [N m]."""
    zone: Int[Array, "time"]
    """0 green, 1 yellow, 2 red, 3 stop."""
    separation: Float[Array, "sample"]
    """True distance of the whole arm to the person [m]."""
    closing_speed: Float[Array, "sample"]
    """Speed at which robot and person close in on each other, positive for an approach [m/s]."""
    obstacle_distances: Float[Array, "sample obstacle"]
    """True distance of the arm to every obstacle of the scene [m]."""
    clearance: Float[Array, "sample"]
    """True distance of the whole arm to the nearest obstacle [m]."""
    protective_distance: Float[Array, "sample"] | Scalar
    """Protective separation distance S_p at the robot's speed, over time or constant [m]."""
    plan_length: Scalar
    """Length of the planned path [m]."""
    plan_bending_energy: Scalar
    """Bending energy of the planned path [1/m]."""
    least_separation: Scalar | None = None
    """Least true distance of the whole arm to the person, between samples too; None: of the samples [m]."""
    least_clearance: Scalar | None = None
    """The same to an obstacle [m]."""
    touched: Bool[Array, ""] | None = None
    """Whether arm and person touched at any tick; None: as the samples of a moving arm say."""

    @property
    def stride(self) -> int:
        """The k for which the arrays over "sample" are every k-th sample of the run.

        Raises:
            ValueError: there is none.
        """
        full, part = self.tool.shape[0], self.separation.shape[0]
        stride = -(-full // part)
        if -(-full // stride) != part:
            raise ValueError(f"{part} samples are not every k-th of {full}: take array[::k] of every array over sample")
        return stride


class Yardstick(eqx.Module):
    """What a run is measured against: its goal, the limits that count, and the parameters of the scores."""

    goal: Vector3
    """Where the tool is to arrive [m]."""
    tolerance: Scalar
    """Distance to the goal that counts as reached [m]."""
    ideal_time: Scalar
    """Time of the plan without person and zones [s]."""
    unsafe_distance: Scalar
    """Separation under which time is unsafe in the score [m]."""
    slow: Scalar = 0.05
    """Largest speed of the tool that counts as arrived [m/s]."""
    score: ScoreParams = eqx.field(default_factory=ScoreParams)
    """Weights of the paper's score."""
    sound: SoundScoreParams = eqx.field(default_factory=SoundScoreParams)
    """Weights of the sound score."""
    straight_time: Scalar | None = None
    """Time of the straight way from start to goal without person and zones; None: `ideal_time` scaled from the length of the
    plan to the straight way [s]."""
    moving: Scalar = 0.05
    """Joint speed above which a contact with the person is one with a moving arm [rad/s]."""
    largest_power: Scalar | None = None
    """Normaliser of the power score; None: the largest of the run [W]."""
    largest_joint_speed: Scalar | None = None
    """Normaliser of joint smoothness; None: the largest of the run [rad/s]."""
    largest_proximity: Scalar | None = None
    """Normaliser of obstacle proximity; None: the largest of the run [m]."""
    smoothness_stride: int = eqx.field(static=True, default=1)
    """Every so many samples enter the smoothness measures; in float32 choose 50 Hz or less."""
