"""All measures of one run, from its arrays over time."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.geom.bending_energy import bending_energy
from hrcjax.geom.length import length
from hrcjax.geom.resample import resample_path
from hrcjax.metrics.clearance import min_clearance, time_below, time_in_zones
from hrcjax.metrics.energy import energy
from hrcjax.metrics.run import Run, Yardstick
from hrcjax.metrics.score import (
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
from hrcjax.metrics.sound_score import (
    SoundTerms,
    sound_clearance,
    sound_energy,
    sound_jerk,
    sound_score,
    sound_separation,
    sound_time,
)
from hrcjax.metrics.timing import Arrival, arrival
from hrcjax.numerics import safe_divide, safe_norm
from hrcjax.typing import Array, Bool, Float, Scalar

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
    sound_clearance: Float[Array, ""]
    """[1]."""
    sound_separation: Float[Array, ""]
    """[1]."""
    sound_time: Float[Array, ""]
    """[1]."""
    sound_jerk: Float[Array, ""]
    """[1]."""
    sound_energy: Float[Array, ""]
    """[1]."""
    score_sound: Float[Array, ""]
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
        "smallest true distance of the arm to an obstacle, until 1 s after the arrival; NaN: none there",
    ),
    "separation": (
        "m",
        "high",
        "smallest true distance of the arm to the person, until 1 s after the arrival; NaN: nobody there",
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
    "sound_clearance": ("1", "high", "0 at contact with an obstacle, 100 from 5 cm of clearance on"),
    "sound_separation": ("1", "high", "100 less the share of time, by depth, below the protective separation distance"),
    "sound_time": ("1", "high", "100 times the time of the straight way over the time to the goal"),
    "sound_jerk": ("1", "high", "100 for a minimum-jerk motion of the tool; falls with ln of the dimensionless jerk"),
    "sound_energy": ("1", "high", "100 for no work of the joints, 50 for 30 J"),
    "score_sound": (
        "1",
        "high",
        "mean of the five sound terms, on 20 to 100; below 10 where the goal was not reached or the arm touched something",
    ),
}
"""Of every field of `EpisodeMetrics`: its unit, whether low or high is better, and its meaning."""


def episode_metrics(run: Run, yardstick: Yardstick) -> EpisodeMetrics:
    """All measures of one run. Samples after the arrival at the goal don't count, apart from clearance and separation.

    Raises:
        ValueError: the arrays over sample are not every k-th sample of those over time.
    """
    tool, dtype = run.tool, run.tool.dtype
    dt = jnp.asarray(run.dt, dtype)
    reached = arrival(tool, yardstick.goal, yardstick.tolerance, dt, yardstick.slow)
    before = reached.before
    way = jnp.where(before[:, None], tool, tool[jnp.sum(before) - 1])
    safety = _safety(run, yardstick, before)
    efficiency = _efficiency(run, yardstick, before, jnp.maximum(reached.time, dt))
    jerk, log_jerk, sparc = _smoothness(run, yardstick, before)
    zones = time_in_zones(run.zone, dt, before)
    stride, work = run.stride, energy(run.tau, run.qd, dt, before)
    terms = _sound(run, yardstick, reached, log_jerk, work)
    return EpisodeMetrics(
        time_to_goal=reached.time,
        success=reached.success.astype(dtype),
        goal_error=reached.error,
        plan_length=jnp.asarray(run.plan_length, dtype),
        plan_bending_energy=jnp.asarray(run.plan_bending_energy, dtype),
        tool_length=length(way),
        tool_bending_energy=bending_energy(resample_path(way, _TOOL_WAYPOINTS)),
        clearance=_least(run.least_clearance, run.clearance),
        separation=_least(run.least_separation, run.separation),
        jerk_rms=jerk,
        log_dimensionless_jerk=log_jerk,
        sparc=sparc,
        time_green=zones[0],
        time_yellow=zones[1],
        time_red=zones[2],
        time_stop=zones[3],
        time_below_sp=time_below(run.separation, run.protective_distance, dt * stride, before[::stride]),
        energy=work,
        score_safety=safety,
        score_efficiency=efficiency,
        score_overall=overall_score(yardstick.score, safety, efficiency),
        sound_clearance=terms.clearance,
        sound_separation=terms.separation,
        sound_time=terms.time,
        sound_jerk=terms.jerk,
        sound_energy=terms.energy,
        score_sound=sound_score(yardstick.sound, reached.success & ~_touched(run, yardstick), terms),
    )


def _sound(
    run: Run, yardstick: Yardstick, reached: Arrival, log_jerk: Float[Array, ""], work: Float[Array, ""]
) -> SoundTerms:
    """The terms of the sound score, from the smoothness and the energy [J] of the run."""
    sound, before = yardstick.sound, reached.before[:: run.stride]
    straight = yardstick.straight_time
    if straight is None:
        share = safe_divide(safe_norm(yardstick.goal - run.tool[0]), jnp.asarray(run.plan_length, run.tool.dtype), 1.0)
        straight = yardstick.ideal_time * jnp.minimum(share, 1.0)
    return SoundTerms(
        clearance=sound_clearance(_least(run.least_clearance, run.clearance), sound.full_clearance),
        separation=sound_separation(run.separation, run.protective_distance, before),
        time=sound_time(straight, reached.time),
        jerk=sound_jerk(log_jerk, sound.jerk_scale),
        energy=sound_energy(work, sound.half_energy),
    )


def _touched(run: Run, yardstick: Yardstick) -> Bool[Array, ""]:
    """Whether arm and obstacle, or arm and person, touched; of samples alone, the person only while the arm moved."""
    person = run.touched
    if person is None:
        moving = jnp.max(jnp.abs(run.qd[:: run.stride]), axis=1) > yardstick.moving
        person = jnp.any(moving & (run.separation < 0))
    return (_least(run.least_clearance, run.clearance) < 0) | person


def _least(known: Scalar | None, samples: Float[Array, "sample"]) -> Float[Array, ""]:
    """The least distance, as it is known or as the samples say [m]."""
    return min_clearance(samples) if known is None else jnp.asarray(known, samples.dtype)


def _safety(run: Run, yardstick: Yardstick, before: Bool[Array, "time"]) -> Float[Array, ""]:
    """Safety score, out of 100."""
    score, before = yardstick.score, before[:: run.stride]
    return safety_score(
        score,
        safe_navigation(run.separation, yardstick.unsafe_distance, before),
        obstacle_proximity(run.separation, run.obstacle_distances, before, yardstick.largest_proximity),
        collision_risk(run.separation, run.closing_speed, score.horizon, before),
    )


def _efficiency(
    run: Run, yardstick: Yardstick, before: Bool[Array, "time"], total_time: Float[Array, ""]
) -> Float[Array, ""]:
    """Efficiency score, out of 100."""
    return efficiency_score(
        yardstick.score,
        task_time_score(yardstick.ideal_time, total_time),
        power_score(run.tau, run.qd, before, yardstick.largest_power),
        trajectory_smoothness(run.qdd, before),
        joint_smoothness(run.q, jnp.asarray(run.dt, run.tool.dtype), before, yardstick.largest_joint_speed),
    )


def _smoothness(
    run: Run, yardstick: Yardstick, before: Bool[Array, "time"]
) -> tuple[Float[Array, ""], Float[Array, ""], Float[Array, ""]]:
    """Of the tool: jerk [m/s^3], log dimensionless jerk [1], spectral arc length [1]."""
    k = yardstick.smoothness_stride
    x, rate, counts = run.tool[::k], 1 / (jnp.asarray(run.dt, run.tool.dtype) * k), before[::k]
    speed = safe_norm(jnp.diff(x, axis=0)) * rate
    return (
        jerk_rms(x, rate, counts),
        log_dimensionless_jerk(x, rate, counts),
        spectral_arc_length(speed, rate, counts[1:]),
    )
