"""The page of the rows, as Markdown."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from .bench import VARIANTS
from .config import InteractConfig
from .measures import Case
from .rows import BARS, definition, holds, touched

HEAD = """# Functions of an arm beside people

Written by `python -m experiments.interact --recordings FOLDER --json FILE --page FILE`; do not edit. `--help` explains every option.

Keep away, follow a hand, hand over, give way and resume: each a composition of the motion policy's leaves and a reference that never
jumps (`hrcjax/interact`). {runs:.0f} episodes of {seconds:g} s, those of `give_way` of {task_seconds:g} s, sensed by two depth cameras with noise and latency, with the arm where it is. The
hand is found in the sensed points; the exact shape of the person is for the measures alone. Every function is played beside itself switched
off.

| variant | what it is | runs |
|---|---|---|
{variants}

## Which distances are possible

The safety layer has the last word, whatever a function asks for (default numbers; distances between surfaces of the whole arm and the
person, as sensed, which is some 4 to 10 cm less than the exact one):

* nearer than **0.31 m** speed and separation stops the arm and makes it retreat, until the person is 0.1 m farther;
* nearer than **0.5 m** no point is faster than 0.25 m/s in any direction: a hand of 0.3 m/s cannot be followed there;
* from **0.5 m** on the arm may come at 0.33 m/s, from 1.07 m on at 1 m/s.

So following at 0.3 m/s needs some 0.9 m from the hand: other links and the rest of the person are nearer to each other than tool and
hand. An offer is made at 0.45 m: the person reaches for it. To hand a thing over at 5 cm, the monitor must be power and force limiting
(`hrcjax.interact.CONTACT_OR_SEPARATION`): towards people no point is faster than 0.14 m/s, the contact speed of the most sensitive region
(the face), and no distance stops the arm. A hand that comes towards the arm is not avoided then. Which monitor a task may have is for its
risk assessment to say; all this is research software.
"""


def variant_table(cases: Mapping[str, Mapping[str, Case]]) -> str:
    """Every variant with its number of runs."""
    return "\n".join(f"| `{name}` | {VARIANTS[name].text} | {len(runs)} |" for name, runs in cases.items())


def row_table(rows: Mapping[str, Mapping[str, Any]]) -> str:
    """All rows with bars."""
    lines = ["| row | value | unit | bar | what it measures |", "|---|---|---|---|---|"]
    for name, entry in rows.items():
        kept = holds(name, entry["value"])
        bar = "" if name not in BARS else f"{BARS[name][0]} {BARS[name][1]:g}" + ("" if kept else " (missed)")
        lines.append(f"| {name} | {_number(entry['value'])} | {entry['unit']} | {bar} | {definition(name)} |")
    return "\n".join(lines)


def _number(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.3g}"


def touch_table(cases: Mapping[str, Mapping[str, Case]]) -> str:
    """Least distances of runs in which arm and person touched."""
    lines = [f"| {name} | {person} | {touched(case)} | {case['separation_true'].min():.3f} |" for name, runs in cases.items() for person, case in runs.items() if touched(case)]  # fmt: skip
    if not lines:
        return "In no run did arm and person touch."
    return "\n".join(["| variant | person, seed | touches | least distance [m] |", "|---|---|---|---|", *lines])


def page(
    rows: Mapping[str, Mapping[str, Any]], cases: Mapping[str, Mapping[str, Case]], config: InteractConfig,
    figures: Sequence[str] = (),
) -> str:  # fmt: skip
    """A Markdown page of the rows.

    Args:
        figures: their places from the page.
    """
    text = HEAD.format(
        runs=rows["runs"]["value"],
        seconds=config.seconds,
        task_seconds=config.task_seconds,
        variants=variant_table(cases),
    )
    text += f"\n## Rows\n\n{row_table(rows)}\n\n## Touches\n\n{touch_table(cases)}\n"
    if figures:
        text += "\n## Figures\n\nThe first person of every variant. Bands: zones of the safety layer, on above off.\n"
        text += "\n" + "\n\n".join(f"![{name}]({name})" for name in figures) + "\n"
    return text
