"""The part of the page, and of what is printed, that compares planners of a point: from the rows alone."""

import math
from collections.abc import Mapping
from typing import Any

from hrcjax.lab.table import aligned
from hrcjax.plan.multi_start import FACTORS

from .cases import PLANNERS
from .curve import SPACINGS, TOLERANCE
from .measures import BENT, LONGER, MINE, UNITS, UNSEEN
from .ours import SLACK, STARTS, STEPS
from .sampling import RESOLUTION, SAMPLES, SHARE
from .scenes import CELL, CLEARANCE, LEAST_WAY, MOST
from .timing import ACCELERATION, JERK, SPEED

Rows = Mapping[str, Mapping[str, Any]]
TEXT = """
## Planners of a point, compared

{scenes:.0f} seeded scenes in the workspace of the Robotica paper. Start and goal are at least {way:g} m apart; 1 to {most} balls, columns or boxes stand on
the straight line between them, each met by it; they may touch each other. Every planner must keep {clear:g} cm from every surface, and the
bounds. A scene counts if a grid of {cell:g} cm hangs together from start to goal with that clearance; rejected: {rejected}.

* **Planners.** `gradient_descent`: the paper's baseline with its printed gains. `plain_apf`: the potential without the factor that fades
  repulsion at the goal, in unit steps. `iapf`: the improved potential, in the library's damped steps. These three, {steps} steps at most, see the
  obstacles grown by the clearance, so that staying outside keeps it; after arrival within 1 cm they go straight to the goal.
  `iapf_optimised`: the library's `plan`, a descent and an arch, optimised. `multi_start`: `plan_multi_start`, {starts} guesses optimised side by
  side, weights as by default (1, 0.01 m); `multi_start_slack`: `plan_with_slack`, the same for {factors} weights of bending, from 0.0003 to 0.1 m, and of these the straightest path at most {slack:g} % longer than the shortest of them. `rrt_star`, `informed_rrt_star`, `bfmt_star`: OMPL's, with length as
  objective and OMPL's simplification, {budget:g} s for each scene, simplification included. RRT* and Informed RRT* search for {search:g} s; {kept:g} s are kept for the
  simplification, which needs a few milliseconds of them, so that the rest is unused. BFMT* starts with {samples} samples and ends with its first solution, or doubles them. Validity is tested every {resolution:g} mm by a function in Python.
* **One curve for all.** Broken lines have corners, which no law of time passes without a stop. Of every planner's line natural
  cubic splines are laid through points {first:g} to {last:g} cm apart on it, and the first, the smoothest, that the check accepts is executed and measured. If none is
  accepted, the line itself is, with a stop at every corner; its bending energy is infinite.
  So the corners of the sampling planners' lines are rounded as far as the clearance allows, and their bending energies are not those of corners.
* **One check for all**, in NumPy: the curve's points every mm, exact distances; {tolerance:g} mm of violation count as kept. Success: the planner claims it and the check agrees.
  The library's optimiser uses this tolerance{median}, while OMPL's validity function asks for the whole {millimetres:.1f} mm. To be 0.3 mm nearer shortens a turn of one radian by 0.3 mm.
* **One law of time for all**: toppra, from rest to rest, {speed:g} m/s and {acceleration:g} m/s^2 on each axis (`travel`). It knows no limit of jerk: besides, `travel_jerk` is the library's path clock
  at the best of several constant cruising speeds, stretched in time until each axis also keeps {jerk:g} m/s^3. That law does not slow down for bends alone, so that it favours straight paths.
* **Planning time** of the library's planners is that of one scene alone on the CPU, in float32, compiled before; of OMPL's it contains the validity function in Python, which a C++ one would shorten.
  JAX may use all cores of the machine for it, where OMPL's planners use one. Where other programs share the machine (the load average below), all planning times are
  longer, and OMPL's planners, whose second is one of the clock, search less.
* **Best baseline.** The bar asks for a length within {longer:.0f} % and {bent:g} of the bending energy of the best baseline. `point_best_share` compares with the bending energy of the shortest
  baseline, which is often the tautest line; `point_best_share_strict` with the least among the baselines that are at most {longer:.0f} % longer than the shortest. The slack of `multi_start_slack` is {slack:g} %{own},
  and this planner was added after the comparison of `multi_start` with the baselines had been seen. So `point_unseen` gives the shares in {unseen}scenes of other seeds, from {other} on.

{origin}

Medians over the scenes that the planner itself solves, with 95 % bootstrap intervals (planning time: over all scenes); shares with Wilson's intervals. Medians over
different scenes do not compare planners; the ratios below do. OMPL's planners stop by the clock: in another run their paths are others, and
shares against the best of them move by some percent.
"""
PAIRS = """
`multi_start` over each other planner, in the scenes in which both succeed: median ratios, below 1 where `multi_start` is less.
"""


def number(value: float) -> str:
    """Three significant digits, or more where they are few."""
    if not math.isfinite(value):
        return "-" if math.isnan(value) else "inf"
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def interval(entry: Mapping[str, Any] | None) -> str:
    """Value and interval of a row; "-" where there is none."""
    if entry is None or math.isnan(entry["value"]):
        return "-"
    return f"{number(entry['value'])} [{number(entry['low'])}, {number(entry['high'])}]"


def planners_in(rows: Rows) -> list[str]:
    """Those that were measured."""
    return [name for name in PLANNERS if f"point_success_{name}" in rows]


def planner_table(rows: Rows) -> list[list[str]]:
    """Head and a line for every planner."""
    head = ["planner", *(f"{name} [{unit}]" if unit != "1" else name for name, unit in UNITS.items()), "stops"]
    lines = [head]
    for name in planners_in(rows):
        stops = rows.get(f"point_stops_{name}", {"value": math.nan})["value"]
        lines.append([name, *(interval(rows.get(f"point_{measure}_{name}")) for measure in UNITS), number(stops)])
    return lines


def pair_table(rows: Rows) -> list[list[str]]:
    """Head and a line of ratios for every other planner."""
    lines = [["other planner", "scenes", "length", "bending", "travel", "travel_jerk"]]
    for name in planners_in(rows):
        found = [rows.get(f"point_ratio_{m}_{name}") for m in ("length", "bending", "travel", "travel_jerk")]
        if found[0] is not None:
            lines.append([name, str(found[0]["scenes"]), *(interval(one) for one in found)])
    return lines


def markdown(lines: list[list[str]]) -> str:
    """A table."""
    return "\n".join("| " + " | ".join(line) + " |" for line in [lines[0], ["---"] * len(lines[0]), *lines[1:]]) + "\n"


def printed(rows: Rows) -> str:
    """Both tables as text."""
    parts = [aligned(table, "<") for table in (planner_table(rows), pair_table(rows)) if len(table) > 1]
    return "\n\n".join(parts)


def point_page(rows: Rows, origin: str) -> str:
    """The tables with what they measure; empty without rows.

    Args:
        origin: one line of the machine and the code.
    """
    if "point_scenes" not in rows:
        return ""
    rejected = ", ".join(
        f"{rows[name]['value']:.0f} ({name.removeprefix('point_rejected_').replace('_', ' ')})"
        for name in rows if name.startswith("point_rejected_")
    ) or "none"  # fmt: skip
    budget = rows.get("point_budget", {"value": math.nan})["value"]
    clearance = rows.get(f"point_clearance_{MINE}")
    unseen = rows.get("point_unseen_scenes")
    text = TEXT.format(
        median=f" (median clearance of `{MINE}` {1000 * clearance['value']:.1f} mm)" if clearance else "", millimetres=1000 * CLEARANCE,
        search=(1 - SHARE) * budget, kept=SHARE * budget, longer=100 * (LONGER - 1), bent=BENT, own=", the bar's own" if math.isclose(SLACK, LONGER - 1) else "",
        unseen=f"{unseen['value']:.0f} " if unseen else "", other=UNSEEN, origin=origin,
        scenes=rows["point_scenes"]["value"], way=LEAST_WAY, most=MOST, clear=100 * CLEARANCE, cell=100 * CELL, rejected=rejected, steps=STEPS,
        starts=STARTS, slack=100 * SLACK, factors=len(FACTORS), budget=budget, samples=SAMPLES, resolution=1000 * RESOLUTION, first=100 * SPACINGS[0],
        last=100 * SPACINGS[-1], tolerance=1000 * TOLERANCE, speed=SPEED, acceleration=ACCELERATION, jerk=JERK,
    )  # fmt: skip
    text += "\n" + markdown(planner_table(rows))
    pairs = pair_table(rows)
    return text + (PAIRS + "\n" + markdown(pairs) if len(pairs) > 1 else "")
