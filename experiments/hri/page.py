"""The page of the rows, as Markdown."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from .config import HriConfig
from .rows import BARRED, BARS, FIRST, PAIRED, RATIOS, UNITS, WORDS, Pair, definition, holds, stem_of
from .systems import EXPLAINED

HEAD = """# The HRI paper's experiment

Written by `python -m experiments.hri --recordings FOLDER --json FILE --page FILE`; do not edit. `--help` explains every option.

The tool, pointing down, goes to and fro between the paper's waypoints A = (0, 0.53, 0.25) m and B = (-0.53, 0.03, 0.25) m while a person's arm
enters: {people}. {pairs} pairs of {seconds:g} s. In a pair all systems get images of the same two cameras with the same noise, of the same
person, with the arm where it is; they move the same simulated arm at 125 Hz, and are measured by the exact truth. The paper
has one run of each of two systems.

{systems}
What the baseline is made of, and how each of its numbers was chosen: [hri-baseline.md](hri-baseline.md). An arrival is the tool within 2 cm of the
waypoint and slower than 5 cm/s, for all systems.
"""
READ = """
## How to read it

* **Mode both, not reactive.** The route to and fro is the reference of the policies. Its turns are part of it: the tool is at rest at a waypoint for a
  moment, its acceleration goes on. In mode reactive the goal jumps from one waypoint to the other at every arrival, and with it the acceleration asked for.
  The baseline, which plans leg by leg, comes to rest with no acceleration: a part of what ours are smoother is this.
* **How ours were set** (`numbers.py`): the pace so that the undisturbed cycle takes as long as the baseline's; softer leaves of the policy by ours_free beside
  `reach_in`, seed 0. The weaker damping of joints, joint limits and regularisation were chosen by the change of curvature of an undisturbed cycle, which
  is compared here, and looked at beside four other people of seed 0. The baseline was tuned beside `reach_in` and `reach_and_stay`, seeds 0 and 3. These pairs are in the table.
* **The safety layer is what is rough.** Where a zone tightens or a stop begins it cuts the speed within a tick or two, and beside a hand that stays
  it stops, retreats and is released, by directions that carry the noise of images. That is what `ours` has above `ours_free`, at 50 Hz by a factor of
  hundreds. The baseline under it is half as rough in jerk, as it stays on its path, and its curvature hardly changes. It also keeps the arm where it is slow when a hand comes, and a slow arm does not get out of the way of a hand.
* **Time and jerk trade** by a factor of a thousand (hri-baseline.md), and `trade.png` shows both: a ratio of jerks says something beside the ratio of times alone. A straight leg
  from rest to rest in the time T has a mean squared jerk of 720 L^2 / T^6 at least (Flash and Hogan 1985): 1.7 m^2/s^6 in the baseline's
  2.5 s. The baseline's free leg has 6; five times less than it is not to be had in its time by anyone who comes to rest with no
  acceleration at the waypoints.
* **The paper's form** is of 4 samples a second: it hardly sees what lasts less than 0.25 s. SI units are of 50 Hz and see noise that shakes the arm.
  Both are shown, with bars where the paper has its claim.
* **Curvature** of a tool slower than 0.1 m/s is left out: at a turn it is not defined. Change means |curvature(k + 1) - curvature(k)|.
  The baseline's free leg is straight in the joints: an arc about the base, whose curvature hardly changes. Ours plan the
  tool's straight line by the potential, and come out of the way of people in z. Some tenths of a millimetre count: at 0.1 m/s a
  curvature of 0.1 1/m is 0.06 mm between samples.
* **Three comparisons, one set of bars.** Ours slow and stop by speed and separation, the baseline by padding alone, so that the first rows compare an
  arm that keeps the standard's distance with one that passes people at some cm. `_free` is ours without that layer beside the same baseline, as in the paper,
  where neither system has one: policies against planning. `_guarded` is ours beside the baseline under the same layer (`baseline/guard.py`): the same
  monitor, field and limits, from the same images, slow its motions on their paths, before its joint servo; ours are bounded after all feedback. A
  motion of it that begins gets its pace as a path clock does, 0.2 s late. Where hardly anybody arrives, cycle times are those of the run's length, and
  their ratio says little. `_equal` is ours beside a baseline slowed to about our cycle time, and has no bars.
* **Who stands is smooth**: jerk of an arm that was stopped for half of the run is low, and its cycle long.
* **Recall** asks 33 configurations between the waypoints every 0.2 s, whether they are within 3 cm of what the system knows. Our field is a lower bound
  of the distance to people, so that it also says so of configurations farther away: `false_alarms`.
* **Recordings that jump** (a joint faster than 8 m/s) count apart in the contacts, as nobody moves like that; in all else they count.
"""


def paper_table(rows: Mapping[str, Mapping[str, Any]], systems: Sequence[str]) -> str:
    """Medians of the systems side by side, and the paper's figures."""
    printed = {
        "variance_x": ("2.30e-5", "3.08e-5"), "variance_y": ("3.07e-5", "5.47e-5"), "variance_z": ("1.03e-5", "4.13e-5"),
        "total_jerk": ("0.602", "0.832"), "msj": ("2.63e-5", "5.28e-5"), "curvature": ("0.302", "0.925"),
    }  # fmt: skip
    lines = ["| median | unit | " + " | ".join(systems) + " | paper: field and policies | paper: baseline |"]
    lines.append("|---" * (len(systems) + 4) + "|")
    for name, unit in UNITS.items():
        values = [_number(rows[f"{name}_{system}"]["value"]) for system in systems]
        lines.append(f"| {WORDS[name]} | {unit} | " + " | ".join(values) + " | " + " | ".join(printed.get(name, ("", ""))) + " |")  # fmt: skip
    for name in ("contacts", "contacts_jumping", "contacts_standing", "success", "recall", "false_alarms", "least_separation"):  # fmt: skip
        values = [_number(rows[f"{name}_{system}"]["value"]) for system in systems]
        lines.append(f"| {name} | {'m' if name == 'least_separation' else '1'} | " + " | ".join(values) + " | | |")
    return "\n".join(lines)


def _number(value: float) -> str:
    return "-" if isinstance(value, float) and math.isnan(value) else f"{value:.3g}"


def ratio_table(rows: Mapping[str, Mapping[str, Any]], systems: Sequence[str]) -> str:
    """Every ratio of pairs with its interval."""
    lines = ["| row | median of pairs | 95 % | bar | of |", "|---|---|---|---|---|"]
    ends = ["", *PAIRED]
    for end in ends:
        for stem in (*RATIOS, "clearance_difference", "cycle_time_ratio"):
            name = f"{stem}{end}"
            if name not in rows:
                continue
            value, low, high = (rows[f"{name}{part}"]["value"] for part in ("", "_low", "_high"))
            bar = _bar(name, value)
            words = PAIRED[end][2] if end else FIRST
            lines.append(f"| {name} | {_number(value)} | {_number(low)} to {_number(high)} | {bar} | {words} |")
        if (name := f"contacts{end}") in rows and end in BARRED:
            value = rows[name]["value"]
            lines.append(f"| {name} | {value:.0f} | | {_bar(name, value)} | {definition(name, systems)} |")
    return "\n".join(lines)


def _bar(name: str, value: float) -> str:
    kept = holds(name, value)
    return "" if kept is None else f"{BARS[stem_of(name)]}" + ("" if kept else " (missed)")


def pair_table(pairs: Sequence[Pair]) -> str:
    """Every pair of ours and the baseline."""
    lines = [
        "| person, seed | msj, paper's form | msj [m^2/s^6] | curvature change [1/m] | cycle time [s] | least separation [m] | contacts |",
        "|---|---|---|---|---|---|---|",
    ]
    for pair in pairs:
        a, b = pair.by["ours"], pair.by["baseline"]
        both = [
            f"{_number(getattr(a, m))} / {_number(getattr(b, m))}"
            for m in ("msj", "msj_si", "curvature", "cycle_time", "min_separation", "contacts")
        ]
        lines.append(f"| {pair.person}{'' if pair.clean else ' (jumps)'} | " + " | ".join(both) + " |")
    return "\n".join(lines)


def page(
    rows: Mapping[str, Mapping[str, Any]], pairs: Sequence[Pair], config: HriConfig, figures: Sequence[str] = ()
) -> str:
    """A Markdown page of the rows.

    Args:
        figures: their places from the page.
    """
    systems = config.systems
    names = sorted({pair.person.rsplit(" ", 1)[0] for pair in pairs})
    listed = "".join(f"* `{name}`: {EXPLAINED[name]}\n" for name in systems)
    text = HEAD.format(people=", ".join(names), pairs=len(pairs), seconds=config.seconds, systems=listed)
    if not pairs:
        return text + "\nNo pair is finished.\n"
    if config.finished:
        text += "\nThese are the pairs that an interrupted run had finished; the command without `--finished` computes the others.\n"
    if {"ours", "baseline"} <= set(systems):
        text += f"\n## Pairs\n\n{ratio_table(rows, systems)}\n"
    text += f"\n## Medians\n\n{paper_table(rows, systems)}\n{READ}"
    if {"ours", "baseline"} <= set(systems):
        text += f"\n## Every pair: ours / baseline\n\n{pair_table(pairs)}\n"
    if figures:
        text += "\n" + "\n\n".join(f"![{name}]({name})" for name in figures) + "\n"
    return text
