"""The page of the tables, as Markdown, and what the terminal shows."""

from collections.abc import Mapping, Sequence

from hrcjax.lab.table import aligned

from .config import READINGS, ReproduceConfig
from .corrections import CORRECTIONS
from .fair import COMMON_SPEED
from .printed import PATHS, RELATIVE_PRINTED, TIMES
from .readings import EXPLAINED
from .rows import BARS, FITTING, Cases, Rows, fair_of, holds, our_times
from .score_tables import score_tables
from .time_tables import fair_tables, number, time_tables

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
    text += bars_table(rows) + time_tables(cases, rows, config.readings) + fair_tables(cases, rows, config.readings)
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
