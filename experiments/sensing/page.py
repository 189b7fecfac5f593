"""The page of the rows, as Markdown."""

from collections.abc import Sequence

from .config import SensingConfig
from .rows import BARS, Rows, definition, holds, number

INTRODUCTION = """# What the cell senses, against the exact geometry

Written by the program; do not edit.

```
{command}
```

`--config full` measures more seeds and faults; `--help` explains every option. Whole episodes of the closed loop are measured tick by
tick: each scene is set up as in a sweep, sensed through noisy images of two stationary cameras and one in the hand, and the arm
follows its plan beside each person. The exact distances are those of a geometry of the program's own in NumPy
(`experiments/sensing/truth.py`), with the arm's kinematics by C MuJoCo; the test compares them with those of `hrcjax.sim.outcome`.

This run: scenes {scenes}; seeds 0 to {last}; people {people}; {sensing} sensing. Distances to people are those of the arm
from the upper arm outwards, which the control points cover. Rows without a bar are for information. Research software, not
safety-rated.

## Rows

| row | measured | unit | bar | holds | what is measured |
|---|---|---|---|---|---|
"""


def command(config: SensingConfig) -> str:
    """The command line that the page names."""
    words = ["python -m experiments.sensing"]
    if config.config != SensingConfig.config:
        words.append(f"--config {config.config}")
    if config.quick:
        words.append("--quick")
    return " ".join([*words, "--json sensing.json --page docs/sensing.md"])


def page(rows: Rows, config: SensingConfig, figures: Sequence[str]) -> str:
    """The whole page."""
    people = ", ".join(name.split("/")[-1] for name in config.people)
    text = INTRODUCTION.format(
        command=command(config), scenes=", ".join(config.scenes), last=config.seeds - 1, people=people, sensing=config.sensing
    )  # fmt: skip
    lines = []
    for name, entry in rows.items():
        kept = holds(name, entry["value"])
        bar = f"{BARS[name][0]} {BARS[name][1]:g}" if name in BARS else "-"
        mark = "-" if kept is None else "yes" if kept else "**no**"
        lines.append(f"| {name} | {number(entry['value'])} | {entry['unit']} | {bar} | {mark} | {definition(name)} |")
    text += "\n".join(lines) + "\n"
    if figures:
        text += "\n## Figures of a run\n\n" + "\n".join(f"* {line}" for line in figures) + "\n"
    return text
