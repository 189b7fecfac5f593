"""Faults of the cameras beside a person: short ones at many moments, and one that stays."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.sense import FaultSchedule, join_faults, one_fault
from hrcjax.sense.faults import BLOCKED, BLURRED, DROPPED, FROZEN, HALF_EMPTY, LATE, PERSON_LOST, SKEWED

from .episodes import measured
from .worlds import Bench, SetUp

KINDS = {
    "person_lost": PERSON_LOST,
    "frozen": FROZEN,
    "blocked": BLOCKED,
    "blurred": BLURRED,
    "half_empty": HALF_EMPTY,
    "dropped": DROPPED,
    "late": LATE,
    "skewed": SKEWED,
}
BESIDE = ("pass_by", "reach_in", "stand_and_work")
"""People beside whom cameras fail, in this order until there are enough moments."""
LASTS = 0.4
"""Length of a fault [s]."""
EVERY = 0.7
"""Least time between the begins of two [s]."""
NEAR = 2.0
"""Faults begin while the person is nearer than this [m]."""
AFTER = 0.15
"""Time after a fault that still counts as its own [s]."""
LOST_AT = 1.0
"""When a camera is lost for good [s]."""


@dataclass(frozen=True)
class Window:
    """One fault: on which cameras, from when to when."""

    cameras: tuple[int, ...]
    begin: float
    end: float


def near_times(t: NDArray, distance: NDArray, count: int, shift: float = 0.0) -> list[float]:
    """Up to `count` begins of faults while a person is near, `EVERY` apart [s].

    Args:
        distance: of the person, when no camera fails [m].
        shift: of the first begin [s].
    """
    usable = t[(distance < NEAR) & (t > 0.3) & (t < t[-1] - LASTS - AFTER)]
    chosen: list[float] = []
    for time in usable[usable >= usable[0] + shift] if len(usable) else ():
        if len(chosen) < count and (not chosen or time >= chosen[-1] + EVERY):
            chosen.append(float(time))
    return chosen


def windows_of(times: list[float], cameras: int, turn: int) -> list[Window]:
    """One fault at each time: on one camera, on another, on all at once, in turn."""
    sets = [*((c,) for c in range(cameras)), tuple(range(cameras))] if cameras > 1 else [(0,)]
    order = [sets[-1], *sets[:-1]] if cameras == 1 else [sets[0], sets[-1], sets[1], sets[-1]]
    return [Window(order[(k + turn) % len(order)], time, time + LASTS) for k, time in enumerate(times)]


def schedule_of(kind: int, windows: list[Window], cameras: int, slots: int) -> FaultSchedule:
    """The faults of all windows; padded, so that all episodes share one compiled program."""
    faults = [one_fault(kind, c, w.begin, w.end, cameras) for w in windows for c in w.cameras]
    never = one_fault(kind, 0, 1e6, 2e6, cameras)
    return join_faults(*faults, *[never] * (slots - len(faults)))


def fault_case(bench: Bench, made: SetUp, name: str, kind: int, windows: list[Window], slots: int) -> dict[str, Any]:
    """An episode beside somebody with short faults."""
    person = bench.person(made, name)
    cameras = made.rig.count
    played = bench.play(made, person, schedule_of(kind, windows, cameras, slots))
    found = measured(bench, made, person, played)
    return found | {
        "stamp": played.stamp,
        "camera": played.camera,
        "begin": np.asarray([w.begin for w in windows]),
        "end": np.asarray([w.end for w in windows]),
        "faulty": np.asarray([[c in w.cameras for c in range(cameras)] for w in windows]),
    }


def lost_camera_case(bench: Bench, made: SetUp, camera: int, slots: int) -> dict[str, Any]:
    """An episode with nobody there in which a camera is lost for good."""
    person = bench.person(made, "nobody")
    gone = Window((camera,), LOST_AT, float("inf"))
    return measured(bench, made, person, bench.play(made, person, schedule_of(DROPPED, [gone], made.rig.count, slots)))


def ticks_of(case: dict[str, NDArray], k: int) -> NDArray:
    """Ticks that count for the k-th fault of an episode."""
    return (case["t"] >= case["begin"][k]) & (case["t"] < case["end"][k] + AFTER)


def green_ticks(case: dict[str, NDArray], k: int, closest: float) -> int:
    """Ticks of a fault that are green though the person is nearer than `closest` [m]."""
    during = ticks_of(case, k)
    return int((during & (case["zone"] == 0) & (case["true_now"] < closest)).sum())


def named_after(case: dict[str, NDArray], k: int, silent: bool) -> float:
    """Longest time from a camera's first faulty exposure until a tick knows that something is wrong [s]; NaN: the fault
    met no exposure, or need not be known. Never: the length of the fault.

    Args:
        silent: the camera looks healthy (the person is not measured): known where somebody may be hidden, which only a fault of
            all cameras, beside somebody who was measured, makes so.
    """
    t, begin, end = case["t"], case["begin"][k], case["end"][k]
    firsts = {}
    for c in np.flatnonzero(case["faulty"][k]):
        exposed = case["stamp"][(case["camera"] == c) & (case["stamp"] >= begin - 1e-6) & (case["stamp"] < end - 1e-6)]
        if len(exposed):
            firsts[int(c)] = float(exposed.min())
    if not firsts:
        return float("nan")
    if silent:
        before = case["separation"][max(int(np.searchsorted(t, begin)) - 1, 0)]
        if not case["faulty"][k].all() or before > FAR_AWAY:
            return float("nan")
        known = case["guarded"] | (case["cameras"] != 0) | (case["zone"] == 3)
        starts = [(max(firsts.values()), known)]
    else:
        starts = [(first, ((case["cameras"] >> (8 * c)) & 255) != 0) for c, first in firsts.items()]
    return max(_until(t, known, first, end - begin) for first, known in starts)


FAR_AWAY = 5.0
"""Sensed distances beyond this mean that nobody is measured [m]."""


def _until(t: NDArray, known: NDArray, first: float, most: float) -> float:
    later = t[(t >= first) & known]
    return min(float(later[0]) - first, most) if len(later) else most
