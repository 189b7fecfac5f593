"""The compiled programs of the map: one for each image size and cloud capacity."""

import time
from collections.abc import Callable, Hashable
from typing import Any

import jax

from hrcjax.lab.compiled import give_memory_back
from hrcjax.map import (
    FieldMap,
    FrameParams,
    FrameReport,
    MapLayout,
    MapParams,
    StreamParams,
    StreamState,
    admit_cloud,
    settle,
    take_cloud,
    take_frame,
)
from hrcjax.sense import Camera
from hrcjax.typing import Array, Bool, Float, Int, Joints, Matrix3, Vector3

from .exclusions import Exclusions


class Programs:
    """Functions of arrays, compiled at their first call."""

    def __init__(self, layout: MapLayout, exclusions: Exclusions | None = None) -> None:
        self.layout, self.exclusions = layout, exclusions or Exclusions()
        self.compiled: dict[Hashable, Any] = {}
        self.seconds = 0.0
        """Total compile time [s]."""

    def run(self, key: Hashable, function: Callable[..., Any], *args: Any, donate: tuple[int, ...] = ()) -> Any:
        """The function's results, when they are ready.

        Args:
            key: identifies function and shapes.
            donate: positions of arguments whose memory is reused.
        """
        if key not in self.compiled:
            begin = time.perf_counter()
            self.compiled[key] = jax.jit(function, donate_argnums=donate).lower(*args).compile()
            self.seconds += time.perf_counter() - begin
            give_memory_back()
        return jax.block_until_ready(self.compiled[key](*args))

    def image(
        self,
        state: FieldMap,
        stream: StreamState,
        params: FrameParams,
        stamp: Float[Array, ""],
        camera: Camera,
        depth: Float[Array, "height width"],
        q: Joints | None = None,
    ) -> tuple[FieldMap, StreamState, FrameReport, Int[Array, ""]]:
        """Fuses a depth image: `take_frame`.

        Args:
            q: joint positions of the robot [rad]; None: no robot in view.
        """

        def image(state: FieldMap, stream: StreamState, params: FrameParams, *frame: Any) -> Any:
            *seen, q = frame
            return take_frame(
                self.layout, params, state, stream, *seen, body=self.exclusions.body_at(q), box=self.exclusions.box
            )

        return self.run(("image", depth.shape), image, state, stream, params, stamp, camera, depth, q, donate=(0,))

    def admit_cloud(
        self,
        stream: StreamState,
        limits: StreamParams,
        stamp: Float[Array, ""],
        rotation: Matrix3,
        position: Vector3,
        q: Joints | None = None,
    ) -> tuple[StreamState, Int[Array, ""]]:
        """Plausibility check of a cloud: `admit_cloud`."""

        def admitted(limits: StreamParams, stream: StreamState, *frame: Any) -> Any:
            *pose, q = frame
            return admit_cloud(limits, stream, *pose, body=self.exclusions.body_at(q))

        return self.run("admit", admitted, limits, stream, stamp, rotation, position, q)

    def cloud(
        self,
        state: FieldMap,
        params: FrameParams,
        rotation: Matrix3,
        position: Vector3,
        cloud: Float[Array, "point 3"],
        mask: Bool[Array, "point"],
        gap: Float[Array, ""],
        through: Bool[Array, ""],
        tiles: int,
        q: Joints | None = None,
    ) -> tuple[FieldMap, FrameReport]:
        """Fuses one view of a cloud: `take_cloud`."""

        def look(state: FieldMap, params: FrameParams, *frame: Any) -> Any:
            rotation, position, cloud, mask, gap, through, q = frame
            body, box = self.exclusions.body_at(q), self.exclusions.box
            return take_cloud(
                self.layout, params, state, rotation, position, cloud, mask, gap, through, tiles, body, box
            )

        seen = (rotation, position, cloud, mask, gap, through)
        return self.run(("cloud", cloud.shape, tiles), look, state, params, *seen, q, donate=(0,))

    def settle(self, state: FieldMap, params: MapParams) -> FieldMap:
        """The map with all weights up to date."""

        def settled(state: FieldMap, params: MapParams) -> FieldMap:
            return settle(self.layout, params, state)

        return self.run("settle", settled, state, params, donate=(0,))
