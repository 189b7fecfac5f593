"""What the rows of this part measure, and what the bars do not tell by themselves."""

from collections.abc import Callable, Mapping
from typing import Any

from .curve import TOLERANCE
from .measures import BASELINES, BENT, KEYS, LONGER, MANY, MINE, UNITS, UNSEEN
from .optimum_rows import WITHIN
from .page import interval

Rows = Mapping[str, Mapping[str, Any]]


def judged(rows: Rows, holds: Callable[[str, float], bool | None]) -> str:
    """What the bars do not tell by themselves, in sentences.

    Args:
        holds: whether a value keeps the bar of a row.
    """
    said: list[str] = []
    for name in MANY:
        shares = [rows.get(f"{begin}_{name}") for begin in ("point_best_share", "point_best_share_strict", "point_unseen_share", "point_unseen_share_strict")]  # fmt: skip
        if shares[0] and shares[1]:
            text = f"`{name}` is as good as the bar asks in {interval(shares[0])} of the scenes, by the strict comparison in {interval(shares[1])}"
            if shares[2] and shares[3]:
                text += f"; in the scenes of other seeds in {interval(shares[2])}, by the strict comparison in {interval(shares[3])}"
            said.append(text + ".")
    gap = rows.get("point_paper_distance_touching")
    if gap and gap["value"] < 0:
        text = f"The path of `point_paper_*_touching` goes {-10 * gap['value']:.2f} mm into the column, within the tolerance of {1000 * TOLERANCE:g} mm"
        wide = [rows.get(f"point_paper_{what}_clear_3cm") for what in ("length", "bending")]
        if wide[0] and wide[1]:
            kept = [
                holds(f"point_paper_{what}_touching", one["value"])
                for what, one in zip(("length", "bending"), wide, strict=True)
                if one
            ]
            meets = ", which meets the same bars" if all(kept) else ""
            text += f"; the one with 3 cm from the surfaces is {wide[0]['value']:.1f} cm long and has {wide[1]['value']:.2g} /cm{meets}"
        said.append(text + ".")
    return "\n".join(said)


def definition(name: str) -> str:
    """What a row of this part measures."""
    for prefix, words in DEFINITIONS.items():
        if name.startswith(prefix):
            return words
    return ""


DEFINITIONS = {
    f"point_success_{MINE}": "share of scenes with a path that keeps clearance and bounds, planner and check agreeing",
    "point_best_share_strict": f"the same, its bending energy at most {BENT:g} of the least among the baselines that succeed and are at most {100 * (LONGER - 1):.0f} % longer than the shortest",
    "point_best_share": f"share of scenes in which the planner is at most {100 * (LONGER - 1):.0f} % longer than the shortest of the baselines ({', '.join(BASELINES)}) that succeed, and its bending energy at most {BENT:g} of that one's",
    "point_best_length_share": "the condition of length alone",
    "point_best_bending_share": "the condition of bending energy alone, with that of the shortest baseline",
    "point_unseen_scenes": f"scenes of other seeds, from {UNSEEN} on",
    "point_unseen_success": "success in these",
    "point_unseen_share_strict": "`point_best_share_strict` in these",
    "point_unseen_share": "`point_best_share` in these",
    "point_unseen_length_share": "the condition of length alone in these",
    "point_unseen_bending_share": "the condition of bending energy alone in these, with that of the shortest baseline",
    "point_paper_length_touching": "paper's scene, obstacles as columns, no contact asked for: length (printed optimum 78.64 cm; shortest without contact 72.88 cm)",
    "point_paper_bending_touching": "its bending energy (printed 0.03)",
    "point_paper_distance": "least surface distance of that path",
    "point_paper_length_clear_3cm": "the same scene with 3 cm from the surfaces: length",
    "point_paper_bending_clear_3cm": "its bending energy",
    "point_lagrange_scenes": "scenes in which the optimiser is held against the augmented Lagrangian",
    "point_lagrange_unsolved": "of these, scenes in which the augmented Lagrangian found no minimum",
    "point_lagrange_failed": "scenes in which the planner does not claim its path, or the dense check refuses it",
    "point_lagrange_cost_max": "largest cost over the least that the augmented Lagrangian found with the whole distance kept, less 1",
    "point_lagrange_within": f"share of scenes in which that is at most {WITHIN:g}; a failure is none",
    "point_lagrange_equal_cost_max": "the same, the augmented Lagrangian allowed the violation that the planner's path has",
    "point_lagrange_equal_within": f"share of scenes in which that is at most {WITHIN:g}",
    "point_lagrange_own_cost_max": "the same, started from the planner's path alone: what the optimiser itself left",
    "point_lagrange_own_within": f"share of scenes in which that is at most {WITHIN:g}",
    "point_lagrange_violation": "most that is missing from the distance asked for by the dense check; negative: kept by more",
    "point_lagrange_equal_lost": "scenes in which the augmented Lagrangian that is allowed the planner's violation found no minimum: the least of its others stands for it",
    "point_lagrange_residual": "largest violation or push of a constraint that does not bind, at the least cost",
    "point_scenes": "scenes",
    "point_rejected": "seeds rejected for this reason",
    "point_budget": "time of a sampling planner for a scene",
    "point_success": "success of this planner, with Wilson's interval",
    "point_ratio": f"`{MINE}` over this planner where both succeed: median ratio",
    "point_wrong_claim": "share of scenes in which the planner claims success and the check disagrees",
    "point_stops": "share of its successes whose line is executed with stops at corners",
    "point_compile": "time to compile the planner",
    **{f"point_{measure}": f"median over the scenes that this planner solves, in {UNITS[measure]}" for measure in KEYS},
}
