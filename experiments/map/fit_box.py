"""Box and sizes of a map, chosen by a first look at some frames of the recording."""

from collections.abc import Callable, Iterable, Mapping

import numpy as np

from hrcjax.io.recordings.frame import InputFrame
from hrcjax.lab.errors import UsageError
from hrcjax.lab.parameters import numbers_of
from hrcjax.map import MapLayout, MapParams
from hrcjax.map.layout import EDGE

from .choices import choose_layout
from .config import MapConfig
from .left_out import Box

LOOKS = 60
"""Frames that are looked at before only every second one of the rest is, then every fourth, and so on."""
STRIDE = 4
"""Pixels between those that are looked at."""
OUTLIERS = 0.002
"""Share of points that may lie outside on every side."""
ROOM = 1.5
"""Places for blocks over those that were seen: other frames see more."""
MOST_SEEN = 4096
"""Blocks that one frame can see, at most: a frame's cost follows it."""


def points_in_world(frame: InputFrame, limits: Mapping[str, float], known: bool) -> np.ndarray:
    """Some of a frame's points that would count, (point, 3) [m].

    Args:
        limits: of depth: near and far [m].
        known: the sensor's place is known, and with it how far the points are.
    """
    if frame.depth is not None and frame.intrinsics is not None:
        z = frame.depth[::STRIDE, ::STRIDE].astype(np.float64)
        v, u = np.mgrid[0 : frame.depth.shape[0] : STRIDE, 0 : frame.depth.shape[1] : STRIDE]
        camera = frame.intrinsics
        local = np.stack([(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z], axis=-1).reshape(-1, 3)
        far = local[:, 2]
    else:
        local = np.asarray(frame.cloud, np.float64)
        far = np.abs(local).max(axis=1)
    if frame.depth is not None or known:
        local = local[(far > limits["near"]) & (far < limits["far"])]
    return local @ frame.rotation.T + frame.position


def fit_layout(
    config: MapConfig,
    frames: Iterable[InputFrame],
    params: MapParams,
    known: Callable[[InputFrame], bool],
    say: Callable[[str], None],
    box: Box | None = None,
) -> MapLayout:
    """A layout about the points of the frames, with places for their blocks.

    Args:
        known: whether the place of a cloud's sensor is known.
        say: takes a line that tells what was chosen.
        box: points outside do not count.

    Raises:
        UsageError: no frame has a point that counts, or the box is too large.
    """
    edge, limits = config.spacing * EDGE, numbers_of(params)
    every, looked = 1, 0
    blocks: list[np.ndarray] = []
    ends: list[np.ndarray] = []
    clouds = False
    for number, frame in enumerate(frames):
        if number % every:
            continue
        looked += 1
        if looked == LOOKS:
            every, looked = 2 * every, LOOKS // 2
        clouds = clouds or frame.cloud is not None
        points = points_in_world(frame, limits, known(frame))
        if box is not None:
            inside = (points >= np.asarray(box.lower)) & (points <= np.asarray(box.upper))
            points = points[inside.all(axis=1)]
        if len(points):
            ends.append(points[:: max(1, len(points) // 20_000)])
            blocks.append(np.unique(np.floor(points / edge).astype(np.int64), axis=0))
    if not ends:
        near, far = limits["near"], limits["far"]
        raise UsageError(
            f"{config.input}: no point between {near:g} and {far:g} m of the sensor to fit "
            f"the box to{' within --crop' if box is not None else ''}; set other limits with --param near=... far=..., or give --lower and --shape"
        )
    low, high = (np.quantile(np.concatenate(ends), q, axis=0) for q in (OUTLIERS, 1 - OUTLIERS))
    first, last = np.floor(low / edge).astype(int) - 1, np.floor(high / edge).astype(int) + 1
    shape = [int(n) for n in last - first + 1]
    inside = [b[((b >= first) & (b <= last)).all(axis=1)] for b in blocks]
    everything = len(np.unique(np.concatenate(inside), axis=0))
    capacity = _power_of_two(ROOM * everything, 1024)
    layout = choose_layout(
        config,
        clouds,
        lower=[float(v) for v in first * edge],
        shape=shape,
        capacity=capacity,
        seen=min(capacity, MOST_SEEN),
        born=_power_of_two(ROOM * max(map(len, inside)), 1024),
    )
    size = " x ".join(f"{n * edge:.1f}" for n in shape)
    corner = ", ".join(f"{v:.2f}" for v in layout.lower)
    say(f"fitted: a box of {size} m from ({corner}), places for {layout.capacity} blocks")
    return layout


def _power_of_two(number: float, least: int) -> int:
    return max(least, 1 << max(int(np.ceil(number)) - 1, 0).bit_length())
