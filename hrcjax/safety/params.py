"""The numbers of the safety layer. Each has its source; none makes the program safety-rated."""

import equinox as eqx


class SsmParams(eqx.Module):
    """Speed and separation monitoring (ISO/TS 15066, 5.5.4; ISO 10218-2:2025, annex L, as quoted)."""

    v_h: float = 1.6
    """Speed of a person towards the robot where it is not measured (ISO 13855) [m/s]."""
    v_h_near: float = 2.0
    """The same nearer than `near`, where an arm and not a walk decides (ISO 13855) [m/s]."""
    near: float = 0.5
    """Distance under which `v_h_near` holds (ISO 13855) [m]."""
    reaction_time: float = 0.1
    """T_r, from the person's move to the first braking torque: age of the data, computing and bus together [s]."""
    brake: float = 3.0
    """a, the deceleration of a control point that the stopping arm surely reaches; our choice for a UR5 [m/s^2]."""
    intrusion: float = 0.1
    """C, how far a body part gets in before it is sensed; our choice for a depth camera [m]."""
    Z_d: float = 0.05
    """Uncertainty of the person's position; our choice for a depth camera [m]."""
    Z_r: float = 0.01
    """Uncertainty of the robot's position; our choice for a UR5 [m]."""


class ZoneParams(eqx.Module):
    """Zones of distance. The Robotica paper names three (eq. 6c) and gives no thresholds; these are our choice."""

    nominal_speed: float = 1.0
    """Full speed; green begins at S_p of it [m/s]."""
    red_speed: float = 0.25
    """Largest speed in red, the reduced speed of ISO 10218-1; yellow begins at S_p of it [m/s]."""
    hysteresis: float = 0.1
    """How much farther than a threshold the person must be before a zone is relaxed [m]."""
    measured_hysteresis: float = 0.02
    """The same beyond thresholds of measured speeds, which hold their uncertainty already; our choice. v(d) bounds the arm in every zone, and
    where a stop ends it is at most 0.08 m/s: with less the arm stops more often, and for less time [m]."""
    head_hysteresis: float = 0.05
    """The same beyond `head_stop` of a head whose place is measured; our choice [m]."""
    relax_time: float = 0.1
    """How long that must last, about three camera frames; tightening never waits [s]."""
    head_stop: float = 0.5
    """Distance to the head under which the robot stops; our choice [m]."""
    retreat_speed: float = 0.1
    """Speed at which the nearest points are asked to move away in a stop, until it can end; 0: no retreat [m/s]."""
    turn_away: float = 0.02
    """Speed at which every point nearer than S_p(0) moves away in a stop, if it moves: a person who is 3 cm beside where an image shows
    them is seen 5 degrees off at 0.36 m, and a point that slides by at the red speed approaches at 0.25 * 0.03 / 0.36 [m/s]."""
    aside: float = 0.03
    """How far a person may be beside where an image shows them, when it is taken: directions in red and in a stop are proof against it [m]."""
    across_speed: float = 1.0
    """Speed across that is assumed of a person in red and in a stop besides, since the image was taken: half of
    `SsmParams.v_h_near`; our choice [m/s]."""
    widest: float = 0.707
    """Sine of the largest angle by which a direction counts as off: at a touch every direction is open, and no motion would be
    a retreat; our choice, 45 degrees [1]."""
    stop_acceleration: float = 0.5
    """Largest gain of speed of the fastest point in a stop, where every image may turn a retreat; slowing down is not bounded by it
    [m/s^2]."""
    red_only_slows: bool = eqx.field(static=True, default=False)
    """The Robotica paper's reading: no distance stops the robot, red only slows it; faulty data still does."""
    red_follows_separation: bool = eqx.field(static=True, default=True)
    """Red is also bounded by v(d), so that S_p <= d always; False: power and force limiting alone rules red."""


class PflParams(eqx.Module):
    """Moving masses for power and force limiting (ISO/TS 15066, A.3.4)."""

    arm_mass: float = 17.05
    """M, the moving links of a UR5 (sum of the maker's six link masses) [kg]."""
    payload: float = 1.0
    """m_L, gripper and part; a two-finger gripper weighs about this [kg]."""


class ClockParams(eqx.Module):
    """The clock of a path: how fast its parameter may change. All are our choice."""

    acceleration: float = 1.0
    """Largest acceleration along the path [m/s^2]."""
    deceleration: float = 1.0
    """Largest deceleration of a planned stop at the path's end [m/s^2]."""
    brake: float = 3.0
    """Deceleration when the speed limit falls below the speed; not under `SsmParams.brake` [m/s^2]."""
    jerk: float = 10.0
    """Largest jerk of speeding up and of planned stops; braking for safety is not bounded by it [m/s^3]."""


class SafetyParams(eqx.Module):
    """All numbers of the safety layer."""

    ssm: SsmParams = eqx.field(default_factory=SsmParams)
    """Speed and separation."""
    zone: ZoneParams = eqx.field(default_factory=ZoneParams)
    """Zones."""
    pfl: PflParams = eqx.field(default_factory=PflParams)
    """Power and force."""
    max_age: float = 0.1
    """Person data older than this stop the robot; not more than the reaction time allows for [s]."""
