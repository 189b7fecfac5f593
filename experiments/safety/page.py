"""The page of the rows, as Markdown."""

from collections.abc import Sequence

from hrcjax.safety import BODY_REGIONS, SafetyParams, effective_mass, pfl_speeds

from .config import PARTS, SafetyConfig
from .rows import Rows, bar, definition, holds
from .variants import EXPLAINED

INTRODUCTION = """# Safety beside people, measured

Written by the program; do not edit. Research software, not safety-rated.

```
{command}
```

`--help` explains every option. The text of ISO/TS 15066 and of ISO 10218 was not available: formulas and figures come from open literature
that quotes them.

* **A way to stop.** One point and one person on a line, integrated exactly, from random states, by the monitor of the cell. The person
  comes as fast as ISO 13855 assumes at the first distance (1.6 m/s from half a metre on, 2 m/s nearer), the images are as old as the
  reaction time covers, the point asks for the most and brakes at a = {brake:g} m/s^2. The test is `tests/safety/test_always_a_stop.py`. The whole arm
  is the business of the episodes.
* **Episodes.** {people} in {scenes}; sensed through noisy images of two cameras, once for all variants. Spheres along the axes
  of the arm's capsules from the upper arm outwards, at most 3 cm apart, tell distance and speed towards the exact person at every tick of 8 ms, until 1 s after the
  arrival. Allowed is v(d) by the largest distance of the point within the reaction time: what happened later it cannot know. Rows with `now` take the distance at the very tick. The variants:
{variants}
* **Scores.** The paper's score of a run is relative to itself (`hrcjax/metrics/score.py`), and one that never arrives may score higher; the
  sound score is beside it. Lost time is split by zone by the way along the path: its parts add up to the difference of the times.
* **The path.** Mode `path`, in double precision: the commanded reference against SciPy's spline of the plan, and the arm itself, whose
  deviation is the joint servo's.
* **By chance.** {episodes} episodes of 8 s: people of the list, turned, moved, faster or slower, earlier or later; the loop is the cell's, but
  images are not rendered: the field reads the exact capsules, moved by noise of 1 cm, less 3 cm, of up to three capsules at a point, by a rule as the cell's but for exact shapes;
  30 to 50 ms late, 3 % of the images missing, 2 % 0.2 s late, and up to two failures of all cameras of 0.05 to 1 s. People
  without measurement in a good image (`PERSON_LOST`) are not among the failures.
  The last numbers of the monitor were chosen on those of these very episodes, seeds from 0 on, in which it had failed before.
"""

READING = """
## Reading the rows

* **What a violation is.** A point of the arm goes towards the person, along the direction at that tick, faster than its largest distance within the
  reaction time allows. `..._now` takes the distance of the tick. `..._pose` is what the arm can know: distance and direction both of one pose of the
  person within the reaction time, the best for the whole arm. The difference are people who move across: a hand that goes by at 1.5 m/s is 8 cm
  beside where an image of 50 ms ago shows it, and a stopped arm that slides past its image then approaches it by some cm/s. A person who stands
  still has one pose: nothing is forgiven. The reader of the episodes by chance is better than the cell's: exact directions of capsules, where the
  cell has groups of points.
* **`ways_...`** are the same episodes with a part switched off: people are read in directions 60 degrees apart alone. A stopped arm then turns
  away from the trunk and towards a hand before it. Without the retreat (`no_retreat_...`) other points move in a stop too.
* **Directions.** A person who is 3 cm beside where the image shows them is seen 5 degrees off at 0.36 m, and 17 degrees at 0.1 m; one whose hand
  has gone on since, more. In red and in a stop limits therefore hold in all directions within an angle: by `safety.zone.aside`, and
  `safety.zone.across_speed` times the age of the image. Points nearer than S_p(0) go away by `safety.zone.turn_away`, if they move at all.
* **`chance_violations_stop`** counts approaches, along the direction at that tick, beside a person who has come to about C or nearer.
  Contacts are people who walk into the arm, but for `chance_contacts_approaching`.
* **Scores.** The paper's score has no term for a run that does not arrive, and rewards distance: with zones it may be above 100 %. Against its own
  reference, without zones and without a person, it is below. The sound score counts arrivals.
* **A person who speeds up** within half a metre, from 1.6 to 2 m/s, is not counted on by ISO 13855: `stop_margin_min_harsh` says how far C is
  missed; C, {C:g} m, is what keeps such a person from contact.
* **Stop before contact** and **power and force limiting** are measured by the cell's own speed and separation, which they do not promise to keep:
  their violations say how far they differ, not that they fail.
* **Contact speeds**: `pfl_over_max` and `pfl_any_max` judge every variant by the mass that a contact feels, `pfl_rule_max` by the standard's.
  What is met is not known to the monitor: it takes the most sensitive region, as `pfl_any_max` does, by directions as old as the image. Rotors behind gears are not in the inertia of the model; a real arm feels heavier.
"""


def command(config: SafetyConfig) -> str:
    """The command line that the page names."""
    words = ["python -m experiments.safety"]
    if config.config != SafetyConfig.config:
        words.append(f"--config {config.config}")
    if config.quick:
        words.append("--quick")
    if config.parts != PARTS and not config.quick:
        words.append(f"--parts {' '.join(config.parts)}")
    for option in ("scenes", "people"):
        if not config.quick and getattr(config, option) != getattr(SafetyConfig, option):
            words.append(f"--{option} {' '.join(getattr(config, option))}")
    for option in ("seeds", "states", "episodes"):
        if not config.quick and getattr(config, option) != getattr(SafetyConfig, option):
            words.append(f"--{option} {getattr(config, option)}")
    if config.recordings is not None:
        words.append(f"--recordings {config.recordings}")
    return " ".join([*words, "--json safety.json --page docs/safety.md"])


def number(value: float) -> str:
    """A value with four digits, large ones in full."""
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.4g}"


def regions(safety: SafetyParams) -> str:
    """The standard's table, as quoted, with the contact speed of the cell's arm."""
    speeds = pfl_speeds(1.0 / effective_mass(safety.pfl))
    lines = [
        f"| {r.name} | {r.force:g} | {r.transient * r.force:g} | {r.stiffness / 1e3:g} | {r.mass:g} | {r.energy:g} | {(r.force * r.transient) ** 2 / (2 * r.stiffness):.2f} | {float(v):.2f} |"
        for r, v in zip(BODY_REGIONS, speeds, strict=True)
    ]
    return f"""
## Power and force by region

ISO/TS 15066, tables A.2 and A.3, as quoted; in one place, `hrcjax/safety/pfl.py`. The energy F^2 / 2k agrees with the printed one within 8 %, but
for skull and face, which are printed with a factor 2 in force that their limit does not have. Pressures (table A.2) were not available and
are not used. The speed is that of a transient contact with the effective mass of the arm, {float(effective_mass(safety.pfl)):.2f} kg.

| region | quasi-static [N] | transient [N] | k [N/mm] | m_H [kg] | energy printed [J] | F^2 / 2k [J] | speed [m/s] |
|---|---|---|---|---|---|---|---|
""" + "\n".join(lines)


def page(
    rows: Rows,
    config: SafetyConfig,
    people: Sequence[str],
    figures: Sequence[str],
    safety: SafetyParams,
    counted: tuple[int, int] = (0, 0),
) -> str:
    """The whole page.

    Args:
        counted: cases that are finished, of those asked for.
    """
    names = ", ".join(name.split("/")[-1] for name in people)
    text = INTRODUCTION.format(
        command=command(config), brake=float(safety.ssm.brake), people=names, scenes=" and ".join(config.scenes),
        variants="\n".join(f"  - `{name}`: {words};" for name, words in EXPLAINED.items())[:-1] + ".", episodes=f"{config.episodes:,}",
    )  # fmt: skip
    if counted[0] < counted[1]:
        text += f"\n**Of a run that was interrupted: {counted[0]} of {counted[1]} parts are finished and counted.**\n"
    text += "\n## Rows\n\n| row | measured | unit | bar | holds | what is measured |\n|---|---|---|---|---|---|\n"
    for name, entry in rows.items():
        kept = holds(name, entry["value"])
        mark = "-" if kept is None else "yes" if kept else "**no**"
        text += f"| {name} | {number(entry['value'])} | {entry['unit']} | {bar(name) or '-'} | {mark} | {definition(name)} |\n"
    if rows:
        text += READING.format(C=float(safety.ssm.intrusion))
    text += regions(safety) + "\n"
    if figures:
        text += "\n## Figures of a run\n\n" + "\n".join(f"* {line}" for line in figures) + "\n"
    return text
