"""The baseline alone in some scenes: a line of measures for each, kept as a trace and taken from there the next time."""

import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from hashlib import sha256
from pathlib import Path

import numpy as np

from hrcjax.cells.people import make_people
from hrcjax.cells.ur5 import make_cell
from hrcjax.lab.table import aligned
from hrcjax.world import scene_named

from ..measures import Measured, measured
from .baseline import Event
from .episode import Trace, baseline_episode
from .settings import BaselineSettings

ARRAYS = ("t", "q", "qd", "tool", "separation", "clearance", "known", "lag", "probe_t", "probe_known", "probe_true")
SHOWN = (
    "legs", "cycle_time", "leg_length", "min_separation", "min_clearance", "contacts", "contacts_standing", "recall", "false_alarms", "variance_x",
    "variance_y", "variance_z", "total_jerk", "msj", "curvature", "msj_si", "jerk_si", "curvature_si", "sparc",
)  # fmt: skip


def kept_trace(folder: Path, scene: str, person: str, seed: int, seconds: float, settings: BaselineSettings) -> Trace:
    """The trace of an episode, from its file or run now."""
    mark = sha256(json.dumps([scene, person, seed, seconds, asdict(settings)]).encode()).hexdigest()[:10]
    file = folder / f"{scene}-{person}-{seed}-{mark}.npz"
    if file.exists():
        with np.load(file) as data:
            events = [Event(float(t), str(what), float(v)) for t, what, v in data["events"]]
            return Trace(float(data["dt"]), **{name: data[name] for name in ARRAYS}, events=events)
    cell = make_cell()
    cell = replace(cell, ticks=round(seconds / cell.dt))
    place = scene_named(scene, seed)
    trace = baseline_episode(cell, place, make_people(person, place, seed, seconds, cell.people), settings, seed)
    folder.mkdir(parents=True, exist_ok=True)
    arrays = {name: getattr(trace, name) for name in ARRAYS}
    events = np.array([[str(x) for x in event] for event in trace.events])
    np.savez_compressed(file, dt=trace.dt, events=events, **arrays)
    return trace


def measures_of(trace: Trace, gap: float) -> Measured:
    """The measures of a trace; a configuration is held to be in collision within `gap` of the octree [m]."""
    arrivals = [event.t for event in trace.events if event.what == "arrived"]
    return measured(
        trace.tool, trace.qd, trace.dt, trace.separation, trace.clearance, arrivals, trace.probe_true, trace.probe_known, gap
    )  # fmt: skip


def rows(
    folder: Path, scene: str, people: Sequence[str], seeds: Sequence[int], seconds: float, settings: BaselineSettings
) -> list[list[str]]:  # fmt: skip
    """A line for each person and seed: names, stops, searches, failed ones, then SHOWN."""
    lines = []
    for person in people:
        for seed in seeds if person != "nobody" else seeds[:1]:
            trace = kept_trace(folder, scene, person, seed, seconds, settings)
            found = measures_of(trace, settings.watch_gap)._asdict()
            count = [sum(event.what == what for event in trace.events) for what in ("stop", "planned", "failed")]
            lines.append([person, str(seed), *map(str, count), *(f"{found[name]:.3g}" for name in SHOWN)])
            print(" ".join(lines[-1]), flush=True)
    return lines


HEAD = ["person", "seed", "stops", "plans", "failed", *SHOWN]


def text(lines: Sequence[Sequence[str]]) -> str:
    """The lines aligned in columns."""
    return aligned([HEAD, *lines])
