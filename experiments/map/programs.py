"""The compiled programs of the map: one for each size of image, and of cloud."""

import time
from collections.abc import Callable, Hashable
from typing import Any

import jax
import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.map import (
    FieldMap,
    FrameParams,
    FrameReport,
    MapLayout,
    MapParams,
    StreamParams,
    StreamState,
    View,
    admit,
    admitted_view,
    cloud_camera,
    fuse,
    view_from_cloud,
)
from hrcjax.map.clean import within_box, without_body
from hrcjax.robot import arm_capsules
from hrcjax.sense import Camera
from hrcjax.typing import Array, Bool, Float, Int, Joints

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
        params: MapParams,
        limits: StreamParams,
        stamp: Float[Array, ""],
        camera: Camera,
        depth: Float[Array, "height width"],
        q: Joints | None = None,
    ) -> tuple[FieldMap, StreamState, FrameReport, Int[Array, ""], Int[Array, ""], Int[Array, ""]]:
        """A depth image into the map.

        Args:
            q: joints of the robot [rad]; None: it is not in the picture.

        Returns:
            map, stream, report, reasons of a refusal, tiles with a surface, and of them those too near or too far.
        """

        def image(
            state: FieldMap, stream: StreamState, params: MapParams, limits: StreamParams, stamp: Array, camera: Camera, depth: Array, q: Joints | None
        ) -> Any:  # fmt: skip
            frame, box = FrameParams(params, limits), self.left_out.box
            stream, view, body, reasons = admitted_view(frame, stream, stamp, camera, depth, self._body(q), box)
            state, report = fuse(self.layout, params, state, camera, view, body)
            return state, stream, report, reasons, *_tiles(params, camera, view)

        return self.run(
            ("image", depth.shape), image, state, stream, params, limits, stamp, camera, depth, q, donate=(0,)
        )

    def _body(self, q: Joints | None) -> Capsules | None:
        """The robot in the world; None: it is not in the picture."""
        return None if q is None or self.left_out.arm is None else arm_capsules(self.left_out.arm, q)

    def _cleaned(self, view: View, camera: Camera, body: Capsules | None) -> View:
        """The view without what does not belong into the map."""
        if self.left_out.box is not None:
            view = within_box(view, *self.left_out.box)
        return view if body is None else without_body(view, camera, body)

    def admit_cloud(
        self,
        stream: StreamState,
        limits: StreamParams,
        stamp: Float[Array, ""],
        camera: Camera,
        q: Joints | None = None,
    ) -> tuple[StreamState, Int[Array, ""]]:
        """Stamp, pose and robot of a cloud that has points: the stream, and reasons of a refusal."""

        def admit_cloud(
            stream: StreamState, limits: StreamParams, stamp: Array, camera: Camera, q: Joints | None
        ) -> Any:
            view = View(jnp.zeros((1, 3), stamp.dtype), jnp.ones(1, bool), jnp.zeros(1, stamp.dtype), jnp.zeros((1, 1), stamp.dtype))  # fmt: skip
            stream, _, reasons = admit(limits, stream, stamp, camera, view, self._body(q))
            return stream, reasons

        return self.run(("admit", camera.width), admit_cloud, stream, limits, stamp, camera, q)

    def cloud(
        self,
        state: FieldMap,
        params: MapParams,
        rotation: Float[Array, "3 3"],
        position: Float[Array, "3"],
        cloud: Float[Array, "point 3"],
        mask: Bool[Array, "point"],
        gap: Float[Array, ""],
        through: Bool[Array, ""],
        tiles: int,
        q: Joints | None = None,
    ) -> tuple[FieldMap, FrameReport, Int[Array, ""], Int[Array, ""]]:
        """One look at a cloud into the map.

        Args:
            rotation, position: of the virtual camera.
            cloud, mask: padded points in its axes [m].
            gap: between points of one surface [m].
            through: False: nothing is seen through.
            tiles: along each edge of its image.
            q: joints of the robot [rad]; None: it is not in the picture.

        Returns:
            map, report, points in the image, and of them those too near or too far.
        """

        def look(
            state: FieldMap, params: MapParams, rotation: Array, position: Array, cloud: Array, mask: Array, gap: Array, through: Array, q: Joints | None
        ) -> Any:  # fmt: skip
            camera, body = cloud_camera(rotation, position, tiles), self._body(q)
            view = view_from_cloud(camera, cloud, mask, params.pixel_noise, gap)
            view = View(view.points, view.mask, view.variance, jnp.where(through, view.depth, 0.0))
            view = self._cleaned(view, camera, body)
            state, report = fuse(self.layout, params, state, camera, view, body)
            return state, report, *_tiles(params, camera, view)

        return self.run(
            ("cloud", cloud.shape, tiles), look, state, params, rotation, position, cloud, mask, gap, through, q, donate=(0,)
        )  # fmt: skip


def _tiles(params: MapParams, camera: Camera, view: View) -> tuple[Int[Array, ""], Int[Array, ""]]:
    """Tiles with a surface, and of them those outside of the limits of depth."""
    depth = (view.points - camera.position) @ camera.rotation[:, 2]
    beyond = view.mask & ~((depth > params.near) & (depth < params.far))
    return jnp.sum(view.mask, dtype=jnp.int32), jnp.sum(beyond, dtype=jnp.int32)
