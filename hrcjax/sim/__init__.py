"""The cell: parameters, sensing of a world, one control tick, an episode as a scan of ticks, and its outcome."""

from hrcjax.sim.cell import Cell, World
from hrcjax.sim.chosen_place import (
    PLACE_REASONS,
    ChosenPlace,
    PlaceParams,
    ToolPlace,
    chosen_place,
    describe_place,
    reached_place,
    tool_place,
)
from hrcjax.sim.default_parts import (
    ARM_PLANNER,
    GP_FIELD,
    SEPARATION_MONITOR,
    arm_planner,
    fit_fields,
    potential_planner,
    read_fields,
    rmp_policy,
    separation_monitor,
)
from hrcjax.sim.episode import Episode, episode, follow
from hrcjax.sim.outcome import Outcome, Traces, outcome
from hrcjax.sim.params import MotionParams, Params
from hrcjax.sim.parts import (
    ArmMotion,
    Clearance,
    FieldPart,
    Fields,
    Goal,
    Reading,
    SafetyPart,
    Separation,
    Task,
    path_through,
)
from hrcjax.sim.prepare import make_world
from hrcjax.sim.sensing import Frames, sense_sequence
from hrcjax.sim.survey import SCENE_LAYOUT, SenseParams, Survey
from hrcjax.sim.tick import Record, Sensed, TickState, tick

__all__ = ["ARM_PLANNER", "GP_FIELD", "PLACE_REASONS", "SCENE_LAYOUT", "SEPARATION_MONITOR", "ArmMotion", "Cell", "ChosenPlace", "Clearance", "Episode", "FieldPart", "Fields", "Frames", "Goal", "MotionParams", "Outcome", "Params", "PlaceParams", "Reading", "Record", "SafetyPart", "SenseParams", "Sensed", "Separation", "Survey", "Task", "TickState", "ToolPlace", "Traces", "World", "arm_planner", "chosen_place", "describe_place", "episode", "fit_fields", "follow", "make_world", "outcome", "path_through", "potential_planner", "reached_place", "read_fields", "rmp_policy", "sense_sequence", "separation_monitor", "tick", "tool_place"]  # fmt: skip
