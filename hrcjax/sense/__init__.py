"""Sensing: a depth camera, its noise, its faults and its health, and point clouds from its images."""

from hrcjax.sense.camera import Camera, d435i, render_depth
from hrcjax.sense.faults import (
    FAULTS,
    Delivered,
    FaultSchedule,
    deliver,
    join_faults,
    no_faults,
    one_fault,
)
from hrcjax.sense.health import (
    HEALTH_REASONS,
    HealthParams,
    HealthState,
    describe_health,
    initial_health,
    judge_image,
    silent,
)
from hrcjax.sense.noise import NoiseParams

__all__ = [
    "FAULTS",
    "HEALTH_REASONS",
    "Camera",
    "Delivered",
    "FaultSchedule",
    "HealthParams",
    "HealthState",
    "NoiseParams",
    "d435i",
    "deliver",
    "describe_health",
    "initial_health",
    "join_faults",
    "judge_image",
    "no_faults",
    "one_fault",
    "render_depth",
    "silent",
]  # fmt: skip
