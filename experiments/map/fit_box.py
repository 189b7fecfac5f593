"""Box, sizes and depth range of a map, chosen in a first pass over some frames of the recording."""

import dataclasses
from collections.abc import Callable, Iterable

import numpy as np

from hrcjax.io.recordings.frame import InputFrame
from hrcjax.lab.errors import UsageError
from hrcjax.lab.parameters import numbers_of
from hrcjax.map import MapLayout, MapParams
from hrcjax.map.layout import EDGE

from .choices import choose_layout
from .config import MapConfig
from .exclusions import Box

LOOKS = 60
"""The first frames are all used; of the next ones every second, then every fourth, and so on."""
STRIDE = 4
"""Stride of the pixels that are used."""
OUTLIERS = 0.002
"""Share of points that may lie outside the box on each side [1]."""
ROOM = 1.5
"""Capacity over the blocks that were observed: the other frames observe more [1]."""
NEARER, FARTHER = 0.005, 0.99
"""Quantiles of the measured depth that give `near` and `far` [1]."""
LEAST_NEAR, MOST_FAR = 0.05, 10.0
"""Limits of the chosen range [m]: farther, the noise of a depth camera exceeds any voxel."""
STEP = 0.1
"""Resolution of the chosen depths [m]."""
MOST_SEEN = 4096
"""Largest chosen `seen`: the time for a frame grows with it."""


def fit_depth(depths: np.ndarray, near: float, far: float) -> tuple[float, float]:
    """Depth range that covers the measurements of a recording, at least `near` to `far` [m].

    Args:
        depths: measured (n,) [m].
    """
    if not len(depths):
        return near, far
    least, most = np.quantile(depths, [NEARER, FARTHER])
    wide = min(float(np.ceil(most / STEP) * STEP), MOST_FAR)
    close = max(float(np.floor(least / LEAST_NEAR) * LEAST_NEAR), LEAST_NEAR)
    return min(near, close), max(far, wide)


def _local(frame: InputFrame) -> tuple[np.ndarray, np.ndarray]:
    """A subset of a frame's points in sensor axes (point, 3), and their depths (point,) [m]."""
    if frame.depth is None or frame.intrinsics is None:
        cloud = np.asarray(frame.cloud, np.float64)
        return cloud, np.abs(cloud).max(axis=1)
    z = frame.depth[::STRIDE, ::STRIDE].astype(np.float64)
    v, u = np.mgrid[0 : frame.depth.shape[0] : STRIDE, 0 : frame.depth.shape[1] : STRIDE]
    camera = frame.intrinsics
    local = np.stack([(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z], axis=-1)[z > 0]
    return local, local[:, 2]


class _Looked:
    """What the first pass observed: frames, depths, blocks."""

    def __init__(self, edge: float, box: Box | None) -> None:
        self.edge, self.box = edge, box
        self.depths: list[np.ndarray] = []
        self.frames: list[tuple[np.ndarray, np.ndarray]] = []
        """Points of each frame in the world (point, 3), and their depths; 0 where depth is not limited [m]."""
        self.clouds = False

    def add(self, frame: InputFrame, known: bool) -> None:
        local, depth = _local(frame)
        self.clouds = self.clouds or frame.cloud is not None
        matters = frame.depth is not None or known
        if matters:
            self.depths.append(depth[:: max(1, len(depth) // 5000)])
        points = local @ frame.rotation.T + frame.position
        inside = np.ones(len(points), bool)
        if self.box is not None:
            inside = ((points >= np.asarray(self.box.lower)) & (points <= np.asarray(self.box.upper))).all(axis=1)
        # one point of each block and depth is enough
        depth = depth if matters else np.zeros(len(points))
        cells = np.column_stack([np.floor(points / self.edge), np.floor(depth / STEP)])[inside]
        _, first, count = np.unique(cells, axis=0, return_index=True, return_counts=True)
        self.frames.append((np.column_stack([points[inside][first], count]), depth[inside][first]))


def fit_layout(
    config: MapConfig,
    frames: Iterable[InputFrame],
    params: MapParams,
    known: Callable[[InputFrame], bool],
    say: Callable[[str], None],
    box: Box | None = None,
) -> tuple[MapLayout, MapParams]:
    """A layout whose box contains the points of the frames, with capacity for their blocks; and the parameters, with the depth
    range of the measurements unless --param gives it.

    Args:
        known: whether the sensor position of a cloud is known.
        say: prints a line on what was chosen.
        box: crop box; points outside are ignored.

    Raises:
        UsageError: no frame has a point in range, or the box is too large.
    """
    edge, seen = config.spacing * EDGE, _look(config, frames, known, box)
    params = _with_depth(config, params, np.concatenate([*seen.depths, np.empty(0)]))
    limits = numbers_of(params)
    near, far = limits["near"], limits["far"]
    blocks, ends, counts = [], [], []
    for points, depth in seen.frames:
        points = points[(depth == 0) | ((depth > near) & (depth < far))]
        if len(points):
            ends.append(points[:, :3])
            counts.append(points[:, 3])
            blocks.append(np.unique(np.floor(points[:, :3] / edge).astype(np.int64), axis=0))
    if not ends:
        raise UsageError(
            f"{config.input}: no point between {near:g} and {far:g} m of the sensor to fit "
            f"the box to{' within --crop' if box is not None else ''}; give --per-metre if the depth is not in metres, "
            "another range by --param near=... far=..., or --lower and --shape"
        )
    low, high = _ends(np.concatenate(ends), np.concatenate(counts))
    first, last = np.floor(low / edge).astype(int) - 1, np.floor(high / edge).astype(int) + 1
    shape = [int(n) for n in last - first + 1]
    inside = [b[((b >= first) & (b <= last)).all(axis=1)] for b in blocks]
    everything = len(np.unique(np.concatenate(inside), axis=0))
    capacity = _power_of_two(ROOM * everything, 1024)
    layout = choose_layout(
        config,
        seen.clouds,
        lower=[float(v) for v in first * edge],
        shape=shape,
        capacity=capacity,
        seen=min(capacity, MOST_SEEN),
        born=_power_of_two(ROOM * max(map(len, inside)), 1024),
    )
    size = " x ".join(f"{n * edge:.1f}" for n in shape)
    corner = ", ".join(f"{v:.2f}" for v in layout.lower)
    say(
        f"fitted: a box of {size} m from ({corner}), capacity {layout.capacity} blocks, depth from {near:g} to {far:g} m"
    )
    return layout, params


def _look(
    config: MapConfig, frames: Iterable[InputFrame], known: Callable[[InputFrame], bool], box: Box | None
) -> _Looked:
    """Reads all frames of a short recording, and some of a long one."""
    found = _Looked(config.spacing * EDGE, box)
    every, looked = 1, 0
    for number, frame in enumerate(frames):
        if number % every:
            continue
        looked += 1
        if looked == LOOKS:
            every, looked = 2 * every, LOOKS // 2
        found.add(frame, known(frame))
    return found


def _with_depth(config: MapConfig, params: MapParams, depths: np.ndarray) -> MapParams:
    limits = numbers_of(params)
    near, far = fit_depth(depths, limits["near"], limits["far"])
    given = {text.partition("=")[0] for text in config.param}
    values = {name: value for name, value in (("near", near), ("far", far)) if name not in given}
    return dataclasses.replace(params, **values)


def _ends(points: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the box that contains all but OUTLIERS of the points (point, 3), weighted by `counts` (point,) [m]."""
    corners = []
    for axis in range(3):
        order = np.argsort(points[:, axis])
        share = np.cumsum(counts[order]) / counts.sum()
        at = np.searchsorted(share, [OUTLIERS, 1 - OUTLIERS])
        corners.append(points[order[np.minimum(at, len(order) - 1)], axis])
    low, high = np.array(corners).T
    return low, high


def _power_of_two(number: float, least: int) -> int:
    return max(least, 1 << max(int(np.ceil(number)) - 1, 0).bit_length())
