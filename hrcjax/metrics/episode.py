"""All measures of one run, from its arrays over time."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.geom.bending_energy import bending_energy
from hrcjax.geom.length import length
from hrcjax.geom.resample import resample_path
from hrcjax.metrics.clearance import min_clearance, time_below, time_in_zones
from hrcjax.metrics.energy import energy
from hrcjax.metrics.score import (
    ScoreParams,
    collision_risk,
    efficiency_score,
    joint_smoothness,
    obstacle_proximity,
    overall_score,
    power_score,
    safe_navigation,
    safety_score,
    task_time_score,
    trajectory_smoothness,
)
from hrcjax.metrics.smoothness import jerk_rms, log_dimensionless_jerk, spectral_arc_length
from hrcjax.metrics.timing import arrival
from hrcjax.numerics import safe_norm
from hrcjax.typing import Array, Float, Int, Scalar

_TOOL_WAYPOINTS = 64


class EpisodeMetrics(eqx.Module):
    """The measures of one run. Units, senses and meanings: `METRICS`."""

    time_to_goal: Float[Array, ""]
    """[s]."""
    success: Float[Array, ""]
    """0 or 1 [1]."""
    goal_error: Float[Array, ""]
    """[m]."""
    plan_length: Float[Array, ""]
    """[m]."""
    plan_bending_energy: Float[Array, ""]
    """[1/m]."""
    tool_length: Float[Array, ""]
    """[m]."""
    tool_bending_energy: Float[Array, ""]
    """[1/m]."""
    clearance: Float[Array, ""]
    """[m]."""
    separation: Float[Array, ""]
    """[m]."""
    jerk_rms: Float[Array, ""]
    """[m/s^3]."""
    log_dimensionless_jerk: Float[Array, ""]
    """[1]."""
    sparc: Float[Array, ""]
    """[1]."""
    time_green: Float[Array, ""]
    """[s]."""
    time_yellow: Float[Array, ""]
    """[s]."""
    time_red: Float[Array, ""]
    """[s]."""
    time_stop: Float[Array, ""]
    """[s]."""
    time_below_sp: Float[Array, ""]
    """[s]."""
    energy: Float[Array, ""]
    """[J]."""
    score_safety: Float[Array, ""]
    """[1]."""
    score_efficiency: Float[Array, ""]
    """[1]."""
    score_overall: Float[Array, ""]
    """[1]."""


METRICS: dict[str, tuple[str, str, str]] = {
    "time_to_goal": ("s", "low", "time until the tool stays at the goal; the length of the episode if it never does"),
    "success": ("1", "high", "1 if the goal was reached, else 0"),
    "goal_error": ("m", "low", "distance to the goal at arrival or at the end"),
    "plan_length": ("m", "low", "length of the planned path"),
    "plan_bending_energy": ("1/m", "low", "bending energy of the planned path"),
    "tool_length": ("m", "low", "length of the way the tool went"),
    "tool_bending_energy": ("1/m", "low", "bending energy of the way the tool went"),
    "clearance": (
        "m",
        "high",
        "smallest true distance of the arm to an obstacle, in the whole episode; NaN: none there",
    ),
    "separation": (
        "m",
        "high",
        "smallest true distance of the arm to the person, in the whole episode; NaN: nobody there",
    ),
    "jerk_rms": ("m/s^3", "low", "root of the mean squared jerk of the tool"),
    "log_dimensionless_jerk": ("1", "high", "-ln of the tool's dimensionless jerk"),
    "sparc": ("1", "high", "spectral arc length of the tool's speed, negative"),
    "time_green": ("s", "high", "time in the green zone until arrival"),
    "time_yellow": ("s", "low", "time in the yellow zone until arrival"),
    "time_red": ("s", "low", "time in the red zone until arrival"),
    "time_stop": ("s", "low", "time stopped by the safety layer until arrival"),
    "time_below_sp": ("s", "low", "time nearer to the person than the protective separation distance, until arrival"),
    "energy": ("J", "low", "mechanical work of the joints, braking counted as driving"),
    "score_safety": ("1", "high", "safety score of the Robotica paper, out of 100"),
    "score_efficiency": ("1", "high", "efficiency score of the Robotica paper, out of 100"),
    "score_overall": ("1", "high", "overall score of the Robotica paper, out of 100"),
}
"""Of every field of `EpisodeMetrics`: its unit, whether low or high is better, and its meaning."""


def episode_metrics(
    *,
    dt: Scalar,
    tool: Float[Array, "time 3"],
    q: Float[Array, "time joint"],
    qd: Float[Array, "time joint"],
    qdd: Float[Array, "time joint"],
    tau: Float[Array, "time joint"],
    zone: Int[Array, "time"],
    separation: Float[Array, "time2"],
    closing_speed: Float[Array, "time2"],
    obstacle_distances: Float[Array, "time2 obstacle"],
    clearance: Float[Array, "time2"],
    protective_distance: Float[Array, "time2"] | Scalar,
    goal: Float[Array, "3"],
    tolerance: Scalar,
    ideal_time: Scalar,
    plan_length: Scalar,
    plan_bending_energy: Scalar,
    unsafe_distance: Scalar,
    slow: Scalar = 0.05,
    score: ScoreParams | None = None,
    largest_power: Scalar | None = None,
    largest_joint_speed: Scalar | None = None,
    largest_proximity: Scalar | None = None,
    smoothness_stride: int = 1,
) -> EpisodeMetrics:
    """All measures of one run. Samples after the arrival at the goal don't count, apart from clearance and separation.

    The arrays over time2 may be every k-th sample of the run, the first included: k is found from their length.

    Args:
        dt: time between samples [s].
        tool: tool positions [m].
        q: joint positions [rad].
        qd: joint speeds [rad/s].
        qdd: joint accelerations [rad/s^2].
        tau: joint torques [N m].
        zone: 0 green, 1 yellow, 2 red, 3 stop.
        separation: true distance of the whole arm to the person [m].
        closing_speed: speed at which robot and person close in on each other, positive for an approach [m/s].
        obstacle_distances: distance to every obstacle of the scene [m].
        clearance: true distance of the whole arm to the nearest obstacle [m].
        protective_distance: S_p at the robot's speed, over time or constant [m].
        goal: [m].
        tolerance: distance to the goal that counts as reached [m].
        ideal_time: time of the task without person and zones [s].
        plan_length: of the planned path [m].
        plan_bending_energy: of the planned path [1/m].
        unsafe_distance: separation under which time is unsafe in the score [m].
        slow: largest speed of the tool that counts as arrived [m/s].
        score: weights of the score; None: the paper's.
        largest_power: normaliser of the power score; None: of this run [W].
        largest_joint_speed: normaliser of joint smoothness; None: of this run [rad/s].
        largest_proximity: normaliser of obstacle proximity; None: of this run [m].
        smoothness_stride: every so many samples enter the smoothness measures; in float32 choose 50 Hz or less.

    Raises:
        ValueError: the arrays over time2 are not every k-th sample of those over time.
    """
    score = ScoreParams() if score is None else score
    dt = jnp.asarray(dt, tool.dtype)
    reached = arrival(tool, goal, tolerance, dt, slow)
    mask = reached.before
    stride = _stride(tool.shape[0], separation.shape[0])
    mask2, dt2 = mask[::stride], dt * stride

    way = jnp.where(mask[:, None], tool, tool[jnp.sum(mask) - 1])
    waypoints = resample_path(way, _TOOL_WAYPOINTS)
    x, rate = tool[::smoothness_stride], 1 / (dt * smoothness_stride)
    counts = mask[::smoothness_stride]
    speed = safe_norm(jnp.diff(x, axis=0)) * rate
    zones = time_in_zones(zone, dt, mask)

    safety = safety_score(
        score,
        safe_navigation(separation, unsafe_distance, mask2),
        obstacle_proximity(separation, obstacle_distances, mask2, largest_proximity),
        collision_risk(separation, closing_speed, score.horizon, mask2),
    )
    efficiency = efficiency_score(
        score,
        task_time_score(ideal_time, jnp.maximum(reached.time, dt)),
        power_score(tau, qd, mask, largest_power),
        trajectory_smoothness(qdd, mask),
        joint_smoothness(q, dt, mask, largest_joint_speed),
    )
    return EpisodeMetrics(
        time_to_goal=reached.time,
        success=reached.success.astype(tool.dtype),
        goal_error=reached.error,
        plan_length=jnp.asarray(plan_length, tool.dtype),
        plan_bending_energy=jnp.asarray(plan_bending_energy, tool.dtype),
        tool_length=length(way),
        tool_bending_energy=bending_energy(waypoints),
        clearance=min_clearance(clearance),
        separation=min_clearance(separation),
        jerk_rms=jerk_rms(x, rate, counts),
        log_dimensionless_jerk=log_dimensionless_jerk(x, rate, counts),
        sparc=spectral_arc_length(speed, rate, counts[1:]),
        time_green=zones[0],
        time_yellow=zones[1],
        time_red=zones[2],
        time_stop=zones[3],
        time_below_sp=time_below(separation, protective_distance, dt2, mask2),
        energy=energy(tau, qd, dt, mask),
        score_safety=safety,
        score_efficiency=efficiency,
        score_overall=overall_score(score, safety, efficiency),
    )


def _stride(full: int, part: int) -> int:
    """The k for which every k-th of `full` samples are `part` samples."""
    stride = -(-full // part)
    if -(-full // stride) != part:
        raise ValueError(f"{part} samples are not every k-th of {full}: take array[::k] of every array over time2")
    return stride
