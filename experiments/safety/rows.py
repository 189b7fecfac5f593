"""The rows, from the stored cases: value, unit, definition and bar of each."""

import itertools
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.safety import ZONE_NAMES

from .config import MODES
from .contact_ratio import NEAR
from .limits import upper_limit
from .lost_time import lost_by_zone
from .variants import VARIANTS

Case = Mapping[str, NDArray]
Cases = Mapping[str, Case]
Rows = dict[str, dict[str, Any]]
COMPARE: dict[str, Callable[[float, float], bool]] = {"<": operator.lt, "<=": operator.le, ">=": operator.ge}
TOWARDS, SHORT = 0.005, 1e-3
"""As in `exposure`."""
BACK = 0.5
"""Two changes of the zone to and fro within this time are chatter [s]."""
MAIN = MODES[0]

BARS: dict[str, tuple[str, float]] = {
    "stop_margin_min": (">=", 0.0),
    "violations": ("<=", 0.0),
    "relative_score": (">=", 95.0),
    "relative_score_alone": (">=", 95.0),
    "path_deviation": ("<", 1e-9),
    "resume_acceleration": ("<=", 1.001),
    "resume_jerk": ("<=", 1.001),
    "chance_violations": ("<=", 0.0),
    "pfl_over_max_pfl": ("<=", 1.0),
    "pfl_over_max_pfl_reflected": ("<=", 1.0),
}
UNITS = {
    "zones": "", "off": "_off", "tool": "_tool", "contact_stop": "_contact_stop", "pfl": "_pfl",
    "pfl_reflected": "_pfl_reflected",
}  # fmt: skip
"""Variant -> ending of its rows."""
MEANT = {
    "zones": "",
    "off": ", without a safety layer",
    "tool": ", with the tool's distance alone",
    "contact_stop": ", stop before contact",
    "pfl": ", power and force limiting alone",
    "pfl_reflected": ", power and force limiting alone by the reflected mass",
}
_PER_VARIANT = {
    "violations": "episodes, in both ways to move, with a tick in which a point of the arm is faster towards the person than its largest distance within the reaction time allows by more than 5 mm/s, or could not stop before C; motions without jumps",
    "excess_speed_max": "largest speed of any point of the arm towards the person beyond what its largest distance within the reaction time allows; negative: never reached",
    "excess_now_max": "the same by the distance at that very tick, as if nothing were late",
    "stop_short_max": "largest lack of the way to stop: C less what is left when the approaching point brakes at that tick and the person comes on as fast as is assumed; negative: spare",
    "separation_min": "least exact distance of arm and person",
    "contacts": "episodes in which arm and person touch while the arm moves",
    "pfl_over_max": f"largest speed of a point of the arm nearer than {NEAR} m towards the nearest capsule of the person, over the contact speed of that region, by the mass that a contact there feels (MuJoCo's inertia and Jacobians, exact shapes at that tick); 0: never so near",
    "pfl_any_max": "the same over the contact speed of the most sensitive region, the face, whichever is met",
    "pfl_rule_max": "the same by the standard's mass, half of the arm and the payload",
    "pfl_near_time": f"mean time in which a point of the arm is nearer than {NEAR} m",
    "arrived_share": "share of episodes that arrive",
    "time_mean": "mean time to the goal; an episode that never arrives counts its whole duration",
    "score_mean": "mean of the Robotica paper's overall score",
    "score_sound_mean": "mean of the sound score, in which failing counts",
    "below_sp_mean": "mean time nearer to the person than S_p",
}
DEFINITIONS: dict[str, str] = {
    "states": "random states: distance, speeds of arm and person, latency and period of the images",
    "stop_margin_min": "least separation while the arm moves or comes to rest, less C + Z_d + Z_r, over random states; the person at most as fast as assumed at the first distance",
    "stop_margin_min_harsh": "the same beside a person who speeds up from 1.6 to 2 m/s within half a metre",
    "stop_margin_min_old": "the same if the monitor were told old distances instead of the distance from where the arm is now",
    "stop_margin_min_no_reaction": "the same with the reaction term dropped from the law: the test that it can fail",
    "worlds": "scenes x people x seeds; each is sensed once and played in six variants and two ways to move",
    "relative_score": f"the paper's overall score with zones in percent of that without, beside the same people, in mode {MAIN}: mean over mean",
    "relative_score_path": "the same in mode path, the paper's: only the clock reacts",
    "relative_score_alone": "the paper's own comparison: with zones beside people, in percent of without zones and without a person",
    "relative_score_arrived": "as relative_score, of the episodes that arrive both with and without zones",
    "relative_sound": "as relative_score, by the sound score",
    "productivity_lost": f"time that zones cost in mode {MAIN}, in percent of the time without: mean over mean, until arrival or end",
    "stops": "entries into a stop for each episode",
    "zone_changes": "changes of the zone a minute",
    "chatter": f"changes of the zone to and fro within {BACK} s, a minute",
    "glitch_episodes": "episodes beside recordings that jump: for fail-safe behaviour only",
    "glitch_stops": "entries into a stop for each of them",
    "glitch_chatter": "their changes of the zone to and fro, a minute",
    "glitch_excess_max": "their largest excess of speed, as excess_speed_max",
    "path_deviation": "mode path, double precision: largest distance of the commanded reference from an independent spline of the plan, beside people",
    "path_deviation_arm": "largest distance of the tool from the plan's curve, dynamics and governor included, beside people",
    "path_deviation_arm_alone": "the same without a person: what is not due to scaling",
    "resume_acceleration": "largest acceleration of the path clock over its limit",
    "resume_jerk": "largest jerk of the path clock while it speeds up, over its limit",
    "joint_acceleration": "largest joint acceleration over its limit",
    "chance_episodes": "episodes by chance",
    "chance_violations": "of them, those with a violation, as above",
    "chance_upper": "95 % upper limit of the share of such episodes (Clopper-Pearson)",
    "chance_violations_stop": "of them, those in which a point that approaches could not stop before C",
    "chance_violations_speed": "of them, those in which a point is faster than allowed by more than 5 mm/s",
    "chance_speed_in_stop": "of these, those whose worst tick is in a stop",
    "chance_excess_max": "largest excess of speed",
    "chance_violations_now": "episodes with an excess of more than 5 mm/s by the distance at the very tick, as if nothing were late",
    "chance_excess_now_max": "the largest such excess",
    "chance_violations_pose": "episodes with an excess of more than 5 mm/s by distance and direction of whichever pose of the person within the reaction time: what the arm can know",
    "chance_excess_pose_max": "the largest such excess",
    "chance_excess_p999": "99.9th percentile of the largest excess of an episode",
    "chance_stop_short_max": "largest lack of the way to stop; negative: spare",
    "chance_contacts": "episodes in which arm and person touch while a joint moves: also a person who walks into a retreating arm",
    "chance_contacts_approaching": "of them, those of chance_violations_stop: a point of the arm nearer than C goes towards the person by more than 5 mm/s at some tick",
    "chance_faster": "episodes in which an end of a capsule of the person is faster than 2 m/s",
    "chance_arrived_share": "share of episodes that arrive within their length",
    "chance_met_share": "share of episodes with a red zone or a stop",
    "chance_held_share": "share of episodes in which data were too old at some tick",
    "chance_per_s": "episodes a second, on the machine of this run, whatever else it does",
    "chance_hours_20000": "time that 20,000 would take",
    "no_retreat_episodes": "episodes by chance without the retreat of a stop (zone.retreat_speed 0)",
    "no_retreat_violations": "of them, those with a violation",
    "no_retreat_violations_pose": "of them, those by whichever pose within the reaction time, as chance_violations_pose",
    "no_retreat_excess_max": "their largest excess of speed",
    "ways_episodes": "episodes by chance in which people are read in directions 60 degrees apart alone, without those in front of a nearer surface",
    "ways_violations": "of them, those with a violation",
    "ways_violations_pose": "of them, those by whichever pose within the reaction time, as chance_violations_pose",
    "ways_excess_max": "their largest excess of speed",
}


def definition(name: str) -> str:
    """What a row measures."""
    if name in DEFINITIONS:
        return DEFINITIONS[name]
    for zone in ZONE_NAMES:
        if name == f"lost_{zone}":
            return f"part of it that is lost while the zone is {zone}; negative: won"
        if name == f"lost_{zone}_share":
            return "the same in percent of the time without zones"
    for variant, end in sorted(UNITS.items(), key=lambda item: -len(item[1])):
        base = name.removesuffix(end) if end else name
        if name.endswith(end) and base in _PER_VARIANT:
            return _PER_VARIANT[base] + MEANT[variant]
        if end and name.endswith(end) and base == "productivity_lost":
            return DEFINITIONS[base].replace("zones cost", "it costs") + MEANT[variant]
    return ""


def row(value: Any, unit: str = "1") -> dict[str, Any]:
    """One row."""
    return {"value": float(value), "unit": unit}


def bar(name: str) -> str:
    """The bar of a row; "": none."""
    return "{} {:g}".format(*BARS[name]) if name in BARS else ""


def holds(name: str, value: float) -> bool | None:
    """Whether a row holds its bar; None: it has none."""
    found = BARS.get(name)
    return None if found is None else COMPARE[found[0]](value, found[1])


def of(cases: Cases, group: str) -> list[Case]:
    """The cases of a group."""
    return [case for name, case in cases.items() if name.startswith(group + "/")]


def stop_rows(case: Case) -> Rows:
    """Random states."""
    rows = {"states": row(case["states"], "states")}
    for name in ("", "_harsh", "_old", "_no_reaction"):
        rows[f"stop_margin_min{name}"] = row(1e3 * float(case[f"margin{name}"]), "mm")
    return rows


def most(case: Case, name: str, k: int) -> float:
    """The largest value of a variant over the ticks that count."""
    return float(case[name][k][case["counts"][k]].max())


def broken(case: Case, k: int) -> bool:
    """Whether an episode has a violation."""
    return most(case, "excess", k) > TOWARDS or most(case, "short", k) > SHORT


def beside(cases: Cases, mode: str, clean: bool = True) -> list[Case]:
    """Episodes of a mode beside somebody."""
    return [c for c in of(cases, f"episode/{mode}") if str(c["person"]) != "nobody" and bool(c["clean"]) == clean]


def variant_rows(cases: Cases, dt: float) -> Rows:
    """Every variant."""
    rows: Rows = {}
    for k, variant in enumerate(VARIANTS):
        end = UNITS[variant]
        every = [case for mode in MODES for case in beside(cases, mode)]
        main = beside(cases, MAIN)
        rows |= {
            f"violations{end}": row(sum(broken(case, k) for case in every), f"of {len(every)} episodes"),
            f"excess_speed_max{end}": row(max(most(case, "excess", k) for case in every), "m/s"),
            f"excess_now_max{end}": row(max(most(case, "excess_now", k) for case in every), "m/s"),
            f"stop_short_max{end}": row(1e3 * max(most(case, "short", k) for case in every), "mm"),
            f"separation_min{end}": row(1e3 * min(float(c["separation"][k][c["counts"][k]].min()) for c in every), "mm"),
            f"contacts{end}": row(sum(bool(case["hit"][k]) for case in every), "episodes"),
            f"pfl_over_max{end}": row(max(most(case, "contact_ratio", k) for case in every)),
            f"pfl_any_max{end}": row(max(most(case, "contact_ratio_any", k) for case in every)),
            f"pfl_rule_max{end}": row(max(most(case, "contact_ratio_rule", k) for case in every)),
            f"pfl_near_time{end}": row(dt * np.mean([(c["separation"][k] < NEAR)[c["counts"][k]].sum() for c in every]), "s"),
            f"arrived_share{end}": row(np.mean([case["success"][k] for case in main])),
            f"time_mean{end}": row(np.mean([case["time_to_goal"][k] for case in main]), "s"),
            f"below_sp_mean{end}": row(np.mean([case["time_below_sp"][k] for case in main]), "s"),
            f"score_mean{end}": row(np.mean([case["score_overall"][k] for case in main])),
            f"score_sound_mean{end}": row(np.mean([case["score_sound"][k] for case in main])),
        }  # fmt: skip
    return rows


def _ratio(cases: Sequence[Case], name: str) -> float:
    zones, off = VARIANTS.index("zones"), VARIANTS.index("off")
    return 100 * float(np.mean([c[name][zones] for c in cases]) / np.mean([c[name][off] for c in cases]))


def score_rows(cases: Cases) -> Rows:
    """With zones in percent of without."""
    main, path = beside(cases, MAIN), beside(cases, "path")
    zones, off = VARIANTS.index("zones"), VARIANTS.index("off")
    rows = {
        "relative_score": row(_ratio(main, "score_overall"), "%"),
        "relative_sound": row(_ratio(main, "score_sound"), "%"),
        "relative_score_path": row(_ratio(path, "score_overall"), "%"),
    }
    there = [case for case in main if case["success"][zones] and case["success"][off]]
    if there:
        rows["relative_score_arrived"] = row(_ratio(there, "score_overall"), "%")
    alone = [case for case in of(cases, f"episode/{MAIN}") if str(case["person"]) == "nobody"]
    if alone:
        without = np.mean([case["score_overall"][off] for case in alone])
        rows["relative_score_alone"] = row(
            100 * np.mean([case["score_overall"][zones] for case in main]) / without, "%"
        )
    return rows


def zone_rows(cases: Cases, dt: float) -> Rows:
    """What zones cost, and how often they change."""
    main, off = beside(cases, MAIN), VARIANTS.index("off")
    rows: Rows = {}
    for k, variant in enumerate(VARIANTS):
        if variant == "off":
            continue
        parts = [lost_by_zone(case, k, off, dt) for case in main]
        lost, free = np.array([part[0] for part in parts]), np.array([part[1] for part in parts])
        total = 100 * lost.sum() / free.sum()
        rows[f"productivity_lost{UNITS[variant]}"] = row(total, "%")
        if variant == "zones":
            for number, zone in enumerate(ZONE_NAMES):
                rows[f"lost_{zone}"] = row(lost[:, number].mean(), "s an episode")
                rows[f"lost_{zone}_share"] = row(100 * lost[:, number].sum() / free.sum(), "%")
    rows |= _changes(main, dt, "")
    odd = beside(cases, MAIN, clean=False)
    if odd:
        rows["glitch_episodes"] = row(len(odd), "episodes")
        rows |= _changes(odd, dt, "glitch_")
        rows["glitch_excess_max"] = row(max(most(case, "excess", 0) for case in odd), "m/s")
    return rows


def _changes(cases: Sequence[Case], dt: float, begin: str) -> Rows:
    stops, changes, chatter, minutes = 0, 0, 0, 0.0
    for case in cases:
        zone = case["zone"][0][case["counts"][0]].astype(int)
        at = np.flatnonzero(np.diff(zone))
        stops += int(((zone[1:] == 3) & (zone[:-1] != 3)).sum()) + int(zone[0] == 3)
        changes += len(at)
        for first, second in itertools.pairwise(at):
            chatter += int((second - first) * dt < BACK and zone[second + 1] == zone[first])
        minutes += len(zone) * dt / 60
    rows = {f"{begin}stops": row(stops / len(cases), "an episode"), f"{begin}chatter": row(chatter / minutes, "1/min")}
    return rows if begin else rows | {"zone_changes": row(changes / minutes, "1/min")}


def path_rows(cases: Sequence[Case], acceleration: float, jerk: float) -> Rows:
    """Scaled speed on the path."""
    from .deviation import clock_motion

    motions = [clock_motion(case["travelled"], float(case["dt"])) for case in cases]
    return {
        "path_deviation": row(max(case["reference_off"].max() for case in cases), "m"),
        "path_deviation_arm": row(1e3 * max(case["tool_off"][:-1].max() for case in cases), "mm"),
        "path_deviation_arm_alone": row(1e3 * max(case["tool_off"][-1] for case in cases), "mm"),
        "resume_acceleration": row(max(a.max() for a, _ in motions) / acceleration, "of limit"),
        "resume_jerk": row(max(j.max() for _, j in motions) / jerk, "of limit"),
        "joint_acceleration": row(max(case["qdd_share"].max() for case in cases), "of limit"),
    }


def joined(cases: Sequence[Case], name: str) -> NDArray:
    """A value of all episodes of some parts."""
    return np.concatenate([np.atleast_1d(case[name]) for case in cases])


def chance_rows(cases: Sequence[Case], still: Sequence[Case], ways: Sequence[Case]) -> Rows:
    """Episodes by chance."""
    excess, short = joined(cases, "excess"), joined(cases, "short")
    fast, late = excess > TOWARDS, short > SHORT
    count, seconds = len(excess), float(sum(float(case["seconds"]) for case in cases))
    rows = {
        "chance_episodes": row(count, "episodes"),
        "chance_violations": row((fast | late).sum(), "episodes"),
        "chance_upper": row(upper_limit(int((fast | late).sum()), count)),
        "chance_violations_speed": row(fast.sum(), "episodes"),
        "chance_speed_in_stop": row((fast & (joined(cases, "worst_zone") == 3)).sum(), "episodes"),
        "chance_violations_stop": row(late.sum(), "episodes"),
        "chance_excess_max": row(excess.max(), "m/s"),
        "chance_violations_now": row((joined(cases, "excess_now") > TOWARDS).sum(), "episodes"),
        "chance_excess_now_max": row(joined(cases, "excess_now").max(), "m/s"),
        "chance_violations_pose": row((joined(cases, "excess_pose") > TOWARDS).sum(), "episodes"),
        "chance_excess_pose_max": row(joined(cases, "excess_pose").max(), "m/s"),
        "chance_excess_p999": row(np.percentile(excess, 99.9), "m/s"),
        "chance_stop_short_max": row(1e3 * short.max(), "mm"),
        "chance_contacts": row(joined(cases, "hit").sum(), "episodes"),
        "chance_contacts_approaching": row((joined(cases, "hit").astype(bool) & late).sum(), "episodes"),
        "chance_faster": row((joined(cases, "fastest") > 2.0).sum(), "episodes"),
        "chance_arrived_share": row(joined(cases, "arrived").mean()),
        "chance_met_share": row(joined(cases, "met").mean()),
        "chance_held_share": row(joined(cases, "held").mean()),
        "chance_per_s": row(count / seconds, "1/s"),
        "chance_hours_20000": row(20000 * seconds / count / 3600, "h"),
    }
    for name, part in (("no_retreat", still), ("ways", ways)):
        if part:
            over = joined(part, "excess")
            broken_ones = (over > TOWARDS) | (joined(part, "short") > SHORT)
            rows |= {
                f"{name}_episodes": row(len(over), "episodes"),
                f"{name}_violations": row(broken_ones.sum(), "episodes"),
                f"{name}_violations_pose": row((joined(part, "excess_pose") > TOWARDS).sum(), "episodes"),
                f"{name}_excess_max": row(over.max(), "m/s"),
            }
    return rows


def all_rows(cases: Cases, dt: float, acceleration: float, jerk: float) -> Rows:
    """All rows of a run."""
    rows: Rows = {}
    if "stop" in cases:
        rows |= stop_rows(cases["stop"])
    if beside(cases, MAIN):
        rows["worlds"] = row(len(of(cases, f"episode/{MAIN}")), "worlds")
        rows |= variant_rows(cases, dt) | score_rows(cases) | zone_rows(cases, dt)
    if of(cases, "path"):
        rows |= path_rows(of(cases, "path"), acceleration, jerk)
    if of(cases, "chance"):
        rows |= chance_rows(of(cases, "chance"), of(cases, "still"), of(cases, "ways"))
    return rows
