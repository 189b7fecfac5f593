"""Speed and separation, power and force, zones, and the clock of a path. Research software, not safety-rated."""

from hrcjax.safety.between import between_factor, half_gaps
from hrcjax.safety.by_now import nearest_by_now
from hrcjax.safety.clock import ClockState, advance, initial_clock, stop_length
from hrcjax.safety.coming import Coming, at_the_nearest, measured_distance, measured_limit, row_thresholds
from hrcjax.safety.cone import direction_sine, steep_limit, worst_approach
from hrcjax.safety.contact_mass import ContactMobility, link_neighbours
from hrcjax.safety.governed import approach_rows, governed, has_direction, unit_direction
from hrcjax.safety.governor import approach_speeds, governor, guard, speed_scale
from hrcjax.safety.least_change import APPROACH_TOLERANCE, UNLIMITED, least_change
from hrcjax.safety.monitor import (
    COMMANDED,
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
from hrcjax.safety.path_speed import path_speed
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
from hrcjax.safety.surface_limit import surface_limit
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
    "APPROACH_TOLERANCE", "BODY_REGIONS", "COMMANDED", "GREEN", "HEAD_NEAR", "INVALID_FRAME", "MISSING_DATA", "OLD_DATA", "RED",
    "STOP", "TOO_CLOSE", "UNLIMITED", "WAITING", "YELLOW", "ZONE_NAMES", "BodyRegion", "ClockParams", "ClockState", "Coming", "ContactMobility",
    "PflParams", "SafetyDecision", "SafetyParams", "SsmParams", "ZoneParams", "ZoneState", "ZoneThresholds", "advance",
    "allowed_speed", "approach_rows", "approach_speeds", "assumed_human_speed", "at_the_nearest", "between_factor", "contact_mobility",
    "describe", "direction_sine", "effective_mass", "governed", "governor", "guard", "half_gaps", "has_direction", "initial_clock",
    "initial_zone", "least_change", "link_neighbours", "measured_distance", "measured_limit", "monitor", "nearest_by_now", "path_speed", "pfl_speed", "pfl_speeds", "protective_distance",
    "reduced_mass", "reduced_mass_of_mobility", "reflected_mass", "row_thresholds", "safe_distance", "separation_distance",
    "speed_scale", "steep_limit", "stop_length", "stopping_distance", "stopping_time", "surface_limit", "unit_direction",
    "update_zone", "worst_approach", "zone_at", "zone_speed", "zone_thresholds",
]  # fmt: skip
