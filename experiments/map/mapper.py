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
from .left_out import LeftOut
from .programs import Programs

COUNTS = tuple(field.name for field in dataclasses.fields(FrameReport))
"""What is known of a frame, by name."""
LAST = ("points", "blocks", "waiting")
"""Those that tell a state: of several looks at one frame the last holds. Of the others it is the sum."""
ANY_SPEED = 1e9
"""A limit that no camera reaches [m/s], [rad/s]."""
Pose = tuple[jax.Array, jax.Array]  # rotation (3, 3), position (3,) [m]


@dataclass(frozen=True)
class Taken:
    """What became of one frame."""

    stamp: float
    """Since the first frame [s]."""
    camera: str
    refused: str
    """Why it changed nothing; "": it was used."""
    seconds: float
    """From its arrays to the updated map, without compilation [s]."""
    counts: dict[str, int]
    """The fields of `FrameReport`."""


def _single(value: float | np.floating) -> jax.Array:
    return jnp.asarray(value, jnp.float32)


class Mapper:
    """Takes frames into a map. One stream for each camera; all of them see the same map."""

    def __init__(
        self,
        layout: MapLayout,
        params: MapParams,
        limits: StreamParams,
        state: FieldMap | None = None,
        left_out: LeftOut | None = None,
    ) -> None:
        self.layout = layout
        self.left_out = left_out or LeftOut()
        self.programs = Programs(layout, self.left_out)
        self.params = jax.tree.map(_single, FrameParams(params, limits))
        self.untimed = dataclasses.replace(self.params, stream=jax.tree.map(_single, without_speeds(limits)))
        """For frames whose stamps were not recorded."""
        self.state = empty_map(layout) if state is None else state
        self.streams: dict[str, StreamState] = {}
        self.first: float | None = None
        self.clouds: dict[str, tuple[int, float]] = {}
        """Places and gap of each camera's clouds."""

    def take(self, frame: InputFrame, known: bool = True, through: bool = True) -> Taken:
        """Takes one frame.

        Args:
            known: False: where the sensor of the cloud stood is not known; its points count, however far.
            through: False: nothing is seen through by the cloud.
        """
        if self.first is None and np.isfinite(frame.stamp):
            self.first = frame.stamp
        # in double precision: single has no place for a clock's seconds
        stamp = float(frame.stamp - (self.first or 0.0))
        begin, compiling = time.perf_counter(), self.programs.seconds
        if frame.depth is not None:
            reasons, counts = self._take_image(frame, stamp)
        else:
            reasons, counts = self._take_cloud(frame, stamp, known, through)
        seconds = time.perf_counter() - begin - (self.programs.seconds - compiling)
        return Taken(stamp, frame.camera, describe_frame(reasons) if reasons else "", seconds, counts)

    def _known_of(self, frame: InputFrame) -> tuple[FrameParams, StreamState, Pose, jax.Array | None]:
        """Parameters, stream, pose and robot of a frame."""
        pose = jnp.asarray(frame.rotation, jnp.float32), jnp.asarray(frame.position, jnp.float32)
        stream = self.streams.get(frame.camera) or initial_stream()
        return self.params if frame.timed else self.untimed, stream, pose, self.left_out.q_at(frame.stamp)

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
        """Fits the blocks that wait."""
        self.state = self.programs.settle(self.state, self.params.map)


def without_speeds(limits: StreamParams) -> StreamParams:
    """The limits of frames whose stamps were not recorded: no speed follows from them."""
    return dataclasses.replace(limits, top_speed=ANY_SPEED, top_turn=ANY_SPEED)


def _counts(reports: list[FrameReport]) -> dict[str, int]:
    """The numbers of a frame, from its looks."""
    counts = {}
    for name in COUNTS:
        values = [int(getattr(report, name)) for report in reports]
        counts[name] = (values[-1] if name in LAST else sum(values)) if values else 0
    return counts
