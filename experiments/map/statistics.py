"""Statistics of a run as JSON values: counts of each frame, and totals."""

import dataclasses
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hrcjax.lab.parameters import numbers_of
from hrcjax.map import LABELS, FieldMap, MapLayout, MapParams, StreamParams, labelled_points

from .mapper import COUNTS, LAST, Taken

VERSION = 2
SUMMED = tuple(name for name in COUNTS if name not in LAST)


def statistics(
    frames: Sequence[Taken],
    reading: Sequence[float],
    layout: MapLayout,
    params: MapParams,
    limits: StreamParams,
    state: FieldMap,
    compile_seconds: float,
    not_read: Mapping[str, int],
    about: Mapping[str, Any],
) -> dict[str, Any]:
    """The statistics of a run.

    Args:
        frames: result of each.
        reading: time to read each frame [s].
        not_read: reason -> number of frames that the reader skipped.
        about: further entries.
    """
    used = [frame for frame in frames if not frame.refused]
    ms = 1e3 * np.array([frame.seconds for frame in used])
    points, labels = labelled_points(state)
    totals: dict[str, Any] = {
        "frames": len(frames),
        "used": len(used),
        "refused": dict(Counter(frame.refused for frame in frames if frame.refused)),
        "not_read": dict(not_read),
        "points": len(points),
        **{f"points_{name}": int(np.sum(labels == k)) for k, name in enumerate(LABELS) if k},
        "blocks": int(np.sum(np.asarray(state.levels[0].place)[:, 0] > 0)),
        **{name: sum(frame.counts[name] for frame in used) for name in SUMMED},
        "most_lost": max((frame.counts["lost"] for frame in used), default=0),
        "most_unseen": max((frame.counts["unseen"] for frame in used), default=0),
        "waiting": int(np.sum(np.asarray(state.stale))),
        "ms_median": float(np.median(ms)) if len(ms) else None,
        "ms_p95": float(np.percentile(ms, 95)) if len(ms) else None,
        "read_ms_median": 1e3 * float(np.median(reading)) if len(reading) else None,
        "compile_s": compile_seconds,
    }
    columns: dict[str, list[Any]] = {
        "stamp": [frame.stamp if np.isfinite(frame.stamp) else None for frame in frames],
        "camera": [frame.camera for frame in frames],
        "refused": [frame.refused for frame in frames],
        "ms": [1e3 * frame.seconds for frame in frames],
        "read_ms": [1e3 * seconds for seconds in reading],
        **{name: [frame.counts[name] for frame in frames] for name in COUNTS},
    }
    return {
        "version": VERSION,
        **about,
        "layout": dataclasses.asdict(layout),
        "params": {**numbers_of(params), **numbers_of(limits)},
        "totals": totals,
        "frames": columns,
    }
