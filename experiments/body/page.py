"""The page of the rows, as Markdown."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hrcjax.cells.people import with_recordings

from .config import BodyConfig
from .loop_rows import definition as loop_definition
from .rows import ALL_BARS, definition, holds

HEAD = """# A person as a body: capsules fitted to the moving points

Written by `python -m experiments.body{asked} --recordings FOLDER --json FILE --page FILE`; do not edit. `--help` explains every option.

Two depth cameras of 15 Hz look in turn at the cell, with the noise, holes and flying pixels of a D435i. What contradicts the settled
picture is a person; the mean points of the voxels that one image shows are what the body is fitted to (`hrcjax/body`). The exact
capsules of the person are for the measures alone. Research software, not safety-rated. A cell uses the body where it is told to
(`Cell.body`, `--cell ur5-body`); by default the safety layer assumes the speed of a person, and the most sensitive body region.

* **Body**: eleven joints, and ten capsules whose ends are fixed mixtures of them: trunk, neck, head, upper arms, forearms, hands. Places of
  joints are what is fitted, not angles. Lengths of bones, limits of joints and how people stand are residuals; lengths and radii are
  unknowns with a memory, so that they are learnt over frames.
* **A frame**: prediction by constant velocity, six steps of Levenberg-Marquardt on the distances of points to the nearest capsule with
  Geman and McClure's weights, correction as Kalman's filter. The covariance is that of the normal equations. An arm whose points nobody
  explains is tried elsewhere, by these points and by its own. Where a track is young, or explains less than 90 % of the points, two other
  bodies are fitted beside it, from first guesses over three frames; then the better one by points and priors stays.
* **Left and right** are told by which way arms and trunk bend; a body that faces the other way for long is turned round. Shoulders that turn by over 7 rad/s are
  a fit that goes over to another body: the track's age begins anew.
* **Speeds** count where the track is older than 1 s, in which other bodies are still tried, explains 85 % of the points, and every part that may be the nearest is seen and
  known to 4 cm; elsewhere 1.6 m/s is assumed. The bound is the measured speed, 2.5 standard deviations, and 4 m/s^2 over the reaction time.
* **Deviations of speeds**: the filter is told accelerations and noise of points larger than they mostly are, so that it is quick; their
  ratio decides its gains, their size only what it tells of itself. How far frames really correct a joint, squared over the variance of
  that correction and averaged over 0.2 s, scales the variance of its speed: small where somebody stands, large where a movement begins.
  Of 0.1, 0.2 and 0.4 s the middle one was taken by the shares within 2 deviations of all these people. Errors of places stay from frame to frame, and are told as they were.
* **In the loop**, where the track is sure, every part of the body counts with its own speed towards each control point and with how much
  farther it is than what the distance field reads there: zones and limits follow S_p of these speeds, which may grow by 4 m/s^2 while the
  arm stops, and never need more than the assumed speed does. Parts that are not seen may come at 2 m/s. A surface that the field reads
  over 20 cm in front of the body is nobody's: it counts with the assumed speed, and so does every surface near which the image has a point
  over 10 cm from all of the body: somebody else's hand, or what the person holds. The field's bound is never exceeded; where the body is
  nearer, it counts. In red the contact speed is that of the regions that may be nearest, and under 0.5 m from the head the arm stops,
  by points that have their own rows towards the head (`hrcjax/safety/head.py`): the arm brakes before, so that it does not bring the stop about itself, and
  in the stop the points near the head go away from it. Measured zones are relaxed 2 cm beyond their thresholds, assumed ones 10 cm:
  the arm then stops for a shorter time, and more often (`stops_`), and other zones change more often too. v(d) bounds the arm in every zone, and is at most 0.08 m/s where a stop ends. The 2 cm were chosen among 5, 3, 2
  and 0 cm beside seven of these people with the seeds 10 to 12; `alike` is the arm without measured speeds with the same 2 cm: part of the gain is the hysteresis. (It always has them, the others only where they measure.) The age of 1 s was chosen
  with these people at seed 0, as younger tracks were wrong in up to eight images in a row.
  Without a sure track all is as without a body.
* **Episodes** (rows of the loop): the arm of the papers' cell in mode "both" beside the same people, in six variants of one program that
  share every image: `off`, `alike` (`off` with the hysteresis of measured zones), `speed` (measured speeds and regions), `head` (the stop near the head), `body` (all), and `still`, which is
  not safe: everybody counts as standing still, the most that measured speeds could bring. In the images the arm moves as a nominal one. All variants are measured alike, by exact shapes and the person's real speed.

People: {people}; {seconds:g} s each, {seeds}.
"""


def page(rows: Mapping[str, Mapping[str, Any]], config: BodyConfig, figures: Sequence[str] = ()) -> str:
    """A Markdown page of the rows.

    Args:
        figures: their places from the page.
    """
    seeds = f"seeds {config.seed} to {config.seed + config.seeds - 1}" if config.seeds > 1 else f"seed {config.seed}"
    asked = f" --seeds {config.seeds}" if config.seeds > 1 else ""
    people = ", ".join(Path(name).stem for name in with_recordings(config.people, config.recordings))
    lines = ["| row | value | unit | bar | what it measures |", "|---|---|---|---|---|"]
    for name, entry in rows.items():
        bar = f"{ALL_BARS[name][0]} {ALL_BARS[name][1]:g}" if name in ALL_BARS else ""
        missed = " (missed)" if holds(name, entry["value"]) is False else ""
        lines.append(
            f"| {name} | {entry['value']:.3g} | {entry['unit']} | {bar}{missed} | {loop_definition(name) or definition(name)} |"
        )
    text = HEAD.format(people=people, seconds=config.seconds, seeds=seeds, asked=asked) + "\n" + "\n".join(lines) + "\n"
    if figures:
        text += "\n" + "\n".join(f"![{name}]({name})" for name in figures) + "\n"
    return text
