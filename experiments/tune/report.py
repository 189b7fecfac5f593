"""What the program says: what the loss feels, before and after, and the file of tuned parameters."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hrcjax.lab.table import aligned
from hrcjax.tune.felt import ALIKE, LEAST_FELT, LEAST_ROWS, STEP, Felt

from .problem import Problem


def felt_text(felt: Felt, problem: Problem) -> str:
    """Which parameters the loss feels, and which pairs it cannot tell apart."""
    chosen, cosines = problem.chosen, np.nan_to_num(np.abs(felt.cosines()))
    np.fill_diagonal(cosines, 0)
    rows = [["parameter", "start", "low", "high", "slope/loss", "curvature/loss", "most alike"]]
    for k, name in enumerate(chosen.names):
        bounds, other = chosen.bounds[k], int(np.argmax(cosines[k]))
        like = f"{chosen.names[other]} {cosines[k, other]:.3f}" if cosines[k, other] > 0 else ""
        numbers = (chosen.starts[k], bounds.low, bounds.high, felt.share[k], felt.curvature[k, k] / abs(felt.loss or 1))
        rows.append([name, *(f"{x:.3g}" for x in numbers), like])
    lines = [f"Before the first step, loss {felt.loss:.5g}; by the coordinates, in the worlds of the first step:"]
    lines.append(aligned(rows, "<>>>>><"))
    if not np.isfinite(felt.loss):
        return "\n".join([*lines, "warning: the loss is not finite here: no step from this start"])
    broken = [name for name, slope in zip(chosen.names, felt.gradient, strict=True) if not np.isfinite(slope)]
    if broken:
        lines.append(f"warning: the slope by {', '.join(broken)} is not finite: no step from this start")
    deaf = [name for name, felt_it in zip(chosen.names, felt.felt, strict=True) if not felt_it and name not in broken]
    if deaf:
        lines.append(f"warning: the loss does not feel {', '.join(deaf)} (less than {LEAST_FELT:g} of it): they will stay where they are")  # fmt: skip
    jumps = [name for name, jump in zip(chosen.names, felt.jumps, strict=True) if jump]
    if jumps:
        lines.append(f"note: the loss jumps within {STEP:g} of the coordinate of {', '.join(jumps)}, or its slope there is wrong: not compared with others")  # fmt: skip
    lines += [
        f"warning: no term in any world tells {chosen.names[i]} from {chosen.names[k]} here (cosine {cosine:.4f}, |cosine| > {ALIKE:g}): "
        "one undoes the other, so that their values alone mean little"
        for i, k, cosine in felt.alike()
    ]
    if unknown := felt.unknown():
        pairs = "; ".join(f"{chosen.names[i]}, {chosen.names[k]}" for i, k in unknown)
        lines.append(f"note: too few worlds and terms to tell whether the loss knows these apart ({LEAST_ROWS} that feel them are needed): {pairs}")  # fmt: skip
    return "\n".join(lines)


def table(sections: Mapping[str, Mapping[str, Mapping]], problem: Problem) -> str:
    """Before and after in every section, a line each metric."""
    rows = [["worlds", "metric", "unit", "better", "before", "after", "change", "95 % of the mean change"]]
    for section, entries in sections.items():
        for name, (unit, better) in problem.units.items():
            if f"{name} before" not in entries:
                continue
            before, after, change, low, high = (
                entries[f"{name} {what}"]["value"] for what in ("before", "after", "change", "low", "high")
            )
            within = "one world" if np.isnan(low) else f"{low:+.3g} to {high:+.3g}"
            rows.append([section, name, unit, better, f"{before:.4g}", f"{after:.4g}", f"{change:+.3g}", within])
    return aligned(rows, "<<<<>>>>")


def values_table(problem: Problem, before: NDArray, after: NDArray) -> str:
    """The parameters before and after."""
    rows = [["parameter", "before", "after"]]
    rows += [[n, f"{a:.6g}", f"{b:.6g}"] for n, a, b in zip(problem.chosen.names, before, after, strict=True)]
    return aligned(rows, "<>")


def above(command: str, commit: str, problem: Problem, sections: Mapping[str, Mapping[str, Mapping]]) -> str:
    """The comment of the file of tuned parameters."""
    lines = ["Tuned parameters.", "", f"Command: {command}", f"Code: {commit}"]
    lines += [f"Training worlds: {', '.join(problem.training)}", f"Held out: {', '.join(problem.held_out) or 'none'}"]
    for section, entries in sections.items():
        for name in ("score_sound", "loss"):
            if f"{name} before" in entries:
                lines.append(f"{section}, {name}: {entries[f'{name} before']['value']:.4g} before, {entries[f'{name} after']['value']:.4g} after")  # fmt: skip
    return "\n".join(lines)
