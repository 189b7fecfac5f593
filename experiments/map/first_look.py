"""Checks on the first frame, before mapping begins: the unit of depth, stamps."""

from collections.abc import Callable

import numpy as np

from hrcjax.io.recordings.frame import InputFrame
from hrcjax.lab.errors import UsageError

from .config import MapConfig

LEAST, MOST = 0.03, 50.0
"""Plausible range of a depth camera [m]."""
WIDE = 500.0
"""A cloud larger than this is taken to be in other units [m]."""
SPEEDS = ("top_speed", "top_turn")
"""Parameters that need stamps."""


def check_first(config: MapConfig, frame: InputFrame, say: Callable[[str], None]) -> None:
    """Refuses a recording whose first frame has an implausible depth; warns where the unit was given.

    Raises:
        UsageError: depth outside the range of depth cameras, unless its unit is given; speed limits for frames without stamps.
    """
    speeds = [text for text in config.param if text.partition("=")[0] in SPEEDS]
    if speeds and not frame.timed:
        raise UsageError(f"--param {speeds[0]}: the recording has no stamps, so speeds need --rate")
    text = doubtful_scale(frame)
    if text and config.per_metre is None:
        raise UsageError(
            f"{text}, with the scale above, or 1 per metre: accepted is the number of units per metre by --per-metre (1000: "
            "millimetres)"
        )
    if text:
        say(f"note: {text}: check --per-metre {config.per_metre:g}")


def doubtful_scale(frame: InputFrame) -> str:
    """What is implausible about the depth of a frame; "": nothing."""
    if frame.depth is not None:
        depth = frame.depth[frame.depth > 0]
        low, high = np.quantile(depth, [0.05, 0.95]) if len(depth) else (1.0, 1.0)
        if low > MOST or high < LEAST:
            return f"depth from {low:.3g} to {high:.3g} m is outside the range of depth cameras"
        return ""
    assert frame.cloud is not None
    radius = np.abs(frame.cloud - np.median(frame.cloud, axis=0)).max(axis=1)
    half = float(np.median(radius))
    return f"half of the points are more than {half:.0f} m from their centre" if half > WIDE else ""
