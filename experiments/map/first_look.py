"""What the first frame tells before work begins: a depth that is in no metres, speeds without stamps."""

from collections.abc import Callable

import numpy as np

from hrcjax.io.recordings.frame import InputFrame
from hrcjax.lab.errors import UsageError

from .config import MapConfig

LEAST, MOST = 0.03, 50.0
"""Between these lies what a depth camera measures [m]."""
WIDE = 500.0
"""A cloud that reaches farther about its middle is taken for one in other units [m]."""
SPEEDS = ("top_speed", "top_turn")
"""Parameters that need stamps."""


def check_first(config: MapConfig, frame: InputFrame, say: Callable[[str], None]) -> None:
    """Refuses a recording whose first frame cannot be meant, and says what is doubtful.

    Raises:
        UsageError: depth that no depth camera measures, unless its unit is given; limits of speeds for frames without stamps.
    """
    speeds = [text for text in config.param if text.partition("=")[0] in SPEEDS]
    if speeds and not frame.timed:
        raise UsageError(f"--param {speeds[0]}: the recording has no stamps; give --rate, the frames a second, with it")
    text = doubtful_scale(frame)
    if text and config.per_metre is None:
        raise UsageError(
            f"{text}, with the scale above, or 1 per metre: accepted is the number of units per metre by --per-metre (1000: "
            "millimetres)"
        )
    if text:
        say(f"note: {text}: check --per-metre {config.per_metre:g}")


def doubtful_scale(frame: InputFrame) -> str:
    """What is odd about the depth of a frame; "": nothing."""
    if frame.depth is not None:
        depth = frame.depth[frame.depth > 0]
        low, high = np.quantile(depth, [0.05, 0.95]) if len(depth) else (1.0, 1.0)
        if low > MOST or high < LEAST:
            return f"depth from {low:.3g} to {high:.3g} m is what no depth camera measures"
        return ""
    assert frame.cloud is not None
    radius = np.abs(frame.cloud - np.median(frame.cloud, axis=0)).max(axis=1)
    half = float(np.median(radius))
    return f"half of the points lie more than {half:.0f} m about their middle" if half > WIDE else ""
