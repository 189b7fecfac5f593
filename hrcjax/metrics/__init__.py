"""Measures of a run: smoothness, clearance, time, energy and the performance score."""

from hrcjax.metrics.clearance import min_clearance, time_below, time_in_zones
from hrcjax.metrics.energy import energy, power
from hrcjax.metrics.episode import METRICS, EpisodeMetrics, episode_metrics
from hrcjax.metrics.run import Run, Yardstick
from hrcjax.metrics.samples import resample
from hrcjax.metrics.score import (
    ScoreParams,
    collision_risk,
    efficiency_score,
    joint_smoothness,
    obstacle_proximity,
    overall_score,
    power_score,
    relative_score,
    safe_navigation,
    safety_score,
    task_time_score,
    time_to_collision,
    trajectory_smoothness,
)
from hrcjax.metrics.smoothness import (
    acceleration_variance,
    dimensionless_jerk,
    jerk_rms,
    log_dimensionless_jerk,
    mean_curvature_change,
    mean_squared_difference_jerk,
    mean_squared_jerk,
    spectral_arc_length,
    total_jerk,
)
from hrcjax.metrics.sound_score import (
    SoundScoreParams,
    SoundTerms,
    sound_clearance,
    sound_energy,
    sound_jerk,
    sound_score,
    sound_separation,
    sound_time,
)
from hrcjax.metrics.timing import Arrival, arrival, ideal_time

__all__ = [
    "METRICS", "Arrival", "EpisodeMetrics", "Run", "ScoreParams", "SoundScoreParams", "SoundTerms", "Yardstick",
    "acceleration_variance", "arrival", "collision_risk", "dimensionless_jerk", "efficiency_score", "energy",
    "episode_metrics", "ideal_time", "jerk_rms", "joint_smoothness", "log_dimensionless_jerk",
    "mean_curvature_change", "mean_squared_difference_jerk", "mean_squared_jerk", "min_clearance",
    "obstacle_proximity", "overall_score", "power", "power_score", "relative_score", "resample",
    "safe_navigation", "safety_score", "sound_clearance", "sound_energy", "sound_jerk", "sound_score",
    "sound_separation", "sound_time", "spectral_arc_length", "task_time_score", "time_below", "time_in_zones",
    "time_to_collision", "total_jerk", "trajectory_smoothness",
]  # fmt: skip
