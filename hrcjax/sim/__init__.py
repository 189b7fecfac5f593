"""The cell: parameters, a world as sensed, one control tick, an episode as a scan of ticks, and its outcome."""

from hrcjax.sim.cell import Cell, Fields, World
from hrcjax.sim.episode import Episode, episode, fit_fields, follow, plan_path
from hrcjax.sim.outcome import Outcome, Traces, outcome
from hrcjax.sim.params import MotionParams, Params
from hrcjax.sim.prepare import make_world
from hrcjax.sim.sensing import CELL_LAYOUT, Frames, SenseParams, sense_sequence
from hrcjax.sim.tick import Record, Sensed, TickState, tick

__all__ = [
    "CELL_LAYOUT", "Cell", "Episode", "Fields", "Frames", "MotionParams", "Outcome", "Params", "Record", "SenseParams", "Sensed", "TickState", "Traces", "World",
    "episode", "fit_fields", "follow", "make_world", "outcome", "plan_path", "sense_sequence", "tick",
]  # fmt: skip
