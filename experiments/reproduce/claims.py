"""Every claim of both papers: what became of it, by which figure, and the command that decides."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from .printed import LEADS

REPRODUCED, REFUTED, UNDECIDABLE, OPEN = "reproduced", "refuted", "not decidable", "open"
PROGRAM = "python -m experiments.reproduce"
TESTS = "python -m pytest "
DOCS = Path(__file__).resolve().parents[2] / "docs"
"""Pages of a checkout, whose measured figures are quoted; an installed package has none."""

Rows = Mapping[str, Mapping[str, Any]]


class Claim(NamedTuple):
    """One claim."""

    where: str
    """Section or table of the paper."""
    text: str
    """What it says, in short."""
    verdict: str
    why: Callable[[Rows], str]
    """The figure, from the rows of a run."""
    command: str
    """What decides it."""


def value(rows: Rows, name: str, digits: int = 2) -> str:
    """A row's value as text; "?" if the run has no such row."""
    return f"{rows[name]['value']:.{digits}f}" if name in rows else "?"


def cited(page: str, name: str, section: str = "") -> str:
    """The value of a row in a table of a page of the docs, as written there, below a heading if given; "?" if there is none."""
    path = DOCS / page
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    below = text.partition(f"\n## {section}\n")[2] if section else text
    found = re.search(rf"^\| {re.escape(name)} \| ([^|]*?) \|", below, re.MULTILINE)
    return found.group(1) if found else "?"


def said(text: str) -> Callable[[Rows], str]:
    """The same whatever the rows; `{PAGE:ROW}` and `{PAGE#SECTION:ROW}` become figures of the docs."""
    pattern = r"\{([\w-]+\.md)(?:#([\w ]+))?:([\w.]+)\}"
    return lambda rows: re.sub(pattern, lambda m: cited(m.group(1), m.group(3), m.group(2) or ""), text)


def of(text: str) -> Callable[[Rows], str]:
    """`{ROW}` and `{ROW:DIGITS}` become values of the run."""
    return lambda rows: re.sub(r"\{(\w+)(?::(\d))?\}", lambda m: value(rows, m.group(1), int(m.group(2) or 2)), text)


def _leads(rows: Rows, which: int) -> str:
    """Said and by the printed table: over gradient descent (0) or RRT* (1)."""
    name = ("gda", "rrt")[which]
    return "; ".join(
        f"table {table} {value(rows, f'{table}_lead_{name}', 1)} % (said: {lead[1 + which]:g})"
        for table, lead in LEADS.items()
    )


ROBOTICA = (
    Claim("abstract, 6", "system performance improves by 83.87 % over the ideal case", REFUTED,
          of("the number is the score with zones in percent of the score without zones and without a person: {X_relative:4} %, a loss of 16.13 %"), PROGRAM),
    Claim("5", "score of 83.87 % relative to the system without zones", REPRODUCED, of("{X_relative:4} % from table X and the printed weights"), PROGRAM),
    Claim("5", "safety 61 %, efficiency 55 % with zones", REPRODUCED, of("{X_safety_with:3} and {X_efficiency_with:3} % from table X"), PROGRAM),
    Claim("table X", "the measures of the runs themselves", UNDECIDABLE,
          of("measured on a robot beside a person. Our tool beside a simulated hand: task time 100 without and {episode_task_time_with:1} with zones (printed 100 and 67.66), safe navigation {episode_safe_navigation_without:1} and {episode_safe_navigation_with:1} (printed 100, with nobody there, and 73.51)"), PROGRAM),
    Claim("5", "the metric is objective and maps to safety and efficiency", REFUTED,
          said("more power scores higher, trajectory smoothness cannot rank runs, a failed run can score above a successful one (`hrcjax/metrics/score.py`, [sweep-analysis.md](sweep-analysis.md))"), TESTS + "tests/metrics/test_score.py tests/metrics/test_sound_score.py"),
    Claim("5", "weights found by refinement and sensitivity analysis", UNDECIDABLE, said("the paper shows no such analysis"), "-"),
    Claim("3.1, table I", "4.70 s whatever the number of obstacles", REPRODUCED, of("worst difference {I_iapf_worst_spheres} % (spheres)"), PROGRAM),
    Claim("3.2, table II", "4.68 to 4.72 s whatever their size", REPRODUCED, of("{II_1_iapf_spheres:3} to {II_4_iapf_spheres:3} s, worst difference {II_iapf_worst_spheres} % (spheres)"), PROGRAM),
    Claim("3.3, table III", "4.68 to 4.72 s for mixed sizes", REPRODUCED, of("worst difference {III_iapf_worst_spheres} % (spheres)"), PROGRAM),
    Claim("3.4, table IV", "4.70 s whatever the height", UNDECIDABLE,
          of("no reading gives both: spheres {IV_1_iapf_spheres}, {IV_2_iapf_spheres}, {IV_3_iapf_spheres}, {IV_4_iapf_spheres} s depend on it; columns do not, at {IV_1_iapf_columns} s. What a height changes is not said"), PROGRAM),
    Claim("3.5, table V", "a larger K_att arrives sooner: 4.70, 3.51, 2.79 s", REPRODUCED, of("{V_1_iapf_spheres:3}, {V_2_iapf_spheres:3}, {V_3_iapf_spheres:3} s"), PROGRAM),
    Claim("3.5, table VI", "a larger K_rep hardly delays: 3.51, 3.51, 3.52 s", REPRODUCED, of("{VI_1_iapf_spheres:3}, {VI_2_iapf_spheres:3}, {VI_3_iapf_spheres:3} s"), PROGRAM),
    Claim("3.6, table VII", "a larger safety factor costs time: 4.70, 4.72, 4.74 s", REPRODUCED,
          of("the times within {VII_iapf_worst_spheres} %, but the growth only where obstacles are in the way: columns {VII_1_iapf_columns}, {VII_2_iapf_columns}, {VII_3_iapf_columns} s; spheres {VII_1_iapf_spheres:3}, {VII_2_iapf_spheres:3}, {VII_3_iapf_spheres:3} s"), PROGRAM),
    Claim("3.1 to 3.4", "leads over gradient descent of 37, 35, 39, 37 %", REPRODUCED, lambda rows: _leads(rows, 0) + ". Case 2 is not", PROGRAM),
    Claim("3.1 to 3.4", "leads over RRT* of 9, 10, 4, 21 %", REFUTED, lambda rows: _leads(rows, 1) + ": its own tables", PROGRAM),
    Claim("3.3", "RRT* takes 6.14 to 6.29 s in case 3", REFUTED, said("table III: 5.77 to 6.29 s"), PROGRAM),
    Claim("3", "the improved field is a third faster than gradient descent", REFUTED,
          of("the printed times are steps of {printed_step_iapf_min} to {printed_step_iapf_max} cm against {printed_step_gda_min} to {printed_step_gda_max} cm each 1/30 s. At one speed, spheres: {fair_iapf_time_spheres} and {fair_gda_time_spheres} s; columns, where O1 blocks the line: {fair_iapf_time_columns} and {fair_gda_time_columns} s; clearance: {fair_iapf_time_clearance} and {fair_gda_time_clearance} s. So its path is the shorter one where an obstacle is in the way, by 7 to 12 %"), PROGRAM),
    Claim("3", "the improved field is faster than RRT*", REFUTED,
          of("at one speed, columns: improved field {fair_iapf_time_columns} s, RRT* {rrt_time_10000_columns} s after 10,000 iterations. The printed times of RRT* are at that speed those of paths of {printed_rrt_length_min:0} to {printed_rrt_length_max:0} cm: of a tree stopped after some 200 to 2,000 iterations"), PROGRAM),
    Claim("3.5", "gradient descent takes 7.48 to 7.56 s by its constants", UNDECIDABLE,
          of("its steps are not stated. Unit steps each 1/30 s take {V_1_gda_spheres:1}, {V_2_gda_spheres:1}, {V_3_gda_spheres:1} s: 13 % apart, as with any other time of a step, where the printed times are 1 % apart; and one setting, four obstacles of 3 cm, is printed as 7.61, 7.62 and 7.70 s"), PROGRAM),
    Claim("2.3", "suitable for real-time applications", REPRODUCED, of("a plan of a point takes {plan_ms_columns:1} ms, compiled, on one processor that is shared; an image comes every 33 ms"), PROGRAM),
    Claim("2.3", "local minima are mitigated by recalibrating the forces", REFUTED,
          said("no equation does so; the descent stays in a U-shaped trap. Several guesses side by side leave it"), TESTS + "tests/plan/test_arm_plan.py -k trap"),
    Claim("2.3", "d_factor adapts the repulsion and lets the robot reach a goal beside an obstacle", REPRODUCED,
          said("with the present configuration in eq. 3a; as printed it is a constant and does not"), TESTS + "tests/plan/test_corrections.py"),
    Claim("2.3", "the forces are the gradients of the potential", REFUTED, said("eqs. 2c, 3c and 3f as printed are not, and the potential of 2e jumps; corrected they are ([reproduce.md](reproduce.md))"), TESTS + "tests/plan/test_corrections.py"),
    Claim("2.4", "bending energy in the objective makes paths smooth", REPRODUCED,
          of("columns: {fair_iapf_bending_columns} /cm of the descent, {fair_planned_bending_columns:4} /cm planned, {fair_iapf_length_columns:1} and {fair_planned_length_columns:1} cm long"), PROGRAM),
    Claim("table VIII", "the optimal path has the least score: 0.5, 0.54, 0.12", REPRODUCED,
          of("{VIII_1_score}, {VIII_2_score}, {VIII_3_score} by the printed lengths and energies. Not both 0.54 and 0.12: whatever they are rounded from, one of these two paths has the least energy, and the largest difference is at least {VIII_worst:3}"), PROGRAM),
    Claim("2.3", "faster to compute than, and as good as, control barrier functions or learned policies", OPEN, said("needs the comparison of the field with a control barrier function in the same scenes"), "-"),
    Claim("1, 4", "the path's geometry is never changed; only its timing is", REPRODUCED, said("a path clock under any limits: less than 1e-9 m off; joints of the whole arm within 1e-3 rad"), TESTS + "tests/safety/test_clock.py tests/sim/test_guide.py"),
    Claim("2.5, 4", "safety zones slow the robot near a person", REPRODUCED,
          of("thresholds are ours, the paper has none. Columns, a hand that reaches in: {episode_time_without} s without, {episode_time_with} s with zones"), PROGRAM),
    Claim("abstract, 1", "safe collaboration as ISO/TS 15066 asks", REFUTED,
          said("red only slows, without a stop; the distance is the tool's alone, and an elbow can be nearer. The whole arm and a stop are the default here"), TESTS + "tests/safety/test_governor.py -k elbow"),
    Claim("2.6", "performance recovers swiftly once it is safe", REPRODUCED, said("after a stop the speed returns within the bounds of acceleration and jerk, without a jump"), TESTS + "tests/safety/test_clock.py -k resumes"),
    Claim("1", "productivity is kept while safety is ensured", OPEN, said("needs the comparison of zones on and off over many recorded people, with productivity lost in each zone"), "-"),
    Claim("1, 6", "no replanning is needed", UNDECIDABLE,
          said("true of what the paper shows. While a hand stays in the way, leaving the path saved no time either: ratio {avoidance.md:time_ratio} ([avoidance.md](avoidance.md))"), "python -m experiments.avoidance"),
    Claim("1", "energy-efficient motion", UNDECIDABLE, said("the paper gives no energy; its power score rises with power"), "-"),
    Claim("4", "distance to the person in real time, 30 images a second", REPRODUCED,
          said("median {sensing.md:image_ms_p50} ms an image, without detection of people by a network, which is not part of this project; 95th percentile {sensing.md:image_ms_p95} ms"), "python -m experiments.sensing"),
    Claim("2.1", "gestures by Mediapipe and YOLOv7 reduce response times and errors", UNDECIDABLE, said("no images, weights or times are published"), "-"),
    Claim("2.2", "mapping with a finger reduces the search space", UNDECIDABLE, said("no measure is given"), "-"),
    Claim("2", "applicable to various paths and robots", REPRODUCED, said("any serial arm from a MuJoCo model ([own-parts.md](own-parts.md)); in simulation alone"), TESTS + "tests/cells/test_own_parts.py"),
)  # fmt: skip

HRI = (
    Claim("abstract", "a continuous and differentiable distance field", REPRODUCED, said("largest jump {map-evaluation.md:jump} mm along lines in steps down to 8 micrometres"), "python -m experiments.map --evaluate"),
    Claim("abstract", "surface normals by the Hessian", REPRODUCED, said("median error {map-evaluation.md:hessian_2mm_median.worst} degrees on the worst body, 2 mm of noise"), "python -m experiments.map --evaluate"),
    Claim("abstract", "curvature is readily available", REPRODUCED, said("error {map-evaluation.md:curvature_2mm.sphere_100} of the curvature of a ball of 10 cm, 95th percentile, 2 mm of noise"), "python -m experiments.map --evaluate"),
    Claim("framework", "points are told static, dynamic and new by two distance fields", REPRODUCED,
          said("a box moves: share of its old points gone after one image {map-evaluation.md:moved_gone}, of its new surface found {map-evaluation.md:moved_found}"), "python -m experiments.map --evaluate"),
    Claim("abstract", "efficient updates in dynamic scenes on a CPU", REPRODUCED, said("{benchmarks.md:p95_ms} ms an image of 640 x 480, 95th percentile, two cores"), "python -m experiments.benchmark map"),
    Claim("abstract", "fast reactive motion by Riemannian motion policies", REPRODUCED, said("{benchmarks.md#sweep:ticks_per_s} ticks of 8 ms a second in a batch of 128"), "python -m experiments.benchmark sweep"),
    Claim("abstract", "smooth collision avoidance by distance and gradient", REPRODUCED,
          said("contacts in {avoidance.md:contact_share} of episodes with obstacles that the planner does not know, {avoidance.md:contact_share_leaf_off} without the policy's collision leaf"), "python -m experiments.avoidance"),
    Claim("abstract", "the robot interacts safely with people", UNDECIDABLE,
          said("as a statement about people. In simulation contact while the arm moves in {avoidance.md:moving_contact_share_both} of the episodes beside them; research software, not safety-rated"), "python -m experiments.avoidance"),
    Claim("results", "mean squared jerk about 2 times lower than BFMT* with replanning on an occupancy octree", OPEN, said("needs the comparison of the reactive arm with an arm that replans by BFMT* on the same images, between the two waypoints"), "-"),
    Claim("results", "change in curvature about 3 times lower than that", OPEN, said("needs the same comparison"), "-"),
    Claim("abstract", "grasping by the field's normals in a dynamic environment", OPEN, said("needs the comparison of grasps by these normals with the bodies' own; normals are measured, see above"), "-"),
    Claim("abstract", "versatile and open, low in computation, ideal for user studies", UNDECIDABLE, said("no measure is given"), "-"),
)  # fmt: skip


def counts() -> dict[str, int]:
    """How many claims have each verdict."""
    return {
        verdict: sum(claim.verdict == verdict for claim in (*ROBOTICA, *HRI))
        for verdict in (REPRODUCED, REFUTED, UNDECIDABLE, OPEN)
    }


def claims_page(rows: Rows, command: str) -> str:
    """The page of all claims, as Markdown."""
    told = ", ".join(f"{count} {verdict}" for verdict, count in counts().items())
    text = f"""# The papers' claims

Written by the program; do not edit.

```
{command}
```

{told}. *Reproduced*: the same within what the paper's digits and this page say. *Refuted*: a measurement, or the paper's own numbers, say
otherwise. *Not decidable*: by what is published. *Open*: nothing here decides yet; the comparison it needs is named. Times to goal
assume unit steps of 1/30 s and arrival at 1 cm, both inferred ([reproduce.md](reproduce.md)). Figures of other pages are quoted from them; "?" stands for what the run did not compute.
"""
    for title, some in (
        ("Robotica 2025: potential field, paths, zones, score", ROBOTICA),
        ("HRI 2025: distance fields and motion policies (abstract and project page)", HRI),
    ):
        text += f"\n## {title}\n\n| where | claim | verdict | figure | decided by |\n|---|---|---|---|---|\n"
        for claim in some:
            decided = claim.command if claim.command == "-" else f"`{claim.command}`"
            text += f"| {claim.where} | {claim.text} | **{claim.verdict}** | {claim.why(rows)} | {decided} |\n"
    return text
