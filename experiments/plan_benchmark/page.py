"""The page of the rows, as Markdown."""

from collections.abc import Sequence

from .points.page import definition, point_page
from .rows import BARS, DEFINITIONS, POINT, Rows, holds

HEAD = """# The planners, measured

Written by `python -m experiments.plan_benchmark --json FILE --page FILE`; do not edit. `--help` explains every option.
"""
ARM = """
## The planner of the whole arm

Problems of a UR5 among 2 to 12 boxes (rainorangelemon/gnn-motion-planning, MIT), the arm's capsules 1 cm thinner than the project's,
forearm and wrist 2 may overlap{taken}.

"""


def bars_table(rows: Rows, names: Sequence[str]) -> str:
    """Rows with bars and definitions."""
    lines = ["| row | value | unit | bar | what it measures |", "|---|---|---|---|---|"]
    for name in names:
        entry = rows[name]
        bar = " ".join(map(str, BARS[name])) if name in BARS else ""
        missed = " (missed)" if holds(name, entry["value"]) is False else ""
        words = DEFINITIONS.get(name) or definition(name)
        around = f" [{entry['low']:.3g}, {entry['high']:.3g}]" if "low" in entry else ""
        lines.append(f"| {name} | {entry['value']:.4g}{around} | {entry['unit']} | {bar}{missed} | {words} |")
    return "\n".join(lines) + "\n"


def page(rows: Rows, figures: Sequence[str] = ()) -> str:
    """A Markdown page of the rows of both spaces, as far as they are there.

    Args:
        figures: of the comparison, name and content of each.
    """
    text = HEAD + point_page(rows)
    point = [name for name in rows if name.startswith(POINT) and (name in BARS or name.startswith(("point_best", "point_paper")))]  # fmt: skip
    if point:
        text += "\n" + bars_table(rows, point)
    if figures:
        text += "\nFigures in the folder of the run:\n\n" + "\n".join(f"* {line}" for line in figures) + "\n"
    arm = [name for name in rows if not name.startswith(POINT)]
    if arm:
        taken = f"; {rows['taken']['value']:.0f} problems taken" if "taken" in rows else ""
        text += ARM.format(taken=taken) + bars_table(rows, arm)
    return text
