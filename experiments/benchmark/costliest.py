"""The costliest places of the control tick, in words, from the rows of section `loop`."""

from collections.abc import Mapping
from typing import Any

PLACES = 3
TRIED = {
    "field": "One exponential for each pair of control point and stored point, and with each its distance and the columns of the sums for "
    "value and gradient. Tried: positions by component instead of vectors (kept), kernels weighted before a product with shared columns "
    "(kept), a first search for the nearest point so that one pass of exponentials serves all sums (kept).",
    "governor": "A quadratic program of seven unknowns by an active set: up to 24 rounds, each of which needs the one before, and a batch "
    "waits for its last member. Tried: few rows at a time, written out as scalars (kept), a row that takes the place of another in a full set "
    "(kept).",
    "guide": "Leaves with Jacobians and metrics of a few numbers for each control point: arrays that are written and read again between the "
    "compiler's fused loops. Tried: borders between the steps of a tick, so that nothing is computed anew in each of its uses (kept).",
}
"""What bounds a part, and what was tried."""


def costliest(rows: Mapping[str, Mapping[str, Any]], places: int = PLACES) -> list[str]:
    """Names of the parts with the largest shares of the tick, the largest first."""
    parts = [name.removesuffix("_share") for name in rows if name.endswith("_share") and name != "rest_share"]
    return sorted(parts, key=lambda part: -float(rows[f"{part}_share"]["value"]))[:places]


def paragraph(rows: Mapping[str, Mapping[str, Any]]) -> str:
    """Where the time goes, and how far from the machine's limits; "" without shares."""
    names = costliest(rows)
    if not names:
        return ""

    def of(row: str) -> float:
        return float(rows[row]["value"]) if row in rows else float("nan")

    top, most = of("peak_gflop_per_s"), of("peak_gb_per_s")
    lines = [
        f"{number}. `{name}`: {100 * of(f'{name}_share'):.0f} % of the tick; {of(f'{name}_gflop_per_s'):.2g} GFLOP/s, "
        f"{100 * of(f'{name}_gflop_per_s') / top:.1f} % of the peak of a matrix product; {of(f'{name}_gb_per_s'):.2g} GB/s "
        f"by the compiler's count, {of(f'{name}_gb_per_s') / most:.2g} times what the memory gives; "
        f"{of(f'{name}_gfunction_per_s'):.2g}e9 exponentials and other functions a second, "
        f"{100 * of(f'{name}_gfunction_per_s') / of('peak_gfunction_per_s'):.0f} % of the peak. {TRIED.get(name, '')}".rstrip()
        for number, name in enumerate(names, 1)
    ]
    return "\n".join(["The costliest places:", "", *lines])
