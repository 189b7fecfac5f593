"""Speed and separation, power and force, zones, and the clock of a path. Research software, not safety-rated."""

from hrcjax.safety.clock import ClockState, advance, initial_clock, stop_length
from hrcjax.safety.governor import approach_speeds, governor, guard, speed_scale
from hrcjax.safety.monitor import (
    HEAD_NEAR,
    INVALID_FRAME,
    MISSING_DATA,
    OLD_DATA,
    TOO_CLOSE,
    WAITING,
    SafetyDecision,
    describe,
    monitor,
)
from hrcjax.safety.params import ClockParams, PflParams, SafetyParams, SsmParams, ZoneParams
from hrcjax.safety.pfl import (
    BODY_REGIONS,
    BodyRegion,
    contact_mobility,
    effective_mass,
    pfl_speed,
    pfl_speeds,
    reduced_mass,
    reduced_mass_of_mobility,
    reflected_mass,
)
from hrcjax.safety.ssm import (
    allowed_speed,
    assumed_human_speed,
    protective_distance,
    safe_distance,
    separation_distance,
    stopping_distance,
    stopping_time,
)
from hrcjax.safety.zones import (
    GREEN,
    RED,
    STOP,
    YELLOW,
    ZONE_NAMES,
    ZoneState,
    ZoneThresholds,
    initial_zone,
    update_zone,
    zone_at,
    zone_speed,
    zone_thresholds,
)

__all__ = [
    "BODY_REGIONS", "GREEN", "HEAD_NEAR", "INVALID_FRAME", "MISSING_DATA", "OLD_DATA", "RED", "STOP", "TOO_CLOSE",
    "WAITING", "YELLOW", "ZONE_NAMES", "BodyRegion", "ClockParams", "ClockState", "PflParams", "SafetyDecision",
    "SafetyParams", "SsmParams", "ZoneParams", "ZoneState", "ZoneThresholds", "advance", "allowed_speed",
    "approach_speeds", "assumed_human_speed", "contact_mobility", "describe", "effective_mass", "governor", "guard",
    "initial_clock", "initial_zone", "monitor", "pfl_speed", "pfl_speeds", "protective_distance", "reduced_mass",
    "reduced_mass_of_mobility", "reflected_mass", "safe_distance", "separation_distance", "speed_scale", "stop_length",
    "stopping_distance", "stopping_time", "update_zone", "zone_at", "zone_speed", "zone_thresholds",
]  # fmt: skip
