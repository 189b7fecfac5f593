"""A run in a few lines, with what to change where something has found no place."""

from typing import Any

from hrcjax.lab.progress import duration


def summary_text(found: dict[str, Any], seconds: float) -> str:
    """The statistics in words.

    Args:
        found: what `statistics` returns.
        seconds: that the run took [s].
    """
    t, layout = found["totals"], found["layout"]
    lines = [f"WARNING: {text}" for text in found.get("warnings", ())]
    if mostly_refused(found):
        lines.append(f"WARNING: most frames were refused, {t['frames'] - t['used']:,} of {t['frames']:,}")
    lines.append(f"{t['used']:,} of {t['frames']:,} frames used, in {duration(seconds)}")
    for what, reasons in (("refused", t["refused"]), ("not read", t["not_read"])):
        if reasons:
            lines.append(f"  {what}: " + "; ".join(f"{times} x {reason}" for reason, times in reasons.items()))
    lines.append(
        f"Map: {t['points']:,} points ({t['points_static']:,} static, {t['points_new']:,} new, "
        f"{t['points_dynamic']:,} dynamic) in {t['blocks']:,} of {layout['capacity']:,} blocks"
    )
    lines.append(f"  in all frames: {t['new']:,} new, {t['dynamic']:,} seen through, {t['removed']:,} removed")
    if t["ms_median"] is not None:
        lines.append(
            f"Frame: median {t['ms_median']:.1f} ms, 95 % below {t['ms_p95']:.1f} ms; "
            f"reading it {t['read_ms_median']:.1f} ms; compilation {duration(t['compile_s'])}"
        )
    return "\n".join(lines + [f"note: {text}" for text in hints(found)])


def mostly_refused(found: dict[str, Any]) -> bool:
    """Whether less than half of the frames were used."""
    return 2 * found["totals"]["used"] < found["totals"]["frames"]


def nothing_taken(found: dict[str, Any]) -> str:
    """Why a run has taken nothing into its map, and which option helps; "": it has."""
    t, params = found["totals"], found["params"]
    if t["used"] and (t["points"] or t["new"]):
        return ""
    why = [f"{times} x {reason}" for reason, times in t["refused"].items()]
    if t["beyond"]:
        why.append(
            f"{t['beyond']:,} points nearer than {params['near']:g} m or farther than {params['far']:g} m: give --per-metre if "
            "depth is not in metres, or --param near=... far=..."
        )
    if t["outside"]:
        why.append(
            f"{t['outside']:,} points outside of the mapped box: give --fit, or another --lower and --shape, or --per-metre if "
            "they are not in metres"
        )
    if "crop" in found:
        why.append("what is outside of --crop does not count")
    text = "; ".join([*why, *(hints(found) if t["refused"] else ())]) or "no frame holds a surface"
    return f"nothing was taken into the map, and nothing is written ({text})"


def hints(found: dict[str, Any]) -> list[str]:
    """What is missing in the map, and which option helps."""
    t, layout, params = found["totals"], found["layout"], found["params"]
    texts = []
    if t["lost"]:
        full = t["blocks"] >= layout["capacity"]
        option = f"--capacity (now {layout['capacity']})" if full else f"--born (now {layout['born']})"
        texts.append(f"up to {t['most_lost']:,} blocks of a frame had no place: raise {option}, or --spacing")
    if t["unseen"]:
        option = f"--seen (now {layout['seen']})"
        texts.append(f"up to {t['most_unseen']:,} blocks in view of a frame were left as they are: raise {option}")
    counted = t["measured"] - t["beyond"]
    if t["outside"] > 0.01 * counted:
        share = 100 * t["outside"] / counted
        texts.append(
            f"{share:.0f} % of what was measured lies outside of the mapped box: give --fit, or another --lower and --shape"
        )
    if t["beyond"] > 0.05 * t["measured"]:
        share = 100 * t["beyond"] / t["measured"]
        texts.append(
            f"{share:.0f} % of what was measured is nearer than {params['near']:g} m or farther than {params['far']:g} m "
            f"and does not count: set --param near=... far=..."
        )
    if t.get("deferred"):
        texts.append(
            "frames saw through more points than one can remove; the others went later, or wait: take more frames"
        )
    if t.get("left_out"):
        texts.append("blocks in view held more points than one frame can be about; some were passed over: raise --seen")
    if t["waiting"]:
        texts.append(f"{t['waiting']:,} blocks wait to be fitted: their distances are rough")
    if any("leapt ahead" in reason for reason in t["refused"]):
        texts.append(
            "stamps were too far apart: if they are not in seconds, convert them; if the recording pauses, set --param "
            "longest_gap=..."
        )
    if any("too few pixels" in reason for reason in t["refused"]):
        texts.append(
            "frames had hardly any depth in the range of the sensor: if depth is not in metres give --per-metre, or set --param "
            "near=... far=..."
        )
    if any("pose leapt" in reason for reason in t["refused"]):
        texts.append(
            f"a camera that moves faster than {params['top_speed']:g} m/s or turns faster than {params['top_turn']:g} rad/s "
            "has leapt: if it did so, give the true --rate, or set --param top_speed=... top_turn=..."
        )
    return texts
