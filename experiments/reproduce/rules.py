"""How figures give verdicts."""

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

from .claim import MISSED, PARTLY, REFUTED, REPRODUCED, UNDECIDABLE, Figures, Rule
from .config import READINGS
from .printed import LEADS, PATHS
from .rows import BARS, FITTING, holds
from .rrt_star import STAGES

SHARE = 1.0
"""Largest difference of a lead that is still the one said [percentage points]."""
DIGIT = 0.01
"""Last digit of a printed time [s]."""
FULL_GROWN = (1500, STAGES[-1])
"""Iterations of RRT* that are compared: those of the tables, and many."""
SAME_CLEARANCE = 0.1
"""Difference of clearance that is none [cm]."""
IMAGE_MS = 1000 / 30
"""Time of an image [ms]."""


def when(holds_true: Callable[[Figures], bool], otherwise: str = MISSED) -> Rule:
    """Reproduced where it holds."""
    return lambda f: REPRODUCED if holds_true(f) else otherwise


def by_share(true: Iterable[bool], none: str = REFUTED) -> str:
    """Reproduced if all are true, partly if some are."""
    found = list(true)
    return REPRODUCED if all(found) else PARTLY if any(found) else none


def agreed(true: Iterable[bool]) -> str:
    """Reproduced if all are true, refuted if none is; otherwise what is not said in the paper decides."""
    found = list(true)
    return REPRODUCED if all(found) else UNDECIDABLE if any(found) else REFUTED


def times_of(f: Figures, table: str, reading: str) -> list[float]:
    """Our times of the improved field in a table [s]."""
    count = 3 if table in ("V", "VI", "VII") else 4
    return [f[f"{table}_{k}_iapf_{reading}"] for k in range(1, count + 1)]


def steady(times: Sequence[float]) -> bool:
    return max(times) - min(times) <= DIGIT


def growing(times: Sequence[float]) -> bool:
    """By at least half a digit from row to row."""
    return all(later - sooner >= DIGIT / 2 for sooner, later in pairwise(times))


def falling(times: Sequence[float]) -> bool:
    return growing([-time for time in times])


def table_holds(table: str, shape: Callable[[Sequence[float]], bool] = lambda _: True) -> Rule:
    """The bar of the table holds in the reading that fits, and its times go as the paper says."""
    name = f"{table}_iapf_worst_{FITTING}"
    return when(lambda f: holds(name, f[name]) is True and shape(times_of(f, table, FITTING)))


def some_reading(table: str, shape: Callable[[Sequence[float]], bool], bar: float = 2.0) -> Rule:
    """One reading gives both the printed times, within `bar` percent, and the way they go; if none does, what is not said in the
    paper decides."""

    def rule(f: Figures) -> str:
        both = [
            f[f"{table}_iapf_worst_{reading}"] <= bar and shape(times_of(f, table, reading)) for reading in READINGS
        ]
        return REPRODUCED if any(both) else UNDECIDABLE

    return rule


def leads_hold(planner: str) -> Rule:
    """The leads that the text says are those of its tables."""
    place = ("gda", "rrt").index(planner) + 1
    return lambda f: by_share(
        abs(f[f"{table}_lead_{planner}"] - float(lead[place])) <= SHARE for table, lead in LEADS.items()
    )


def faster_by(least: float) -> Rule:
    """The improved field is faster than gradient descent by that much at one speed, in every reading [%]."""
    return lambda f: agreed([f[f"gain_gda_{reading}"] >= least for reading in READINGS])


def faster_than_rrt(f: Figures) -> str:
    """At one speed, in every reading, with any clearance and with that of the improved field, for few and many iterations."""
    return agreed(
        [
            f[f"fair_iapf_time_{reading}"] < f[f"{name}_time_{stage}_{reading}"]
            for reading in READINGS
            for name in ("rrt", "rrt_equal")
            for stage in FULL_GROWN
        ]
    )


def smoother(f: Figures) -> str:
    """With bending energy the planned path bends less at the same clearance, in every reading."""
    return by_share(
        [
            f[f"bending_ratio_{reading}"] > 1 and f[f"bending_clearance_gap_{reading}"] <= SAME_CLEARANCE
            for reading in READINGS
        ],
        MISSED,
    )


def optimal_is_least(f: Figures) -> bool:
    """Of table VIII's scores from its rows that of the optimal path is the least."""
    *others, optimal = (f[f"VIII_{k + 1}_score"] for k in range(len(PATHS)))
    return optimal < min(others)


def bar(name: str) -> Rule:
    """A row holds its bar."""
    assert name in BARS
    return when(lambda f: holds(name, f[name]) is True)
