"""The rows: value, unit, definition and bar of each."""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.hand import calibration_error

from .measure import Looked

Rows = dict[str, dict[str, Any]]
BARS = {
    "accuracy": (">=", 0.97),
    "accuracy_turned": (">=", 0.95),
    "rejected": (">=", 0.95),
    "calibration_error": ("<", 0.03),
    "false_starts": ("<=", 0),
    "stop_frames": ("<=", 2),
    "go_least_delay": (">=", 0.5),
    "flicker_stop_frames": ("<=", 3),
    "flicker_stops": (">=", 1),
    "flicker_gos": ("<=", 0),
}
"""Relation and bound of a row."""
WAYS = {"": "", "_rule": "; by the rule of extended fingers", "_plain": "; by the plain network of 42, 32 and 3 units"}
DEFINITIONS = {
    "rows": "rows of the held-out blocks",
    "accuracy": "held-out rows whose gesture is right; none counts as wrong",
    "accuracy_turned": "the same with up to 20 degrees of turn and 3 % of noise, mean of five draws",
    "rejected": "least of the following shares of hands in disorder that are taken for none",
    "rejected_shuffled": "landmarks in another order",
    "rejected_mixed": "every landmark from another hand; training saw no such",
    "rejected_cloud": "points of a normal distribution; training saw uniform ones",
    "rejected_torn": "every finger in the place of another; training saw no such",
    "rejected_other": "hands with other fingers extended that are taken for none; made of held-out hands",
    "calibration_error": "expected calibration error of held-out rows, 15 bins",
    "false_starts_more": "the same in further streams by other draws",
    "minutes_more": "their duration",
    "false_starts": "go commands in a stream without a closed hand of half a second",
    "false_goals": "in the same stream: home, and point where nobody pointed",
    "stream_minutes": "its duration",
    "false_stops": "in all these streams: parts with a stop where no hand was open, nor in the sixth of a second before",
    "stop_frames": "frames until an open hand stops the arm, median",
    "stops_seen": "open hands of 1.5 s that stop the arm",
    "stops_at_once": "of those, within two frames",
    "go_least_delay": "least time from the begin of a closed hand to its go",
    "go_delay": "the same, median",
    "gos_seen": "closed hands of 1.5 s that let the arm go on",
    "point_delay": "time from the begin of a pointing hand to its command, median",
    "points_seen": "pointing hands of 1.5 s that are a command",
    "flicker_stop_frames": "frames until an open hand stops the arm of which every second image sees nothing, median: its second vote is in the third",
    "flicker_stops": "open hands of 1.5 s so seen that stop the arm",
    "flicker_gos": "closed hands so seen that let the arm go on",
}


def row(value: Any, unit: str = "1") -> dict[str, Any]:
    """One row."""
    return {"value": float(value), "unit": unit}


def holds(name: str, value: float) -> bool | None:
    """Whether a row is within its bar; None: it has none."""
    if name not in BARS:
        return None
    relation, bound = BARS[name]
    return {">=": value >= bound, "<=": value <= bound, "<": value < bound}[relation]


def definition(name: str) -> str:
    """What a row measures."""
    for end, words in WAYS.items():
        if end and name.endswith(end):
            return DEFINITIONS.get(name.removesuffix(end), "") + words
    return DEFINITIONS.get(name, "")


def looked_rows(seen: Looked, end: str = "") -> Rows:
    """Rows of a classifier on held-out blocks."""
    error = calibration_error(jnp.asarray(seen.probability), jnp.asarray(seen.gesture))
    rows = {"accuracy": seen.accuracy, "accuracy_turned": seen.turned, "calibration_error": error}
    rows |= {"rejected": min(seen.rejected.values()), "rejected_other": seen.other}
    if not end:
        rows |= {f"rejected_{name}": share for name, share in seen.rejected.items()}
    return {name + end: row(value) for name, value in rows.items()}


def delay_rows(delays: Mapping[str, NDArray], rate: float) -> Rows:
    """Rows of commands that should be noticed."""
    stop, go, point = delays["open"], delays["closed"], delays["pointing"]
    return {
        "stop_frames": row(np.median(stop) * rate, "frames"),
        "stops_seen": row(np.isfinite(stop).mean()),
        "stops_at_once": row((stop * rate < 2.5).mean()),
        "go_least_delay": row(go.min(), "s"),
        "go_delay": row(np.median(go), "s"),
        "gos_seen": row(np.isfinite(go).mean()),
        "point_delay": row(np.median(point), "s"),
        "points_seen": row(np.isfinite(point).mean()),
    }


def flicker_rows(delays: Mapping[str, NDArray], rate: float) -> Rows:
    """Rows of commands that every second image sees."""
    stop = delays["open"]
    return {
        "flicker_stop_frames": row(np.median(stop) * rate, "frames"),
        "flicker_stops": row(np.isfinite(stop).mean()),
        "flicker_gos": row(np.isfinite(delays["closed"]).mean()),
    }
