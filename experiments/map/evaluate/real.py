"""Five recorded RGB-D frames: distance of the points of one from the map of the others."""

import os
from functools import cache
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.io.recordings.frame import InputFrame
from hrcjax.io.recordings.open_input import open_input
from hrcjax.lab.errors import UsageError
from hrcjax.map import (
    FieldMap,
    FrameParams,
    FrameReport,
    Level,
    MapLayout,
    MapParams,
    admitted_view,
    empty_map,
    initial_stream,
    map_distance,
    take_frame,
)
from hrcjax.sense import Camera

from .accuracy import Measures
from .survey import number

FRAMES = (1, 2, 3, 4)
"""Frames with consistent poses, counted from 0; the pose of the first one is wrong."""
POINTS = 2048
"""Held-out points of each frame."""
MARGIN = 0.1
"""Margin of the box around the points [m]."""
HIDDEN = 0.1
"""A point farther than this behind the measured depth is occluded [m]."""
BLOCKS = 16_384
PARAMS = MapParams()


def recording() -> Path:
    """Folder of the frames: rgbd/ in $HRCJAX_DATA, or else in shared/data beside this project."""
    outside = os.environ.get("HRCJAX_DATA", Path(__file__).parents[3] / "shared" / "data")
    return Path(outside) / "rgbd"


@cache
def _programs(layout: MapLayout):
    def step(state: FieldMap, camera: Camera, depth: jax.Array) -> tuple[FieldMap, FrameReport]:
        stream = initial_stream(depth.dtype)  # all frames are accepted
        state, _, report, _ = take_frame(
            layout, FrameParams(PARAMS), state, stream, jnp.zeros((), depth.dtype), camera, depth
        )
        return state, report

    def zero(levels: tuple[Level, ...], x: jax.Array) -> jax.Array:
        return jax.lax.map(lambda x: map_distance(layout, levels, PARAMS.ratio, x), x, batch_size=64)

    return jax.jit(step, donate_argnums=0), jax.jit(zero)


def camera_of(frame: InputFrame) -> Camera:
    """The camera of a frame, in single precision."""
    assert frame.intrinsics is not None
    i = frame.intrinsics
    rotation, position = (jnp.asarray(v, jnp.float32) for v in (frame.rotation, frame.position))
    fx, fy, cx, cy = (jnp.asarray(v, jnp.float32) for v in (i.fx, i.fy, i.cx, i.cy))
    return Camera(rotation, position, fx, fy, cx, cy, i.width, i.height)


def points_of(frame: InputFrame) -> np.ndarray:
    """Pixels within the map's depth range, in the world (pixel, 3) [m]."""
    assert frame.intrinsics is not None and frame.depth is not None
    i, z = frame.intrinsics, frame.depth
    v, u = np.nonzero((z > number(PARAMS.near)) & (z < number(PARAMS.far)))
    z = z[v, u].astype(float)
    return np.stack([(u - i.cx) / i.fx * z, (v - i.cy) / i.fy * z, z], axis=1) @ frame.rotation.T + frame.position


def shown(frame: InputFrame, p: np.ndarray) -> np.ndarray:
    """Which points (point, 3) [m] the frame could have measured: in its image, with a measurement there, not occluded."""
    assert frame.intrinsics is not None and frame.depth is not None
    i = frame.intrinsics
    x, y, z = ((p - frame.position) @ frame.rotation).T
    safe = np.where(z > 0, z, 1.0)
    column, row = np.rint(x / safe * i.fx + i.cx), np.rint(y / safe * i.fy + i.cy)
    inside = (z > number(PARAMS.near)) & (column >= 0) & (column < i.width) & (row >= 0) & (row < i.height)
    depth = frame.depth[np.where(inside, row, 0).astype(int), np.where(inside, column, 0).astype(int)]
    return inside & (depth > 0) & (depth < number(PARAMS.far)) & (z < depth + HIDDEN)


def refusals(frames: list[InputFrame]) -> list[int]:
    """Result of the plausibility check of each frame: bits of `hrcjax.map.admit`, 0: accepted."""
    state, bits = initial_stream(), []
    for frame in frames:
        depth, stamp = jnp.asarray(frame.depth, jnp.float32), jnp.asarray(frame.stamp, jnp.float32)
        state, _, _, why = admitted_view(FrameParams(PARAMS), state, stamp, camera_of(frame), depth)
        bits.append(int(why))
    return bits


def leave_one_out() -> Measures | None:
    """Maps of three of the four frames, queried at those points of the fourth that one of the three could have measured.

    Returns:
        median and 90th percentile of the distances, the worst median of a frame [m], number of frames that the
        plausibility check refuses; None: the recording is not available.
    """
    try:
        everything = list(open_input(recording()))
    except UsageError:
        return None
    frames = [everything[k] for k in FRAMES]
    clouds = [points_of(frame) for frame in frames]
    low, high = (np.quantile(np.concatenate(clouds), q, axis=0) for q in (0.001, 0.999))
    edge = 4 * MapLayout().spacing
    x, y, z = (int(n) for n in np.ceil((high - low + 2 * MARGIN) / edge))
    a, b, c = (float(v) for v in low - MARGIN)
    layout = MapLayout(lower=(a, b, c), shape=(x, y, z), capacity=BLOCKS, seen=BLOCKS, born=BLOCKS, refitted=BLOCKS)
    step, zero = _programs(layout)
    found, medians = [], []
    for out in range(len(frames)):
        state = empty_map(layout)
        for k, frame in enumerate(frames):
            if k != out:
                state, _ = step(state, camera_of(frame), jnp.asarray(frame.depth, jnp.float32))
        known = np.any([shown(frame, clouds[out]) for k, frame in enumerate(frames) if k != out], axis=0)
        inside = np.all((clouds[out] > low) & (clouds[out] < high), axis=1)
        asked = np.random.default_rng(out).choice(clouds[out][known & inside], POINTS).astype(np.float32)
        distance = np.asarray(zero(state.levels, jnp.asarray(asked)))
        found.append(distance)
        medians.append(float(np.median(distance)))
    together = np.concatenate(found)
    return {
        "median": float(np.median(together)),
        "p90": float(np.percentile(together, 90)),
        "worst": max(medians),
        "refused": sum(bits != 0 for bits in refusals(everything)),
        "points": len(together),
    }
