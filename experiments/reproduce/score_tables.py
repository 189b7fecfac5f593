"""Tables VIII to X, as Markdown."""

from collections.abc import Sequence

from .paths import BENDING_WEIGHTS, SCENE, ZETAS, measured
from .printed import FORMULAS, PATHS, RELATIVE_PRINTED, SCORES
from .readings import row_scene
from .rows import Cases, Rows, told
from .scores import closest_scores, scores_of


def score_tables(cases: Cases, rows: Rows, readings: Sequence[str]) -> str:
    """Tables VIII to X."""
    plain = scores_of([path.length for path in PATHS], [path.bending for path in PATHS])
    text = "\n## Table VIII. Scores obtained on optimization\n\nomega1 = omega2 = 0.5 over length and bending energy, each scaled to 0..1 among the candidates.\n\n"
    text += "| path | length cm | bending energy /cm | printed score | from the row | difference | closest within rounding |\n|---|---|---|---|---|---|---|\n"
    for path, score, near in zip(PATHS, plain, closest_scores(), strict=True):
        text += f"| {path.name} | {path.length} | {path.bending} | {path.score} | {score:.3f} | {score - path.score:+.3f} | {near:.3f} |\n"
    text += "\nThe printed 0.54 and 0.12 cannot both follow from these three paths: one of BC-2 and the optimal path has the least bending energy, which leaves it 0.500 or 0.106 (within 0.004). They can if the scale was that of more candidates.\n"
    reading = told(readings)
    paths, scene = cases[f"paths/{reading}"], row_scene(reading, SCENE)
    text += f"\nOur planned paths, {reading}; the paper does not say which obstacles its paths kept how far from.\n\n"
    text += "| distance from axes, radii | omega2 m | length cm | bending energy /cm | score among the three | keeps its distances |\n|---|---|---|---|---|---|\n"
    for zeta, some, clear in zip(ZETAS, paths["planned"], paths["clear"], strict=True):
        found = [measured(path, scene) for path in some]
        scores = scores_of([one.length for one in found], [one.bending for one in found])
        for weight, one, score, kept in zip(BENDING_WEIGHTS, found, scores, clear, strict=True):
            text += f"| {zeta:g} | {weight:g} | {100 * one.length:.2f} | {one.bending / 100:.4f} | {score:.2f} | {'yes' if kept else '**no**'} |\n"
    text += "\n## Table IX. Performance evaluation metric\n\n| measure | as printed | reading |\n|---|---|---|\n"
    for name, (printed, reads) in FORMULAS.items():
        text += "| " + " | ".join(cell.replace("|", "\\|") for cell in (name, printed, reads)) + " |\n"
    text += "\n## Table X. Performance evaluation metric scores\n\nThe seven measures were taken on a robot beside a person and cannot be computed here; their sums can.\n\n"
    text += "| measure | without zones | with zones |\n|---|---|---|\n"
    for name, (without, zones) in SCORES.items():
        text += f"| {name}, printed | {without} | {zones} |\n"
    for name in ("safety", "efficiency", "overall"):
        text += f"| {name}, from these | {rows[f'X_{name}_without']['value']:.3f} | {rows[f'X_{name}_with']['value']:.3f} |\n"
    text += f"\nPrinted for the run with zones: safety 61, efficiency 55, and {RELATIVE_PRINTED} % relative to the run without; computed: {rows['X_relative']['value']:.4f} %. That is a loss of {rows['X_loss']['value']:.2f} %, not an improvement.\n"
    if "episode_time_with" in rows:
        text += f"\nA simulated counterpart: the tool on its planned path ({cases['episode']['reading']}, zeta 4) by the law of motion, beside a hand that reaches in; zones by our thresholds, as the paper gives none; the distance is the tool's alone, as in the paper.\n\n"
        text += "| measure | without zones | with zones |\n|---|---|---|\n"
        for name, words in (
            ("time", "time to goal [s]"),
            ("separation", "least distance to the person [cm]"),
            ("task_time", "task time [%]"),
            ("safe_navigation", "safe navigation [%]"),
            ("obstacle_proximity", "obstacle proximity [%]"),
            ("collision_risk", "time to collision [%]"),
        ):
            text += f"| {words} | {rows[f'episode_{name}_without']['value']:.2f} | {rows[f'episode_{name}_with']['value']:.2f} |\n"
        text += "\nIn table X the run without zones had nobody beside it; here both have. Power and joint smoothness need the arm, and are measured in the closed loop.\n"
    return text
