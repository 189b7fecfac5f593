"""Every planner's path in one scene, and its time at one common speed: what the printed times leave out."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrcjax.plan.descent import STEP_TIME

from .paths import DEFAULT, SCENE, ZETAS, measured, to_goal
from .printed import GOAL, START, TIMES
from .readings import row_scene
from .rrt_star import STAGES

ARRIVAL = 0.01
"""Distance from the goal that counts as arrived [m]."""
STRAIGHT = math.dist(START, GOAL) / 100
"""Length of the straight line [m]."""
COMMON_SPEED = (STRAIGHT - ARRIVAL) / SCENE.iapf
"""The speed at which the straight line takes the improved field's printed 4.70 s [m/s]."""


class FairRow(NamedTuple):
    """One planner's path."""

    key: str
    name: str
    length: float
    """[m]."""
    bending: float
    """[1/m]."""
    clearance: float
    """To the surface of the obstacles of this reading [m]."""
    law: float
    """Time by unit steps of 1/30 s; not a number: not moved by them [s]."""

    @property
    def time(self) -> float:
        """Time at the common speed, until 1 cm from the goal [s]."""
        return time_at_one_speed(self.length)


def time_at_one_speed(length: float | NDArray) -> Any:
    """Time of a path of this length at the common speed, until 1 cm from its end [s]."""
    return (length - ARRIVAL) / COMMON_SPEED


def step_of(length: float, seconds: float) -> float:
    """Mean length of a step of 1/30 s by which a path of this length takes so long until 1 cm from the goal [m]."""
    return (length - ARRIVAL) / seconds * STEP_TIME


def printed_steps() -> dict[str, tuple[float, float]]:
    """Least and greatest mean step behind the printed times, as if every path were the straight line [m]."""
    out = {}
    for name in ("iapf", "gda", "rrt"):
        times = [value for row in TIMES if row.k_att == SCENE.k_att and (value := getattr(row, name)) is not None]
        out[name] = (step_of(STRAIGHT, max(times)), step_of(STRAIGHT, min(times)))
    return out


def median_search(case: Mapping[str, NDArray]) -> int | None:
    """The search whose length is the (lower) median of those that found a path; None: none did."""
    order = np.argsort(case["length"])
    found = order[np.isfinite(case["length"][order])]
    return int(found[(len(found) - 1) // 2]) if len(found) else None


def common_paths(
    times: Mapping[str, NDArray], paths: Mapping[str, NDArray], rrt: Mapping[str, NDArray] | None
) -> dict[str, tuple[str, NDArray, float]]:
    """Key -> name, points [m], time by unit steps [s], of every planner in the common scene."""
    k = [row.key for row in TIMES].index(SCENE.key)
    nan = float("nan")
    out: dict[str, tuple[str, NDArray, float]] = {
        "straight": ("straight line", np.array([START, GOAL]) / 100, nan),
        "gda": ("gradient descent as printed", to_goal(times["gda_path"][k], int(times["gda_steps"][k])), float(times["gda"][k])),
        "iapf": ("improved field, unit steps", to_goal(times["iapf_path"][k], int(times["iapf_steps"][k])), float(times["iapf"][k])),
        "damped": ("improved field, damped steps", paths["damped"], nan),
        "planned": ("planned, outside the obstacles", paths["planned"][0, DEFAULT], nan),
        "planned_zeta": (f"planned, {ZETAS[-1]:g} radii from centres and axes", paths["planned"][-1, DEFAULT], nan),
    }  # fmt: skip
    if rrt is not None and (chosen := median_search(rrt)) is not None:
        out["rrt"] = ("RRT*, median of the searches", rrt["path"][chosen], nan)
    return out


def field_clearance(reading: str, times: Mapping[str, NDArray]) -> float:
    """What the improved field's path in the common scene keeps from the surfaces of the obstacles [m]."""
    k = [row.key for row in TIMES].index(SCENE.key)
    return measured(to_goal(times["iapf_path"][k], int(times["iapf_steps"][k])), row_scene(reading, SCENE)).clearance


def fair_rows(
    reading: str,
    times: Mapping[str, NDArray],
    paths: Mapping[str, NDArray],
    rrt: Mapping[str, NDArray] | None,
    equal: Mapping[str, NDArray] | None = None,
) -> Sequence[FairRow]:
    """The table of one reading; `equal` are searches that keep what the improved field's path keeps from obstacles."""
    scene, nan = row_scene(reading, SCENE), float("nan")
    shown = common_paths(times, paths, rrt)
    far = -1
    if reading == "clearance":  # the solids hold that distance already
        del shown["planned_zeta"]
        far = 0
    shown["unbent"] = (
        f"{shown['planned' if far == 0 else 'planned_zeta'][0]}; without bending energy",
        paths["unbent"][far],
        nan,
    )
    if equal is not None and (chosen := median_search(equal)) is not None:
        shown["rrt_equal"] = (
            f"RRT*, {STAGES[-1]} iterations, clearance of the improved field",
            equal["path"][chosen],
            nan,
        )
    return [FairRow(key, name, *measured(path, scene), law) for key, (name, path, law) in shown.items()]
