"""The page of the tables, as Markdown, and what the terminal shows."""

from collections.abc import Mapping, Sequence

import numpy as np

from hrcjax.lab.table import aligned

from .config import READINGS, ReproduceConfig
from .corrections import CORRECTIONS
from .fair import COMMON_SPEED
from .paths import BENDING_WEIGHTS, SCENE, ZETAS, measured
from .printed import FORMULAS, PATHS, RELATIVE_PRINTED, SCORES, TIMES, TIMES_CAPTION
from .readings import EXPLAINED, row_scene
from .rows import BARS, FITTING, PLANNERS, Cases, Rows, fair_of, holds, our_times, told
from .rrt_star import STAGES
from .scores import closest_scores, scores_of

INTRODUCTION = """# The Robotica paper, printed beside computed

Written by the program; do not edit.

```
{command}
```

`--help` explains every option. The printed numbers stand in one file, `experiments/reproduce/printed.py`. What each claim of the paper
became: [claims.md](claims.md).

* **Inferred, not printed:** the time of a step, 1/30 s, and the distance from the goal that counts as arrived, 1 cm. With them the law q <- q -
  K_att (q - q_goal) + F_rep gives the printed times; n = 2, and zeta multiplies the radius.
* **Readings of the obstacles:** {readings}.
  Tables I to VII are run in each; *{fitting}* fits the printed times, and the bars count there. Table IV and the paper's figures speak for columns.
"""
SEARCHED = """* **RRT\\*** is OMPL's, with edges of at most 10 cm (the paper gives no step size), {samples} iterations, the median of {seeds} searches, of the same seeds in each row: where no edge of a tree meets an obstacle the paths are the same. A
  search returns a path, not a time: ours is that at the common speed, {speed:.2f} cm/s, at which the straight line takes 4.70 s to 1 cm
  from the goal.
"""
NOT_SEARCHED = "* **RRT\\*** was not run: its rows are left out.\n"
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


def command(config: ReproduceConfig) -> str:
    """The command line that the pages name."""
    words = ["python -m experiments.reproduce"]
    if config.quick:
        words.append("--quick")
    if config.readings != (READINGS[:1] if config.quick else READINGS):
        words.append(f"--readings {' '.join(config.readings)}")
    for option in ("seeds", "samples"):
        if not config.quick and getattr(config, option) != getattr(ReproduceConfig, option):
            words.append(f"--{option} {getattr(config, option)}")
    return " ".join([*words, "--json reproduce.json --page docs/reproduce.md --claims docs/claims.md"])


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
    text += f"\nPrinted for the run with zones: safety 61, efficiency 55, and {RELATIVE_PRINTED} % relative to the run without; computed: {rows['X_relative']['value']:.4f} %. That is a loss of 16 %, not an improvement.\n"
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


def bars_table(rows: Rows) -> str:
    """The rows that have bars."""
    text = "\n## Bars\n\n| row | measured | unit | bar | holds |\n|---|---|---|---|---|\n"
    for name, (how, bar) in BARS.items():
        if name in rows:
            entry = rows[name]
            text += f"| {name} | {entry['value']:.3g} | {entry['unit']} | {how} {bar:g} | {'yes' if holds(name, entry['value']) else '**no**'} |\n"
    return (
        text
        + "\n`*_worst_*`: largest difference of the improved field's times from the printed ones in that table. `VIII_worst`: least largest difference of the three scores within the rounding of lengths and energies.\n"
    )


def corrections_table() -> str:
    """The equations that are not used as printed."""
    text = "\n## Equations that are not used as printed\n\n| eq. | as printed | used | why | tests |\n|---|---|---|---|---|\n"
    for one in CORRECTIONS:
        cells = [one.equation, one.printed, one.used, one.why, "<br>".join(f"`{test}`" for test in one.tests)]
        text += "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n"
    return text


def page(cases: Cases, rows: Rows, config: ReproduceConfig, figures: Sequence[str]) -> str:
    """The whole page."""
    readings = "; ".join(f"*{name}*, {EXPLAINED[name]}" for name in EXPLAINED)
    text = INTRODUCTION.format(command=command(config), readings=readings, fitting=FITTING)
    some = any(name.startswith("rrt/") for name in cases)
    text += (
        SEARCHED.format(samples=config.samples, seeds=config.seeds, speed=100 * COMMON_SPEED) if some else NOT_SEARCHED
    )
    text += bars_table(rows) + time_tables(cases, config.readings) + fair_tables(cases, rows, config.readings)
    text += score_tables(cases, rows, config.readings) + corrections_table()
    if figures:
        text += "\n## Figures of a run\n\n" + "\n".join(f"* {line}" for line in figures) + "\n"
    return text


def summary(cases: Cases, rows: Rows, readings: Sequence[str]) -> str:
    """Printed beside computed, aligned, for the terminal."""
    lines = [["table", "row", "printed [s]", *readings]]
    for one in TIMES:
        ours = [our_times(cases, reading, one)["iapf"] for reading in readings]
        lines.append([one.table, one.label, f"{one.iapf:.2f}", *(number(value, 3) for value in ours)])
    text = "Time to goal of the improved field\n" + aligned(lines, "<<>")
    lines = [["at one speed", *(f"{reading} [s]" for reading in readings)]]
    found: Mapping[str, Mapping[str, float]] = {
        reading: {one.name: one.time for one in fair_of(cases, reading)} for reading in readings
    }
    for name in dict.fromkeys(name for some in found.values() for name in some):
        lines.append([name, *(number(found[reading].get(name)) for reading in readings)])
    text += "\n\n" + aligned(lines, "<>")
    lines = [["scores", "printed", "computed"]]
    lines += [
        [f"VIII {path.name}", f"{path.score}", number(rows[f"VIII_{k + 1}_score"]["value"], 3)]
        for k, path in enumerate(PATHS)
    ]
    lines.append(["X relative [%]", f"{RELATIVE_PRINTED}", number(rows["X_relative"]["value"], 4)])
    return text + "\n\n" + aligned(lines, "<>") + "\n"
