"""Tables I to VII and those at one speed, as Markdown."""

from collections.abc import Sequence

import numpy as np

from .fair import COMMON_SPEED
from .printed import TIMES, TIMES_CAPTION
from .readings import EXPLAINED
from .rows import PLANNERS, Cases, Rows, fair_of, our_times, told
from .rrt_star import STAGES

WHY = {
    "I": "Gradient descent takes 21.4 s by its printed constants and 30 steps a second, and it is not random: still four obstacles of 3 cm take 7.62 s here, 7.70 s in table II, 7.61 s in table IV. RRT* is random.",
    "II": "Ours grows less with the radius than printed, 0.01 s instead of 0.04 s: all balls are 5 cm and more from the line.",
    "III": "The printed order is not that of the sizes: 4.72 s with O1 of 3 cm, 4.70 s with O1 of 3.5 cm. Ours follows the size of O1, the nearest to the line.",
    "IV": "In *spheres* a height moves the ball nearer to the line or away, in *columns* nothing changes where the path passes; the paper's 4.70 s in all rows is no reading's. Its gradient descent is one number for all rows.",
    "V": "Gradient descent: the printed times differ by 1 %, its gains and with them the times of unit steps by 13 %, whatever a step takes.",
    "VI": "Gradient descent: as in table V.",
    "VII": "In *spheres* zeta does not matter for balls that are off the line; where they are in the way it costs time, as printed.",
}
"""Where and why printed and computed cannot agree."""


def number(value: float | None, digits: int = 2) -> str:
    """A number, or a dash."""
    return "-" if value is None or not np.isfinite(value) else f"{value:.{digits}f}"


def time_tables(cases: Cases, readings: Sequence[str]) -> str:
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
        text += f"\n{WHY[table]}\n"
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
    if "rrt-long" in cases:
        reading = told(readings)
        text += f"\n### RRT* over its iterations, {reading}\n\n| iterations | median length cm | time at one speed s |\n|---|---|---|\n"
        for stage in STAGES:
            text += f"| {stage} | {rows[f'rrt_length_{stage}_{reading}']['value']:.1f} | {rows[f'rrt_time_{stage}_{reading}']['value']:.2f} |\n"
        text += f"\nThe printed 5.12 to 7.32 s are, at this speed, paths of {rows['printed_rrt_length_min']['value']:.0f} to {rows['printed_rrt_length_max']['value']:.0f} cm: a search that was stopped early.\n"
    return text
