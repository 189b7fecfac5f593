"""The page of the rows, as Markdown."""

from collections.abc import Mapping, Sequence

from .config import SECTIONS, AvoidanceConfig
from .rows import Rows, bar, definition, holds

INTRODUCTION = """# How the arm avoids, against the exact geometry

Written by the program; do not edit.

```
{command}
```

`--help` explains every option. Whole episodes of the closed loop are played with the default parameters and measured tick by tick
against the exact shapes, by a geometry in NumPy with the arm's kinematics by C MuJoCo (`hrcjax/reference/truth.py`). An episode ends 1 s after
the arrival. Rows without a bar are for information. Research software, not safety-rated.

* **Unknown obstacles.** Start and goal are those of the Robotica and of the HRI scene, each moved by up to 6 cm; one or two columns, boxes or
  balls of 2 to 6 cm radius stand within 5 cm of the straight line between them, at least 12 cm from start and goal and 6 cm from the
  arm at both. The planner is told of none; the cameras saw them at the set-up, with nobody in the cell. The same scenes are played with
  the policy's collision leaf and repulsion off, and besides with the governor's stop before surfaces off.
* **A hand in the way.** {people} in {scenes}, seeds 0 to {last}; in mode `both` policies may leave the path and return, in mode `path` only its clock reacts.
* **Retreat.** While the arm is stopped for closeness: a linear program in the joint speeds (at most 1 rad/s) tells whether the nearest control point can retreat while no point within
  1 m approaches the person and none within 3 cm of table or obstacles approaches these.
* **Derivatives** are those of `hrcjax.tune.episode_loss` in the default sweep's world by the logarithms of the knobs, in double
  precision and reverse mode, at settings drawn log-uniformly within the sweep's ranges.
"""


def command(config: AvoidanceConfig) -> str:
    """The command line that the page names."""
    words = ["python -m experiments.avoidance"]
    if config.config != AvoidanceConfig.config:
        words.append(f"--config {config.config}")
    if config.quick:
        words.append("--quick")
    if config.sections != SECTIONS:
        words.append(f"--sections {' '.join(config.sections)}")
    for option in ("obstacles", "seeds", "gradients"):
        if not config.quick and getattr(config, option) != getattr(AvoidanceConfig, option):
            words.append(f"--{option} {getattr(config, option)}")
    for option in ("scenes", "people"):
        if not config.quick and getattr(config, option) != getattr(AvoidanceConfig, option):
            words.append(f"--{option} {' '.join(getattr(config, option))}")
    if config.recordings is not None:
        words.append(f"--recordings {config.recordings}")
    return " ".join([*words, "--json avoidance.json --page docs/avoidance.md"])


def page(sections: Mapping[str, Rows], config: AvoidanceConfig, people: Sequence[str], figures: Sequence[str]) -> str:
    """The whole page."""
    names = ", ".join(name.split("/")[-1] for name in people)
    text = INTRODUCTION.format(
        command=command(config), people=names, scenes=" and ".join(config.scenes), last=config.seeds - 1
    )
    for section, rows in sections.items():
        text += (
            f"\n## {section}\n\n| row | measured | unit | bar | holds | what is measured |\n|---|---|---|---|---|---|\n"
        )
        for name, entry in rows.items():
            kept = holds(section, name, entry["value"])
            mark = "-" if kept is None else "yes" if kept else "**no**"
            text += f"| {name} | {entry['value']:.3g} | {entry['unit']} | {bar(section, name) or '-'} | {mark} | {definition(section, name)} |\n"
    if figures:
        text += "\n## Figures of a run\n\n" + "\n".join(f"* {line}" for line in figures) + "\n"
    return text
