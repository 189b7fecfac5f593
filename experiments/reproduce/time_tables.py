"""Tables I to VII and those at one speed, as Markdown."""

from collections.abc import Sequence

import numpy as np

from .claim import Figures, said
from .derived import printed_time
from .fair import COMMON_SPEED
from .printed import TIMES, TIMES_CAPTION
from .readings import EXPLAINED
from .rows import PLANNERS, Cases, Rows, fair_of, our_times
from .rrt_star import STAGES

PRINTED_RRT = [row.rrt for row in TIMES if row.rrt is not None]
WHY = {
    "I": said(
        f"Gradient descent takes {{I_4_gda_spheres:1}} s by its printed constants and 30 steps a second, and it is not random: still four obstacles of 3 cm take {printed_time('I.4', 'gda'):.2f} s here, {printed_time('II.3', 'gda'):.2f} s in table II. RRT* is random."
    ),
    "II": said(
        "From 2 to 3.5 cm ours grows by {II_growth_spheres:3} s in *spheres*, printed are {II_growth_printed} s: all balls are 5 cm and more from the line."
    ),
    "III": said(
        f"The printed order is not that of the sizes: {printed_time('III.3', 'iapf'):.2f} s with O1 of 3 cm, {printed_time('III.4', 'iapf'):.2f} s with O1 of 3.5 cm; ours are {{III_3_iapf_spheres:3}} and {{III_4_iapf_spheres:3}} s. O1 is the nearest to the line."
    ),
    "IV": said(
        "In *spheres* a height moves the ball nearer to the line or away, {IV_iapf_min_spheres} to {IV_iapf_max_spheres} s; in *columns* it can only matter where the path passes over them, {IV_iapf_min_columns} to {IV_iapf_max_columns} s. Printed is one time for all rows, and one of gradient descent."
    ),
    "V": said(
        "Gradient descent: the printed times differ by {gda_growth_V_printed:0} %, its gains and with them the times of unit steps by {gda_growth_V_spheres:0} %, whatever a step takes."
    ),
    "RRT*": said(
        f"The printed {min(PRINTED_RRT):.2f} to {max(PRINTED_RRT):.2f} s are, at this speed, paths of {{printed_rrt_length_min:0}} to {{printed_rrt_length_max:0}} cm: in columns of a search of {{printed_rrt_iterations_min_columns:0}} to {{printed_rrt_iterations_max_columns:0}} iterations."
    ),
    "VI": said("Gradient descent: as in table V."),
    "VII": said(
        "In *spheres*, where balls are off the line, the times are {VII_1_iapf_spheres:3} to {VII_3_iapf_spheres:3} s; in *columns*, where they are in the way, {VII_1_iapf_columns:3} to {VII_3_iapf_columns:3} s."
    ),
}
"""Where and why printed and computed cannot agree."""


def why(table: str, rows: Rows) -> str:
    """The sentence of a table; empty where the run has not its figures."""
    try:
        return f"\n{WHY[table](Figures(rows))}\n"
    except KeyError:
        return ""


def number(value: float | None, digits: int = 2) -> str:
    """A number, or a dash."""
    return "-" if value is None or not np.isfinite(value) else f"{value:.{digits}f}"


def time_tables(cases: Cases, rows: Rows, readings: Sequence[str]) -> str:
    """Tables I to VII, all readings side by side."""
    text = ""
    for table, caption in TIMES_CAPTION.items():
        text += f"\n## Table {table}. {caption}\n\nTimes to goal [s].\n\n"
        text += "| row | planner | printed |" + "".join(f" {reading} | difference |" for reading in readings)
        text += "\n|---|---|---|" + "---|---|" * len(readings) + "\n"
        for one in (row for row in TIMES if row.table == table):
            for name, planner in PLANNERS.items():
                printed = getattr(one, name)
                if printed is None:
                    continue
                text += f"| {one.label} | {planner} | {printed:.2f} |"
                for reading in readings:
                    ours = our_times(cases, reading, one)[name]
                    text += f" {number(ours, 3 if name == 'iapf' else 2)} | {'-' if ours is None else f'{100 * (ours / printed - 1):+.1f} %'} |"
                text += "\n"
        text += why(table, rows)
    return text


def fair_tables(cases: Cases, rows: Rows, readings: Sequence[str]) -> str:
    """Every planner's path in the common scene."""
    text = f"""
## At one speed

Four obstacles of 3 cm, the scene of table I. The printed times are those of different steps: as if each path were the straight line, the improved
field moves {rows["printed_step_iapf_min"]["value"]:.2f} to {rows["printed_step_iapf_max"]["value"]:.2f} cm each 1/30 s on the mean, gradient descent {rows["printed_step_gda_min"]["value"]:.2f} to {rows["printed_step_gda_max"]["value"]:.2f} cm, RRT* {rows["printed_step_rrt_min"]["value"]:.2f} to {rows["printed_step_rrt_max"]["value"]:.2f} cm. So
here every path is travelled at the same {100 * COMMON_SPEED:.2f} cm/s. Clearance is to the surface of the obstacles of the reading; negative: through one; planned paths keep theirs to 0.05 cm. Bending energy is that of 48 equally spaced points.
"""
    for reading in readings:
        text += f"\n### {reading}: {EXPLAINED[reading]}\n\n"
        text += "| path | length cm | time at one speed s | time by unit steps s | bending energy /cm | clearance cm |\n|---|---|---|---|---|---|\n"
        for one in fair_of(cases, reading):
            text += f"| {one.name} | {100 * one.length:.2f} | {one.time:.2f} | {number(one.law)} | {one.bending / 100:.4f} | {100 * one.clearance:.2f} |\n"
    if any(name.startswith("rrt-long/") for name in cases):
        text += searches_table(rows, readings)
    return text


def searches_table(rows: Rows, readings: Sequence[str]) -> str:
    """RRT* over its iterations, free to graze obstacles and as far from them as the improved field's path."""
    text = "\n### RRT* over its iterations\n\nMedian time at one speed [s]; *equal*: every point keeps from the obstacles what the improved field's path keeps, given in the last row.\n\n"
    text += "| iterations |" + "".join(f" {reading} | {reading}, equal |" for reading in readings)
    text += "\n|---|" + "---|---|" * len(readings) + "\n"
    kinds = [(name, reading) for reading in readings for name in ("rrt", "rrt_equal")]

    def cell(name: str) -> str:
        return number(rows[name]["value"] if name in rows else None)

    for stage in STAGES:
        text += f"| {stage} | " + " | ".join(cell(f"{name}_time_{stage}_{reading}") for name, reading in kinds) + " |\n"
    text += "| improved field | " + " | ".join(cell(f"fair_iapf_time_{reading}") for _, reading in kinds) + " |\n"
    kept = [f"{cell(f'fair_iapf_clearance_{reading}')} cm" if name == "rrt_equal" else "any" for name, reading in kinds]
    text += "| clearance | " + " | ".join(kept) + " |\n"
    return text + why("RRT*", rows)
