"""The map of a recording, frame by frame."""

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.io.recordings.frame import InputFrame
from hrcjax.map import (
    FieldMap,
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

from .clouds import Look, gap_of, look_from_afar, looks_at, places_for
from .left_out import LeftOut
from .programs import Programs

COUNTS = tuple(field.name for field in dataclasses.fields(FrameReport))
"""What is known of a frame, by name."""
LAST = ("points", "blocks", "waiting")
"""Those that tell a state: of several looks at one frame the last holds. Of the others it is the sum."""


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
    tiles: int
    """Tiles of the image with a surface, or points of the cloud."""
    beyond: int
    """Of them those nearer or farther than the limits of depth."""
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
        self.params = jax.tree.map(_single, params)
        self.limits = jax.tree.map(_single, limits)
        self.state = empty_map(layout) if state is None else state
        self.streams: dict[str, StreamState] = {}
        self.first: float | None = None
        self.clouds: dict[str, tuple[int, float]] = {}
        """Places and gap of each camera's clouds."""
        self._see_nothing: Callable[[], FieldMap] | None = None
        """The program of the last frame, with a frame that sees nothing."""

    def take(self, frame: InputFrame, known: bool = True, through: bool = True) -> Taken:
        """Takes one frame.

        Args:
            known: False: where the sensor of the cloud stood is not known; its points count, however far.
            through: False: nothing is seen through by the cloud.
        """
        if self.first is None and np.isfinite(frame.stamp):
            self.first = frame.stamp
        stamp = float(
            frame.stamp - (self.first or 0.0)
        )  # in double precision: single has no place for a clock's seconds
        begin, compiling = time.perf_counter(), self.programs.seconds
        take = self._take_image if frame.depth is not None else self._take_cloud
        reasons, tiles, beyond, counts = take(frame, stamp, known, through)
        seconds = time.perf_counter() - begin - (self.programs.seconds - compiling)
        refused = describe_frame(reasons) if reasons else ""
        return Taken(stamp, frame.camera, refused, seconds, tiles, beyond, counts)

    def _stream(self, name: str) -> StreamState:
        return self.streams.get(name) or initial_stream()

    def _take_image(
        self, frame: InputFrame, stamp: float, known: bool, through: bool
    ) -> tuple[int, int, int, dict[str, int]]:
        assert frame.intrinsics is not None
        i = frame.intrinsics
        rotation, position = jnp.asarray(frame.rotation, jnp.float32), jnp.asarray(frame.position, jnp.float32)
        fx, fy, cx, cy = (_single(v) for v in (i.fx, i.fy, i.cx, i.cy))
        camera = Camera(rotation, position, fx, fy, cx, cy, i.width, i.height)
        depth, before = jnp.asarray(frame.depth, jnp.float32), self._stream(frame.camera)
        q = self.left_out.q_at(frame.stamp)

        def look(depth: jax.Array) -> Any:
            return self.programs.image(self.state, before, self.params, self.limits, _single(stamp), camera, depth, q)

        self.state, stream, report, reasons, tiles, beyond = look(depth)
        self.streams[frame.camera] = stream
        self._see_nothing = lambda: look(jnp.zeros_like(depth))[0]
        return int(reasons), int(tiles), int(beyond), _counts([report])

    def _take_cloud(
        self, frame: InputFrame, stamp: float, known: bool, through: bool
    ) -> tuple[int, int, int, dict[str, int]]:
        assert frame.cloud is not None
        rotation, position = jnp.asarray(frame.rotation, jnp.float32), jnp.asarray(frame.position, jnp.float32)
        one = _single(1.0)
        pose = Camera(rotation, position, one, one, one, one, 1, 1)
        q = self.left_out.q_at(frame.stamp)
        stream, why = self.programs.admit_cloud(self._stream(frame.camera), self.limits, _single(stamp), pose, q)
        self.streams[frame.camera] = stream
        if int(why):
            return int(why), len(frame.cloud), 0, dict.fromkeys(COUNTS, 0)
        places, gap = self.clouds.get(frame.camera) or (0, gap_of(frame.cloud))
        places = max(places, places_for(len(frame.cloud)))
        self.clouds[frame.camera] = (places, gap)
        params = self.params
        if known:
            looks = looks_at(frame, places)
        else:
            look, depth = look_from_afar(frame, places)
            looks = [look]
            params = dataclasses.replace(params, near=_single(0.0), far=_single(depth), pixel_noise=_single(0.0))
        reports, tiles, beyond = [], 0, 0

        def see(look: Look, mask: np.ndarray) -> Any:
            pose = jnp.asarray(look.rotation, jnp.float32), jnp.asarray(look.position, jnp.float32)
            cloud = jnp.asarray(look.cloud), jnp.asarray(mask)
            free = jnp.asarray(through and known)
            return self.programs.cloud(self.state, params, *pose, *cloud, _single(gap), free, look.tiles, q)

        for look in looks:
            self.state, report, some, ignored = see(look, look.mask)
            self._see_nothing = lambda look=look: see(look, np.zeros_like(look.mask))[0]
            reports.append(report)
            tiles, beyond = tiles + int(some), beyond + int(ignored)
        return 0, tiles, beyond, _counts(reports)

    def settle(self) -> int:
        """Fits the blocks that wait; returns how many are left, 0 unless fitting them makes no headway."""
        waiting = self.waiting()
        while waiting and self._see_nothing is not None:
            self.state = self._see_nothing()
            before, waiting = waiting, self.waiting()
            if waiting >= before:
                break
        return waiting

    def waiting(self) -> int:
        """Blocks of all levels whose weights wait to be fitted."""
        return sum(int(np.sum(np.asarray(stale))) for stale in self.state.stale)


def _counts(reports: list[FrameReport]) -> dict[str, int]:
    """The numbers of a frame, from its looks."""
    counts = {}
    for name in COUNTS:
        values = [int(getattr(report, name)) for report in reports]
        counts[name] = (values[-1] if name in LAST else sum(values)) if values else 0
    return counts
