"""The page of the rows, as Markdown."""

from collections.abc import Mapping, Sequence
from typing import Any

from .about import sentence
from .points.optimum_page import optimum_page
from .points.page import point_page
from .points.words import definition, judged
from .rows import BARS, DEFINITIONS, POINT, Rows, holds, of_others

HEAD = """# The planners, measured

Written by `python -m experiments.plan_benchmark --json FILE --page FILE`; do not edit. `--help` explains every option.
"""
ARM_TITLE = "## The planner of the whole arm"
ARM = """
## The planner of the whole arm

Problems of a UR5 among 2 to 12 boxes (rainorangelemon/gnn-motion-planning, MIT), the arm's capsules 1 cm thinner than the project's,
forearm and wrist 2 may overlap{taken}. Paths are B-splines of 12 control points, checked by the optimiser at 64 configurations, with
2 cm from the obstacles where the ends allow it.

* **Rounds.** First the straight joint line is optimised, then for what is left, and up to the third round for paths 1.25 times as long as the straight line,
  the cheapest of more and more random detours: 3 of 32, 8 of 96, 16 of 192, 32 of 384, 64 of 1024. A guess costs its length and the penalties at 32 configurations;
  after six steps what is still far from free is given up.
  At last all accepted paths are shortened with 6 mm from the obstacles. Paths are accepted, the shortest first, by the exact check.
* **Roadmaps**, `success_guided`: what is left gets guesses by a lazy roadmap through random free configurations, optimised likewise; where none becomes a free
  path, the roadmap's own line is taken, and counts here alone.
* **OMPL's planners** get {peers} of the same problems, drawn evenly, and every problem of the other families: 5 s each, the box of both ends grown by 2 rad, validity every
  degree by C MuJoCo's collisions of the same capsules, OMPL's simplification. Their paths count if the exact check accepts them.
* **Other families**, seeded, start and goal random with the tool among the obstacles, nothing of the solver chosen on them: shelves, tables on legs with upright capsules on top,
  cages of bars and beams, spheres, boxes turned at random, a table with walls as a hundred points. Some may have no solution.
* **What is impossible** is not tried: problems whose start or goal is not free. They count in the times per problem.
* **Times** `ms_amortised` and `ms_guided` are those of one process for each core (`processes`), side by side, compiled before; the slowest one
  counts. All other times are those of a single process.
* The numbers of the solver were chosen on 300 of the problems, drawn evenly; `success_rest` is that of the others.

{origin} Other programs that share the machine lengthen wall times, those of small programs most; `ms_amortised_cpu` is what they lengthen least.

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
        words = DEFINITIONS.get(name) or of_others(name) or definition(name)
        around = f" [{entry['low']:.3g}, {entry['high']:.3g}]" if "low" in entry else ""
        lines.append(f"| {name} | {entry['value']:.4g}{around} | {entry['unit']} | {bar}{missed} | {words} |")
    return "\n".join(lines) + "\n"


def kept_points(old: str) -> str:
    """What an older page says of the planners of a point; empty if nothing."""
    begin, end = old.find("## Planners of a point, compared"), old.find(ARM_TITLE)
    return old[begin:end].rstrip() + "\n" if 0 <= begin < end else ""


def page(
    rows: Rows, figures: Sequence[str] = (), origins: Mapping[str, Mapping[str, Any]] | None = None, old: str = ""
) -> str:
    """A Markdown page of the rows of both spaces, as far as they are there.

    Args:
        old: the page that is replaced: what it says of a space without rows stays.
        figures: of the comparison, name and content of each.
        origins: space -> what its rows were measured on.
    """
    origins = origins or {}
    points = point_page(rows, sentence(origins.get("point")))
    points = points or (f"\n{kept}" if (kept := kept_points(old)) else "")
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
        text += ARM.format(
            taken=taken,
            peers=f"{rows['peer_problems']['value']:.0f}" if "peer_problems" in rows else "none",
            origin=sentence(origins.get("arm")),
        ) + bars_table(rows, arm)
    else:
        before = old.partition(ARM_TITLE)[2].strip()
        text += (
            f"\n{ARM_TITLE}\n\n{before}\n"
            if before
            else f"\n{ARM_TITLE}\n\nNot measured here; {COMMAND.format(space='arm')}.\n"
        )
    return text
