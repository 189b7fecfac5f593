"""Summary of a run, with the options to change where a capacity was exhausted."""

from typing import Any

from hrcjax.lab.progress import duration


def summary_text(found: dict[str, Any], seconds: float) -> str:
    """The statistics as text.

    Args:
        found: what `statistics` returns.
        seconds: duration of the run [s].
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
    lines.append(f"  over all frames: {t['new']:,} new, {t['dynamic']:,} in free space, {t['removed']:,} removed")
    if t["ms_median"] is not None:
        lines.append(
            f"Frame: median {t['ms_median']:.1f} ms, 95 % below {t['ms_p95']:.1f} ms; "
            f"reading {t['read_ms_median']:.1f} ms; compilation {duration(t['compile_s'])}"
        )
    return "\n".join(lines + [f"note: {text}" for text in hints(found)])


def mostly_refused(found: dict[str, Any]) -> bool:
    """Whether less than half of the frames were used."""
    return 2 * found["totals"]["used"] < found["totals"]["frames"]


def nothing_taken(found: dict[str, Any]) -> str:
    """Why the map of a run has no data, and which option helps; "": it has data."""
    t, params = found["totals"], found["params"]
    if t["used"] and (t["points"] or t["new"]):
        return ""
    why = [f"{times} x {reason}" for reason, times in t["refused"].items()]
    if t["beyond"]:
        why.append(
            f"{t['beyond']:,} points outside of the depth range {params['near']:g} to {params['far']:g} m: give --per-metre if "
            "depth is not in metres, or --param near=... far=..."
        )
    if t["outside"]:
        why.append(
            f"{t['outside']:,} points outside of the mapped box: give --fit, or another --lower and --shape, or --per-metre if "
            "they are not in metres"
        )
    if "crop" in found:
        why.append("points outside of --crop are ignored")
    text = "; ".join([*why, *(hints(found) if t["refused"] else ())]) or "no frame has a measured surface"
    return f"the map has no data, and no files are written ({text})"


def hints(found: dict[str, Any]) -> list[str]:
    """Where the map is incomplete, and which option helps."""
    t, layout, params = found["totals"], found["layout"], found["params"]
    texts = []
    if t["lost"]:
        full = t["blocks"] >= layout["capacity"]
        option = f"--capacity (now {layout['capacity']})" if full else f"--born (now {layout['born']})"
        texts.append(
            f"up to {t['most_lost']:,} blocks of a frame were dropped for lack of capacity: raise {option}, or --spacing"
        )
    if t["unseen"]:
        option = f"--seen (now {layout['seen']})"
        texts.append(f"up to {t['most_unseen']:,} blocks in view of a frame were not updated: raise {option}")
    counted = t["measured"] - t["beyond"]
    if t["outside"] > 0.01 * counted:
        share = 100 * t["outside"] / counted
        texts.append(
            f"{share:.0f} % of the measurements are outside of the mapped box: give --fit, or another --lower and --shape"
        )
    if t["beyond"] > 0.05 * t["measured"]:
        share = 100 * t["beyond"] / t["measured"]
        texts.append(
            f"{share:.0f} % of the measurements are outside of the depth range {params['near']:g} to {params['far']:g} m "
            f"and ignored: set --param near=... far=..."
        )
    if t.get("deferred"):
        texts.append(
            "some frames had more points in free space than one frame checks; the others are checked in later frames: use more frames"
        )
    if t.get("left_out"):
        texts.append("blocks in view held more points than one frame updates; some were not updated: raise --seen")
    if t["waiting"]:
        texts.append(f"{t['waiting']:,} blocks have weights that are out of date: their distances are approximate")
    if any("leapt ahead" in reason for reason in t["refused"]):
        texts.append(
            "stamps are too far apart: convert them if they are not in seconds; if the recording has pauses, set --param "
            "longest_gap=..."
        )
    if any("too few pixels" in reason for reason in t["refused"]):
        texts.append(
            "frames had hardly any depth in the depth range: if depth is not in metres give --per-metre, or set --param "
            "near=... far=..."
        )
    if any("pose leapt" in reason for reason in t["refused"]):
        texts.append(
            f"frames are refused where the camera moves faster than {params['top_speed']:g} m/s or turns faster than "
            f"{params['top_turn']:g} rad/s: if it did, give the true --rate, or set --param top_speed=... top_turn=..."
        )
    return texts
