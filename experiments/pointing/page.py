"""The page of the rows, as Markdown."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from hrcjax.hand import PointingParams
from hrcjax.sense.finger_axis import FingerParams
from hrcjax.sim import PlaceParams

from .config import PointingConfig
from .posture import BEND
from .rows import BARS, Case, definition, holds
from .trials import KINDS, THICKNESS
from .watch import RATE, WATCHES, WORLD_ERROR

HEAD = """# Places chosen by pointing

Written by `python -m experiments.pointing{options} --json FILE --page FILE`; do not edit. `--help` explains every option.

{trials:.0f} trials in {scenes}, surveyed. People of capsules stand at the table and point, with a hand of 21 landmarks on a slim arm; two
noisy depth cameras of {rate:g} Hz see the hand from about 2 m, and a detector names its landmarks, {pixel:g} px wrong in a colour image, hidden ones
too; {shared:.0%} of that variance stays the same while the hand is held. Landmarks become points in space by the pixels and depths of both
cameras (`hrcjax/sense/landmark_points.py`). A line that stays for {dwell:g} s, and neither wanders faster than {drift:g} m/s nor turns faster than {turn:g} rad/s as far
as the noise lets one see, counts as held. A finger's line is then the likeliest by all depth pixels about it in the images of that time and by the landmarks
(`hrcjax/sense/finger_axis.py`): a pixel sees the finger within its outline, and something else outside (`hrcjax/sense/finger_pixels.py`). Each camera
is first asked alone whether it sees the finger at all; of one that does not, only landmarks count. An arm's line is that of its landmarks. Sphere tracing finds
where it meets a surface (`hrcjax/hand/pointing.py`). The table's top is in the map as any other surface: the survey does not crop it here.

The numbers of the method were chosen on trials of the seeds 11 to 14, by `--first`; those of this page begin at seed {first}.

| kind | what it is | trials |
|---|---|---|
{kinds}

That the hand makes the gesture is given, and so is that it holds still: it does not tremble. The arm of the robot is not in the images. What a
person *means* by a pointing finger is not measured: the true place is where the true line through the landmarks meets the exact shapes. The
hand of the kind `arm` is drawn along its arm; that of the others is not: its finger is turned against the line from the shoulder by chance (`arm_finger_angle_p50`),
so that the arm tells less of a finger than its own landmarks do, and is not used for it. How well a real person's finger and arm agree is not known here.
`world` is the line by the plain model in space of a detector, whose landmarks err by {world:.1%} of the palm's size (Zhang et al. 2020, *MediaPipe
Hands: On-device real-time hand tracking*), placed at the wrist's depth in one camera.

Arm and hand keep out of the rest of the body, the exact capsules of both, and the wrist bends by {bend:g} degrees at most
(`experiments/pointing/posture.py`); how far it bends sideways, and what other joints allow, is not asked.

A place is refused (`hrcjax/sim/chosen_place.py`) if nothing is met, if it is known worse than {unsure:g} m along the worst direction, if the arm does
not reach it with the tool down, {above:g} m above the surface along its normal, or if the tool has no room there.
"""


def options(config: PointingConfig) -> str:
    """The options that decide the results, as far as they are not the usual ones."""
    found = ""
    for name in ("kinds", "scenes", "seeds", "first", "trials", "pixel", "shared"):
        value = getattr(config, name)
        if value != getattr(PointingConfig(), name):
            found += f" --{name} {' '.join(value) if isinstance(value, tuple) else f'{value:g}'}"
    return found


def kind_table(by_kind: Mapping[str, Case]) -> str:
    """Every kind with its number of trials."""
    return "\n".join(f"| `{kind}` | {KINDS[kind]} | {len(case['way'])} |" for kind, case in by_kind.items())


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


def parts(rows: Mapping[str, Mapping[str, Any]]) -> str:
    """What the errors consist of."""
    return "".join(part(rows) for part in (_finger_parts, _tip_parts, _told_wrong, _coverage))


def _values(rows: Mapping[str, Mapping[str, Any]], *names: str) -> list[float] | None:
    return [rows[name]["value"] for name in names] if all(name in rows for name in names) else None


def _larger(landmarks: float, map_part: float) -> str:
    return "the landmarks" if landmarks >= map_part else "the map"


def _finger_parts(rows: Mapping[str, Mapping[str, Any]]) -> str:
    found = _values(rows, "ray_p50_1m", "ray_exact_p50_1m", "ray_true_p50_1m", "ray_across_p50_1m", "ray_world_p50_1m", "ray_angle_p50", "ray_marks_p50_1m", "bound_marks_p50_1m", "bound_depths_p50_1m")  # fmt: skip
    if found is None:
        return ""
    whole, landmarks, map_part, aside, world, angle, marks, bound, depths = found
    wide = _wide(rows)
    return f"""
## What the errors consist of

Of a finger, medians at 0.8 to 1.2 m: {whole:.1f} cm by line and map as they are found. The same line with the exact shapes errs by {landmarks:.1f} cm, the true
line with the map by {map_part:.1f} cm: most of it comes from {_larger(landmarks, map_part)}. The line acts by its angle, {angle:.1f} degrees: it passes the
true place at {aside:.1f} cm, and the slope of the surface stretches that. The plain model in space errs by {world:.1f} cm, where it meets anything.

A finger is 9 cm long, and four landmarks on it that err by some pixels turn it: by them alone the error is {marks:.1f} cm, and no unbiased estimate
from them could err by less than {bound:.1f} cm in the median. The depths of the pixels between base and tip, if nothing hid them, lower that to {depths:.1f} cm.
The finger's outline tells more, without a bound of this kind: of two straight borders cut by whole pixels each is known to a fraction of one. That
holds where both cameras see the finger; where one does not, the slope along the other's view is by depths, and where none does, by landmarks.
Two things make that look better than it would be. The simulated camera cuts the outline by whole pixels and draws the noise of each anew, where
a stereo camera matches windows of some pixels, which widens a finger of three pixels and makes neighbours err alike; and the simulated finger is
straight and round.{wide} Where nothing but landmarks can be trusted, `ray_marks_p50_1m` is what to expect.
"""


def _wide(rows: Mapping[str, Mapping[str, Any]]) -> str:
    found = _values(rows, "wide_p50_1m", "wide_angle_p50", "wide_coverage")
    if found is None:
        return ""
    error, angle, covered = found
    return f""" In images in which all that is near is wider by a pixel to each side (`wide`), curled fingers grow together with the one
that points, and the error is {error:.1f} cm, {angle:.1f} degrees; what is told then covers {covered:.0%} of the places: the fit knows that an outline
may be wider, by about a pixel (`swell_spread` in `finger_axis.py`, as in these images), and not that fingers grow together."""


def _tip_parts(rows: Mapping[str, Mapping[str, Any]]) -> str:
    found = _values(rows, "tip_p50", "tip_exact_p50", "tip_true_p50", "tip_landmark_p50")
    if found is None:
        return ""
    whole, landmarks, map_part, tip = found
    return f"""
Of a tip: {whole:.1f} cm; with the exact shapes {landmarks:.1f} cm, of the true tip by the map {map_part:.1f} cm, so that most comes from {_larger(landmarks, map_part)}. The tip
itself is {tip:.1f} cm off; what it is off along the surface's normal does not count. Places
are on sides that a stationary camera sees: of a side that none sees the map knows little. At edges and thin columns a map of points is farther from
the tip than the surface that it touches, and in another place. A finger that touches is half its thickness from the surface: what the map has
more or less counts as a standard deviation of the place, along every axis.
"""


def _told_wrong(rows: Mapping[str, Mapping[str, Any]]) -> str:
    names = ("p50_1m", "angle_p50", "coverage", "marks_share")
    found = [_values(rows, *(f"{kind}_{name}" for name in names)) for kind in ("thick", "thin", "noisy")]
    usual = _values(rows, "ray_p50_1m", "ray_angle_p50", "coverage_finger", "ray_marks_share")
    if usual is None or any(own is None for own in found):
        return ""
    thickness = (
        f"{100 * abs(THICKNESS[k] - 1):.0f} % {word}" for k, word in (("thick", "thicker"), ("thin", "thinner"))
    )
    kinds = zip(
        ("as told", *thickness, f"errors {WATCHES['noisy'].noise:g} times as large"), (usual, *found), strict=True
    )
    table = "\n".join(
        f"| {name} | {own[0]:.1f} cm | {own[1]:.2f} deg | {own[2]:.0%} | {own[3]:.0%} |" for name, own in kinds if own
    )
    return f"""
## Told wrong

The method is told how thick fingers are, {1000 * FingerParams().radius:g} +- {1000 * FingerParams().radius_spread:g} mm of radius, and how much landmarks and
depths err. The same fingers, otherwise than told; medians at 0.8 to 1.2 m, angles of all ways:

| fingers | error | angle | covered | by landmarks alone |
|---|---|---|---|---|
{table}

The radius is an unknown of the fit, so that a wrong one is found from the outline. Landmarks that err more than told would make a fit that is right
look as if it contradicted them; their limit is therefore taken from how badly they fit a finger of their own, where that is
worse than told, up to {FingerParams().worse:g} times their variance (`finger_axis.py`): the square of the factor here, so that this row says nothing of
larger errors. What is told of a place does not grow by it. Few trials are so near to 1 m that their median counts: smaller differences between kinds are chance.
"""


def _coverage(rows: Mapping[str, Mapping[str, Any]]) -> str:
    found = _values(
        rows, "coverage", "coverage_tip", "coverage_finger", "coverage_arm", "coverage_same", "ray_other_share"
    )
    if found is None:
        return ""
    whole, tip, finger, arm, same, other = (f"{x:.0%}" for x in found)
    return f"""
## What is told of places

Two standard deviations along the worst direction would cover 95 % of errors that are normal. They cover {whole} of all places, {tip} of tips,
{finger} of fingers, {arm} of arms, and {same} of those on the solid that was meant: {other} of the fingers' places lie on another.
Of tips, along the normal the surface's {100 * PointingParams().surface:g} cm count at least, and across it the gap between tip and map, as at an edge
nothing says in which direction the map is off.
"""


def page(
    rows: Mapping[str, Mapping[str, Any]], by_kind: Mapping[str, Case], config: PointingConfig, scenes: Sequence[str],
    figures: Sequence[str] = (),
) -> str:  # fmt: skip
    """A Markdown page of the rows.

    Args:
        scenes: their names and seeds.
        figures: their places from the page.
    """
    place = PlaceParams()
    text = HEAD.format(
        trials=rows["trials"]["value"], scenes=", ".join(scenes), options=options(config), rate=RATE, pixel=config.pixel, shared=config.shared, dwell=PointingParams().dwell,
        kinds=kind_table(by_kind), world=WORLD_ERROR, unsure=place.unsure, above=place.above,
        drift=PointingParams().drift, turn=PointingParams().turn, first=config.first, bend=BEND,
    )  # fmt: skip
    text += f"\n## Rows\n\n{row_table(rows)}\n{parts(rows)}"
    if figures:
        text += "\n## Figures\n\nTrue places and those found, joined, with ellipses of two standard deviations; errors by the way to the place.\n"
        text += "\n" + "\n\n".join(f"![{name}]({name})" for name in figures) + "\n"
    return text
