"""A run as it is stored, and its measures."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .measures import Measured, measured
from .trace import Event, Trace, arrivals

ARRAYS = (
    "t", "q", "qd", "tool", "separation", "clearance", "known", "lag", "zone", "probe_t", "probe_known", "probe_true",
)  # fmt: skip
GAP = 0.03
"""Distance at which a configuration counts as known to be in collision, for all systems: the baseline's padding [m]."""


def kept(trace: Trace) -> dict[str, Any]:
    """The arrays of a run to be stored."""
    events = np.array([[str(x) for x in event] for event in trace.events], str)
    return {"dt": trace.dt, "events": events, **{name: getattr(trace, name) for name in ARRAYS}}


def trace_of(case: Mapping[str, NDArray]) -> Trace:
    """The run of stored arrays."""
    events = [Event(float(t), str(what), float(v)) for t, what, v in case["events"].reshape(-1, 3)]
    arrays: dict[str, Any] = {name: case[name] for name in ARRAYS}
    return Trace(float(case["dt"]), **arrays, events=events)


def measures_of(trace: Trace, ends: NDArray) -> Measured:
    """The measures of a run.

    Args:
        ends: (2 3) the waypoints [m].
    """
    return measured(
        trace.tool, trace.qd, trace.dt, trace.separation, trace.clearance, arrivals(trace.tool, ends, trace.dt),
        trace.probe_true, trace.probe_known, GAP,
    )  # fmt: skip
