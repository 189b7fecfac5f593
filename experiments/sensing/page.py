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

* **Set-up.** A part of a surface counts as seen if a camera's ray reaches it, with the robot absent: of the stationary cameras, or of
  the one in the hand in any posture of the scan, within the range of depth. What is cropped because it lies close to the table does not
  count.
* **Distances to people** are compared at every tick with the arm where it is and the person where it was at the exposure of the image
  in use. What moves later is the business of the reaction time in the separation distance, and of `excess_speed_max`.
* **Speed.** Spheres along the axes of the arm's capsules, at most 3 cm apart; speed along the true direction by the arm's motion
  alone; allowed is v(d) with the speed of a person that is assumed at d.
* **Faults** last 0.4 s and begin 0.7 s apart or more while the person is nearer than 2 m, on one camera, on all at once, on the other
  camera, and so on; {moments} of each kind, beside people who pass by, then who reach in, then who stand and
  work. A fault must be named on
  each camera that has it. A person whom no camera measures need only be known as hidden (guarded, or a stop), and only if all
  cameras fail.
* **Hands**: capsules of 2 cm thickness and the person model's own, in watched free space 20 cm from obstacles and 30 cm from the arm, each
  in one image of one camera.
* **Time** of an image is measured on the machine of this run, whatever else it does.

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
        command=command(config), scenes=", ".join(config.scenes), last=config.seeds - 1, people=people, sensing=config.sensing,
        moments=config.moments
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
