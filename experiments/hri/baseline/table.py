"""The baseline alone in some scenes: a line of measures for each, kept as a trace and taken from there the next time."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from hrcjax.cells.people import make_people, person_key
from hrcjax.cells.ur5 import make_cell
from hrcjax.lab.case_store import RunStore
from hrcjax.lab.provenance import LOADED_CODE, fingerprint, program_digests
from hrcjax.lab.table import aligned
from hrcjax.world import scene_named

from ..measures import Measured, measured
from .baseline import Event
from .episode import Trace, baseline_episode
from .settings import BaselineSettings

ARRAYS = ("t", "q", "qd", "tool", "separation", "clearance", "known", "lag", "probe_t", "probe_known", "probe_true")
AFTERWARDS = ("table.py", "figures.py", "__main__.py", "__init__.py")
"""Files that only read finished traces."""
SHOWN = (
    "legs", "cycle_time", "leg_length", "min_separation", "min_clearance", "contacts", "contacts_standing", "recall", "false_alarms", "variance_x",
    "variance_y", "variance_z", "total_jerk", "msj", "curvature", "msj_si", "jerk_si", "curvature_si", "sparc",
)  # fmt: skip


def identity() -> dict[str, Any]:
    """Everything but the options of a run that decides a trace."""
    parts = {name: metadata.version(name) for name in ("ompl", "pyoctomap", "toppra")}
    return {"code": LOADED_CODE, "program": program_digests(Path(__file__).parent, AFTERWARDS), "parts": parts}


def kept_trace(
    store: RunStore, scene: str, person: str, seed: int, seconds: float, settings: BaselineSettings
) -> Trace:  # fmt: skip
    """The trace of an episode, from the store or run now."""
    mark = fingerprint({"seconds": seconds, "settings": asdict(settings)})[:10]
    name = f"{scene}-{person_key(person)}-{seed}-{mark}"
    data, _ = store.take(name, lambda: _played(scene, person, seed, seconds, settings))
    events = [Event(float(t), str(what), float(v)) for t, what, v in data["events"].reshape(-1, 3)]
    arrays: dict[str, Any] = {name: data[name] for name in ARRAYS}
    return Trace(float(data["dt"]), **arrays, events=events)


def _played(scene: str, person: str, seed: int, seconds: float, settings: BaselineSettings) -> dict[str, Any]:
    cell = make_cell()
    cell = replace(cell, ticks=round(seconds / cell.dt))
    place = scene_named(scene, seed)
    trace = baseline_episode(cell, place, make_people(person, place, seed, seconds, cell.people), settings, seed)
    events = np.array([[str(x) for x in event] for event in trace.events], str)
    return {"dt": trace.dt, "events": events, **{name: getattr(trace, name) for name in ARRAYS}}


def measures_of(trace: Trace, gap: float) -> Measured:
    """The measures of a trace; a configuration is held to be in collision within `gap` of the octree [m]."""
    arrivals = [event.t for event in trace.events if event.what == "arrived"]
    return measured(
        trace.tool, trace.qd, trace.dt, trace.separation, trace.clearance, arrivals, trace.probe_true, trace.probe_known, gap
    )  # fmt: skip


def rows(
    store: RunStore, scene: str, people: Sequence[str], seeds: Sequence[int], seconds: float, settings: BaselineSettings
) -> list[list[str]]:  # fmt: skip
    """A line for each person and seed: names, stops, searches, failed ones, then SHOWN."""
    lines = []
    for person in people:
        for seed in seeds if person != "nobody" else seeds[:1]:
            trace = kept_trace(store, scene, person, seed, seconds, settings)
            found = measures_of(trace, settings.watch_gap)._asdict()
            count = [sum(event.what == what for event in trace.events) for what in ("stop", "planned", "failed")]
            lines.append([person, str(seed), *map(str, count), *(f"{found[name]:.3g}" for name in SHOWN)])
            print(" ".join(lines[-1]), flush=True)
    return lines


HEAD = ["person", "seed", "stops", "plans", "failed", *SHOWN]


def text(lines: Sequence[Sequence[str]]) -> str:
    """The lines aligned in columns."""
    return aligned([HEAD, *lines])
