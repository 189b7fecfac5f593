"""The map of a recording, frame by frame."""

import dataclasses
import time
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.io.recordings.frame import InputFrame
from hrcjax.map import (
    FieldMap,
    FrameParams,
    FrameReport,
    MapLayout,
    MapParams,
    StreamParams,
    StreamState,
    describe_frame,
    empty_map,
    initial_stream,
)
from hrcjax.sense import Camera

from .clouds import gap_of, look_from_afar, looks_at, places_for
from .exclusions import Exclusions
from .programs import Programs

COUNTS = tuple(field.name for field in dataclasses.fields(FrameReport))
"""Names of the counts of a frame."""
LAST = ("points", "blocks", "waiting")
"""Counts that describe the map's state: of the views of one cloud the last value is kept; the others are summed."""
ANY_SPEED = 1e9
"""No limit [m/s], [rad/s]."""
Pose = tuple[jax.Array, jax.Array]  # rotation (3, 3), position (3,) [m]


@dataclass(frozen=True)
class Taken:
    """Result of one frame."""

    stamp: float
    """Time since the first frame [s]."""
    camera: str
    refused: str
    """Why the frame was refused; "": it was used."""
    seconds: float
    """Time from the frame's arrays to the updated map, without compilation [s]."""
    counts: dict[str, int]
    """The fields of `FrameReport`."""


def _single(value: float | np.floating) -> jax.Array:
    return jnp.asarray(value, jnp.float32)


class Mapper:
    """Fuses frames into a map. Each camera has its own stream state; all share the map."""

    def __init__(
        self,
        layout: MapLayout,
        params: MapParams,
        limits: StreamParams,
        state: FieldMap | None = None,
        exclusions: Exclusions | None = None,
    ) -> None:
        self.layout = layout
        self.exclusions = exclusions or Exclusions()
        self.programs = Programs(layout, self.exclusions)
        self.params = jax.tree.map(_single, FrameParams(params, limits))
        self.untimed = dataclasses.replace(self.params, stream=jax.tree.map(_single, without_speeds(limits)))
        """Parameters for frames without recorded stamps."""
        self.state = empty_map(layout) if state is None else state
        self.streams: dict[str, StreamState] = {}
        self.first: float | None = None
        self.clouds: dict[str, tuple[int, float]] = {}
        """Capacity and point spacing of each camera's clouds."""

    def take(self, frame: InputFrame, known: bool = True, through: bool = True) -> Taken:
        """Fuses one frame.

        Args:
            known: whether the sensor position of the cloud is known; if not, there is no depth range.
            through: whether the cloud carves free space.
        """
        if self.first is None and np.isfinite(frame.stamp):
            self.first = frame.stamp
        # in double precision: single does not resolve a clock's seconds
        stamp = float(frame.stamp - (self.first or 0.0))
        begin, compiling = time.perf_counter(), self.programs.seconds
        if frame.depth is not None:
            reasons, counts = self._take_image(frame, stamp)
        else:
            reasons, counts = self._take_cloud(frame, stamp, known, through)
        seconds = time.perf_counter() - begin - (self.programs.seconds - compiling)
        return Taken(stamp, frame.camera, describe_frame(reasons) if reasons else "", seconds, counts)

    def _known_of(self, frame: InputFrame) -> tuple[FrameParams, StreamState, Pose, jax.Array | None]:
        """Parameters, stream state, pose and joint positions for a frame."""
        pose = jnp.asarray(frame.rotation, jnp.float32), jnp.asarray(frame.position, jnp.float32)
        stream = self.streams.get(frame.camera) or initial_stream()
        return self.params if frame.timed else self.untimed, stream, pose, self.exclusions.q_at(frame.stamp)

    def _take_image(self, frame: InputFrame, stamp: float) -> tuple[int, dict[str, int]]:
        assert frame.intrinsics is not None
        i = frame.intrinsics
        params, stream, pose, q = self._known_of(frame)
        fx, fy, cx, cy = (_single(v) for v in (i.fx, i.fy, i.cx, i.cy))
        camera = Camera(*pose, fx, fy, cx, cy, i.width, i.height)
        depth = jnp.asarray(frame.depth, jnp.float32)
        self.state, stream, report, reasons = self.programs.image(
            self.state, stream, params, _single(stamp), camera, depth, q
        )
        self.streams[frame.camera] = stream
        return int(reasons), _counts([report])

    def _take_cloud(self, frame: InputFrame, stamp: float, known: bool, through: bool) -> tuple[int, dict[str, int]]:
        assert frame.cloud is not None
        params, stream, pose, q = self._known_of(frame)
        stream, why = self.programs.admit_cloud(stream, params.stream, _single(stamp), *pose, q)
        self.streams[frame.camera] = stream
        if int(why):
            return int(why), dict.fromkeys(COUNTS, 0) | {"measured": len(frame.cloud)}
        places, gap = self.clouds.get(frame.camera) or (0, gap_of(frame.cloud))
        places = max(places, places_for(len(frame.cloud)))
        self.clouds[frame.camera] = (places, gap)
        if known:
            looks = looks_at(frame, places)
        else:
            look, depth = look_from_afar(frame, places)
            looks = [look]
            own = dataclasses.replace(params.map, near=_single(0.0), far=_single(depth), pixel_noise=_single(0.0))
            params = dataclasses.replace(params, map=own)
        reports, free = [], jnp.asarray(through and known)
        for look in looks:
            own = jnp.asarray(look.rotation, jnp.float32), jnp.asarray(look.position, jnp.float32)
            cloud = jnp.asarray(look.cloud), jnp.asarray(look.mask)
            self.state, report = self.programs.cloud(
                self.state, params, *own, *cloud, _single(gap), free, look.tiles, q
            )
            reports.append(report)
        return 0, _counts(reports)

    def settle(self) -> None:
        """Refits all blocks whose weights are out of date."""
        self.state = self.programs.settle(self.state, self.params.map)


def without_speeds(limits: StreamParams) -> StreamParams:
    """The limits for frames without recorded stamps: speeds are not checked."""
    return dataclasses.replace(limits, top_speed=ANY_SPEED, top_turn=ANY_SPEED)


def _counts(reports: list[FrameReport]) -> dict[str, int]:
    """The counts of a frame, from the reports of its views."""
    counts = {}
    for name in COUNTS:
        values = [int(getattr(report, name)) for report in reports]
        counts[name] = (values[-1] if name in LAST else sum(values)) if values else 0
    return counts
