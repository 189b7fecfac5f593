"""Measures of one run of each function, from what was recorded and the exact truth."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hrcjax.interact import FollowParams, GiveWayParams
from hrcjax.safety import ZoneParams

from .bench import POSE, VARIANTS, setting_of
from .people import GIVES_UP, SPEED

Case = Mapping[str, NDArray]
SETTLED = 4.0
"""From here on a hand is followed: it has set off, and the tool has come up [s]."""
FAST = 0.25
"""A hand faster than this counts as one of 0.3 m/s [m/s]."""
REACHED = 0.02
"""Distance to the handover pose that counts as reached [m]."""
HOLD = 1.5
"""The error of a handover is the mean over so long before the hand goes [s]."""
MOVING = 0.05
"""Joint speed above which a contact is one of a moving arm [rad/s]."""
AFTER = 1.0
"""What the end of a stop brings about is measured for so long [s]."""
FREE = 8.0
"""Where nobody has been in the way for the last so many seconds the task can have come to an end: back and on at the 0.25 m/s that hidden
space may allow [s]."""
TURNED = 0.03
"""Distance of the tool to an end of the task that counts as a turn [m]."""
AT_LIMIT = 0.97
"""Share of a limit of speed from which on the safety layer has the say [1]."""
LIMIT, JERK = 1.0, 10.0
"""Largest acceleration [m/s^2] and jerk [m/s^3] of a reference that speeds up: those of the path clock (`ClockParams`)."""


def contacts(case: Case) -> tuple[int, int]:
    """Times that the person and the arm came to touch, while it moved and while it stood."""
    touch = np.concatenate([[False], case["separation_true"] <= 0, [False]])
    begins, ends = np.flatnonzero(~touch[:-1] & touch[1:]), np.flatnonzero(touch[:-1] & ~touch[1:])
    moves = np.abs(case["qd"]).max(axis=1) > MOVING
    moving = sum(bool(moves[a:b].any()) for a, b in zip(begins, ends, strict=True))
    return moving, len(begins) - moving


def wanted(name: str, case: Case, direction: NDArray) -> NDArray:
    """(tick 3) where the tool should be beside the true hand, as of a variant [m]"""
    distance = VARIANTS[name].distance or 0.0
    return case["hand_true"] + (float(case["hand_radius"]) + distance) * direction


def direction_of(name: str, scene: object) -> NDArray:
    """(3) unit vector from the hand to the tool"""
    return np.asarray(setting_of(VARIANTS[name], scene).direction, float)  # pyright: ignore[reportArgumentType]


def errors(name: str, case: Case, direction: NDArray) -> NDArray:
    """(tick) distance of the tool from where it should be [m]"""
    return np.linalg.norm(case["tool"] - wanted(name, case, direction), axis=1)


def hand_speed(case: Case, dt: float) -> NDArray:
    """(tick) speed of the true hand, over 0.1 s [m/s]"""
    k = round(0.05 / dt)
    x = case["hand_true"]
    first, last = np.maximum(np.arange(len(x)) - k, 0), np.minimum(np.arange(len(x)) + k, len(x) - 1)
    return np.linalg.norm(x[last] - x[first], axis=1) / ((last - first) * dt)


def follow_measures(name: str, case: Case, direction: NDArray, dt: float) -> dict[str, NDArray]:
    """Errors of following, tick by tick [m]: at any speed of the hand, and at `SPEED`; and whether the place is beyond the tool's reach."""
    late = np.arange(len(case["tool"])) * dt >= SETTLED
    error, speed = errors(name, case, direction), hand_speed(case, dt)
    away = np.linalg.norm(case["tool"] - case["hand_true"], axis=1) - float(case["hand_radius"])
    fast = late & (speed >= FAST) & (speed <= 1.2 * SPEED)
    return {
        "error": error[late],
        "fast": error[fast],
        "distance": np.abs(away - (VARIANTS[name].distance or 0.0))[late],
        "beyond": (np.linalg.norm(wanted(name, case, direction), axis=1) > FollowParams().reach)[late],
    }


def hand_over_measures(name: str, case: Case, direction: NDArray, dt: float) -> dict[str, float]:
    """Of the offer: error [m] and angle [deg] while it is held, share of the time held, when it was reached and withdrawn [s]."""
    t = np.arange(len(case["tool"])) * dt
    error = errors(name, case, direction)
    offer, end = t < GIVES_UP, t >= GIVES_UP - HOLD
    held = offer & end
    near = offer & (error <= REACHED)
    first = float(t[near][0]) if near.any() else float("nan")
    since = offer & (t >= (first if near.any() else np.inf))
    angle = np.degrees(np.arccos(np.clip(-case["axis"] @ direction, -1, 1)))
    gone = np.flatnonzero((t > GIVES_UP) & (case["active"] < 0.5))
    return {
        "error": float(error[held].mean()),
        "angle": float(angle[held].mean()),
        "held": float((error[since] <= REACHED).mean()) if since.any() else 0.0,
        "reached": first,
        "withdrawn": float(t[gone[0]] - GIVES_UP) if len(gone) and case["active"][held].any() else float("nan"),
    }


def way_back(case: Case) -> NDArray:
    """(tick) whether the tool is on its way back from the refuge, after it has been there for somebody; the start is none."""
    rate = np.append(np.diff(case["active"]), 0.0)
    return (rate < -1e-5) & np.maximum.accumulate(rate > 1e-4)


def released(case: Case, dt: float) -> NDArray:
    """(tick) whether a stop of the safety layer has ended within `AFTER`"""
    stopped = case["zone"] == 3
    found = np.zeros(len(stopped), bool)
    for tick in np.flatnonzero(stopped[:-1] & ~stopped[1:]):
        found[tick : tick + round(AFTER / dt)] = True
    return found & ~stopped


def limited(case: Case) -> NDArray:
    """(tick) whether the safety layer has the say, or had within two ticks, over which differences reach: it stops the arm, a control point
    is as fast towards people as it may be, or as fast as the red zone and hidden space allow in any direction"""
    red = ZoneParams().red_speed
    slow = (case["zone"] == 2) | (case["speed_limit"] <= red * 1.001)
    found = (case["zone"] == 3) | (case["approach"] >= AT_LIMIT * case["speed_limit"])
    found |= slow & (case["fastest"] >= AT_LIMIT * red)
    return np.convolve(found, np.ones(5), "same") > 0


def steps(case: Case, dt: float) -> tuple[NDArray, NDArray]:
    """(tick) change of the tool's velocity in a tick [m/s], and of its acceleration [m/s^2]"""
    x = case["tool"].astype(float)
    step, jump = np.zeros(len(x)), np.zeros(len(x))
    step[1:-1] = np.linalg.norm(np.diff(x, n=2, axis=0), axis=1) / dt
    jump[1:-2] = np.linalg.norm(np.diff(x, n=3, axis=0), axis=1) / dt**2
    return step, jump


def give_way_measures(case: Case, ends: NDArray, dt: float) -> dict[str, float]:
    """Contacts, least separation [m], steps of the tool's velocity [m/s] and acceleration [m/s^2] in a tick on ways back from the refuge
    and after stops, ends of the task that were reached, in all and after a way back.

    Args:
        ends: (2 3) of the task [m].
    """
    step, jump = steps(case, dt)
    back, layer = way_back(case), limited(case)
    own, braked, after = back & ~layer, back & layer, released(case, dt)
    moving, standing = contacts(case)
    turns, resumed, goal = 0, 0, 1
    first = int(np.argmax(back)) if back.any() else len(back)
    gone = back.any() and (case["person"][-round(FREE / dt) :] > GiveWayParams().leave).all()
    for tick, x in enumerate(case["tool"]):
        if np.linalg.norm(x - ends[goal]) < TURNED:
            turns, resumed, goal = turns + 1, resumed + (tick > first), 1 - goal
    return {
        "contacts": moving,
        "contacts_standing": standing,
        "separation": float(case["separation_true"].min()),
        "step": float(step[own].max(initial=0.0)),
        "jump": float(jump[own].max(initial=0.0)),
        "limited_step": float(step[braked].max(initial=0.0)),
        "limited": float(braked.sum() / back.sum()) if back.any() else float("nan"),
        "released_step": float(step[after].max(initial=0.0)),
        "resumes": int((np.diff(back.astype(int), prepend=0) > 0).sum()),
        "turns": turns,
        "done": float(resumed > 0) if gone else float("nan"),
        "stopped": float((case["zone"] == 3).mean() * len(case["zone"]) * dt),
    }


def keep_away_measures(case: Case, kept: float, dt: float) -> dict[str, float]:
    """Least distance of the tool to the person, what it is short of the set one [m], contacts, and where the tool ends [m]."""
    late = np.arange(len(case["tool"])) * dt >= 2.0
    d = case["tool_distance"][late]
    moving, standing = contacts(case)
    return {
        "least": float(d.min()),
        "short": float(np.percentile(np.maximum(kept - d, 0.0), 95)),
        "share": float((d < kept).mean()),
        "back": float(np.linalg.norm(case["tool"][-1] - np.asarray(POSE))),
        "gone": float(d[-1] > kept + 0.1),
        "contacts": moving + standing,
        "step": float(
            np.linalg.norm(np.diff(case["tool"].astype(float), n=2, axis=0), axis=1)[round(2 / dt) :].max() / dt
        ),
    }
