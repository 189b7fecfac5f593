"""Rows that follow from other rows: what claims and texts compare."""

from collections.abc import Callable, Iterator
from typing import Any

from .claim import Figures, Rows
from .config import READINGS
from .printed import TIMES
from .rrt_star import STAGES

Derived = tuple[str, str, Callable[[Figures], float]]
"""Name, unit, how it follows."""


def kept_bending(reading: str) -> str:
    """Key of the planned path that keeps the paper's distance from the obstacles of a reading: the solids of clearance hold it."""
    return "planned" if reading == "clearance" else "planned_zeta"


def printed_time(key: str, planner: str) -> float:
    """A printed time [s]."""
    return float(getattr(next(row for row in TIMES if row.key == key), planner))


def _of_reading(reading: str) -> Iterator[Derived]:
    kept = f"fair_{kept_bending(reading)}"
    yield (
        f"gain_gda_{reading}",
        "%",
        lambda f: 100 * (1 - f[f"fair_iapf_time_{reading}"] / f[f"fair_gda_time_{reading}"]),
    )
    yield (
        f"bending_ratio_{reading}",
        "1",
        lambda f: f[f"fair_unbent_bending_{reading}"] / f[f"{kept}_bending_{reading}"],
    )
    yield (
        f"bending_clearance_gap_{reading}",
        "cm",
        lambda f: abs(f[f"fair_unbent_clearance_{reading}"] - f[f"{kept}_clearance_{reading}"]),
    )
    yield f"gda_growth_V_{reading}", "%", lambda f: 100 * (f[f"V_3_gda_{reading}"] / f[f"V_1_gda_{reading}"] - 1)
    yield f"II_growth_{reading}", "s", lambda f: f[f"II_4_iapf_{reading}"] - f[f"II_1_iapf_{reading}"]
    for end, choose in (("min", min), ("max", max)):
        yield (
            f"IV_iapf_{end}_{reading}",
            "s",
            lambda f, choose=choose: choose(f[f"IV_{k}_iapf_{reading}"] for k in range(1, 5)),
        )


def derived() -> Iterator[Derived]:
    """All of them."""
    yield "X_loss", "%", lambda f: 100 - f["X_relative"]
    yield "gda_growth_V_printed", "%", lambda _: 100 * (printed_time("V.3", "gda") / printed_time("V.1", "gda") - 1)
    yield "II_growth_printed", "s", lambda _: printed_time("II.4", "iapf") - printed_time("II.1", "iapf")
    for end, choose in (("min", min), ("max", max)):
        found = choose(row.rrt for row in TIMES if row.table == "III" and row.rrt is not None)
        yield f"III_rrt_printed_{end}", "s", lambda _, found=found: found
    for reading in READINGS:
        yield from _of_reading(reading)


def early_rows(rows: Rows, reading: str) -> dict[str, dict[str, Any]]:
    """Fewest and most iterations after which RRT*'s median time at one speed is among the printed ones."""
    printed = [row.rrt for row in TIMES if row.rrt is not None]
    times = {stage: rows[name]["value"] for stage in STAGES if (name := f"rrt_time_{stage}_{reading}") in rows}
    within = [stage for stage, time in times.items() if min(printed) <= time <= max(printed)]
    ends = {"min": min(within), "max": max(within)} if within else {}
    return {
        f"printed_rrt_iterations_{end}_{reading}": {"value": float(n), "unit": "iterations"} for end, n in ends.items()
    }


def derived_rows(rows: Rows) -> dict[str, dict[str, Any]]:
    """Those whose rows a run has."""
    found: dict[str, dict[str, Any]] = {}
    for name, unit, how in derived():
        try:
            found[name] = {"value": how(Figures(rows)), "unit": unit}
        except KeyError:
            continue
    for reading in READINGS:
        found |= early_rows(rows, reading)
    return found
