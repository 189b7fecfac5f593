"""The compiled programs of the map: one for each size of image, and of cloud."""

import time
from collections.abc import Callable, Hashable
from typing import Any

import jax

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

from .left_out import LeftOut


class Programs:
    """Functions of arrays alone, compiled when they are first asked for."""

    def __init__(self, layout: MapLayout, left_out: LeftOut | None = None) -> None:
        self.layout, self.left_out = layout, left_out or LeftOut()
        self.compiled: dict[Hashable, Any] = {}
        self.seconds = 0.0
        """Time spent on compiling [s]."""

    def run(self, key: Hashable, function: Callable[..., Any], *args: Any, donate: tuple[int, ...] = ()) -> Any:
        """The function's results; waits for them.

        Args:
            key: names function and shapes.
            donate: positions of arguments that are not used again.
        """
        if key not in self.compiled:
            begin = time.perf_counter()
            self.compiled[key] = jax.jit(function, donate_argnums=donate).lower(*args).compile()
            self.seconds += time.perf_counter() - begin
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
        """A depth image into the map: `take_frame`.

        Args:
            q: joints of the robot [rad]; None: it is not in the picture.
        """

        def image(state: FieldMap, stream: StreamState, params: FrameParams, *frame: Any) -> Any:
            *seen, q = frame
            return take_frame(
                self.layout, params, state, stream, *seen, body=self.left_out.body_at(q), box=self.left_out.box
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
        """Whether a cloud is to be believed: `admit_cloud`."""

        def admitted(limits: StreamParams, stream: StreamState, *frame: Any) -> Any:
            *pose, q = frame
            return admit_cloud(limits, stream, *pose, body=self.left_out.body_at(q))

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
        """One look at a cloud into the map: `take_cloud`."""

        def look(state: FieldMap, params: FrameParams, *frame: Any) -> Any:
            rotation, position, cloud, mask, gap, through, q = frame
            body, box = self.left_out.body_at(q), self.left_out.box
            return take_cloud(
                self.layout, params, state, rotation, position, cloud, mask, gap, through, tiles, body, box
            )

        seen = (rotation, position, cloud, mask, gap, through)
        return self.run(("cloud", cloud.shape, tiles), look, state, params, *seen, q, donate=(0,))

    def settle(self, state: FieldMap, params: MapParams) -> FieldMap:
        """The map with all weights fitted."""

        def settled(state: FieldMap, params: MapParams) -> FieldMap:
            return settle(self.layout, params, state)

        return self.run("settle", settled, state, params, donate=(0,))
