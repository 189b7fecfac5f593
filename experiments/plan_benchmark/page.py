"""The page of the rows, as Markdown."""

from collections.abc import Mapping, Sequence
from typing import Any

from .about import sentence
from .points.optimum_page import optimum_page
from .points.page import point_page
from .points.words import definition, judged
from .rows import BARS, DEFINITIONS, POINT, Rows, holds

HEAD = """# The planners, measured

Written by `python -m experiments.plan_benchmark --json FILE --page FILE`; do not edit. `--help` explains every option.
"""
ARM = """
## The planner of the whole arm

Problems of a UR5 among 2 to 12 boxes (rainorangelemon/gnn-motion-planning, MIT), the arm's capsules 1 cm thinner than the project's,
forearm and wrist 2 may overlap{taken}.
{origin}

"""
COMMAND = "`python -m experiments.plan_benchmark --space {space} --json FILE --page FILE` adds the rows"
"""Rows of the other space are kept in the file."""
SHOWN = ("point_best", "point_unseen", "point_paper")
"""Begins of the names of rows without bars that are shown besides the tables."""


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


def page(rows: Rows, figures: Sequence[str] = (), origins: Mapping[str, Mapping[str, Any]] | None = None) -> str:
    """A Markdown page of the rows of both spaces, as far as they are there.

    Args:
        figures: of the comparison, name and content of each.
        origins: space -> what its rows were measured on.
    """
    origins = origins or {}
    points = point_page(rows, sentence(origins.get("point")))
    text = HEAD + (points or f"\nThe planners of a point were not measured; {COMMAND.format(space='point')}.\n")
    point = [name for name in rows if name.startswith(POINT) and (name in BARS or name.startswith(SHOWN))]
    if point:
        text += "\n" + bars_table(rows, point)
        if said := judged(rows, holds):
            text += "\n" + said + "\n"
    text += optimum_page(rows)
    if figures:
        text += "\nFigures in the folder of the run:\n\n" + "\n".join(f"* {line}" for line in figures) + "\n"
    arm = [name for name in rows if not name.startswith(POINT)]
    if arm:
        taken = f"; {rows['taken']['value']:.0f} problems taken" if "taken" in rows else ""
        text += ARM.format(taken=taken, origin=sentence(origins.get("arm"))) + bars_table(rows, arm)
    else:
        text += f"\n## The planner of the whole arm\n\nNot measured here; {COMMAND.format(space='arm')}.\n"
    return text
