"""The part of the page that holds the optimiser's cost against the augmented Lagrangian's: from the rows alone."""

from collections.abc import Mapping
from typing import Any

from .curve import TOLERANCE
from .lagrange import CLOSE, FLAT
from .optimum import COMPARED, GUESSES, REQUIRED, SAME, ZETA
from .optimum_rows import BEGIN, WITHIN
from .page import interval, markdown, number

Rows = Mapping[str, Mapping[str, Any]]
TEXT = """
### The optimum where constraints bind hard

{scenes:.0f} scenes of the same seeds, zeta {zeta:g} and {required:g} cm of distance instead of 3: those whose ends and one way at least keep it. The cost is the optimiser's,
length + 0.01 m x bending energy, over the same 48 waypoints, the distance asked for at the same places, the waypoints and midway between them.

* **Augmented Lagrangian**: multipliers and a growing penalty around SciPy's L-BFGS-B, in double precision, from the planners' own paths and {guesses} other starts: an
  arch, the straight line, bows all round it, other detours than the planner's. A minimum counts if no constraint is violated by more than {converged:g} mm, none that
  does not bind pushes, and about {flat:g} at most is left to gain; no minimum: {unsolved:.0f} scenes.
* **One dense check for both**: the natural spline through the waypoints, its length and bending energy by quadrature, exact distances every mm. Between the samples the spline
  may be nearer or farther than at them. So the augmented Lagrangian asks for more or less there until its spline misses what is allowed, to {same:g} mm: nothing in `whole`, in `equal` the
  planner's own violation, so that no path wins by cutting in. The planner's tolerance is {tolerance:g} mm. Negative ratios: the least cost of the samples is not quite that of the spline.
* **Another side, or not converged**: `own` starts from the planner's path with a stiff penalty, so that it hardly slips through an obstacle. What it gains, the optimiser has left; what `equal` gains
  beyond that is on another side of an obstacle, which the planner has not tried or not found. `iapf_optimised` takes the side of the descent by definition.

Largest cost over that of the augmented Lagrangian, less 1, and share of scenes within {within:g} %:

"""


def optimum_page(rows: Rows) -> str:
    """The section; empty without its rows."""
    if f"{BEGIN}_residual" not in rows:
        return ""
    head = ["planner", *(f"{of}: {what}" for of in ("whole", "equal", "own") for what in ("largest", "within"))]
    lines = [[*head, "failed", "violation [mm]"]]
    for name in COMPARED:
        line = [name]
        for begin in ("", "equal_", "own_"):
            line += [
                number(rows[f"{BEGIN}_{begin}cost_max_{name}"]["value"]),
                interval(rows[f"{BEGIN}_{begin}within_{name}"]),
            ]
        lines.append([*line, *(number(rows[f"{BEGIN}_{what}_{name}"]["value"]) for what in ("failed", "violation"))])
    text = TEXT.format(
        scenes=rows[f"{BEGIN}_scenes"]["value"], unsolved=rows[f"{BEGIN}_unsolved"]["value"], zeta=ZETA, required=100 * REQUIRED,
        guesses=GUESSES, converged=1000 * CLOSE, flat=FLAT**2 / 2, same=1000 * SAME, tolerance=1000 * TOLERANCE, within=100 * WITHIN,
    )  # fmt: skip
    return text + markdown(lines)
