"""One depth image into a map: clean it, decide whether to believe it, fuse it. The whole way from a camera to the map."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.cloud import Cloud
from hrcjax.map.clean import drop_lonely, within_box, without_body
from hrcjax.map.fuse import fuse
from hrcjax.map.layout import VOXELS, MapLayout
from hrcjax.map.params import MapParams
from hrcjax.map.state import FieldMap, FrameReport
from hrcjax.map.stream import StreamParams, StreamState, admit
from hrcjax.map.view import FARTHEST, TILE, View, make_view
from hrcjax.sense import Camera
from hrcjax.sense.points import supported
from hrcjax.typing import Array, Bool, Float, Int, Scalar, Vector3

FLYING_GAP = 0.05
"""A pixel flies unless two of its four neighbours have a depth this near to its own, at 1 m and nearer; farther in
proportion [m]."""


class FrameParams(eqx.Module):
    """Parameters of the way of an image into the map."""

    map: MapParams = eqx.field(default_factory=MapParams)
    """Fusion, removal, weights."""
    stream: StreamParams = eqx.field(default_factory=StreamParams)
    """Limits within which a frame is accepted."""
    body_scale: Scalar = 1.1
    """The robot's capsules are taken this much thicker; preset of the HRI paper's map [1]."""
    body_pad: Scalar = 0.05
    """And this much more; preset of the HRI paper's map [m]."""


def surface_view(params: MapParams, camera: Camera, depth: Float[Array, "height width"], tile: int = TILE) -> View:
    """The surfaces in an image, without what flies between them.

    Args:
        depth: 0 or not finite: no measurement [m].
        tile: pixels along the edge of the tiles that the image is thinned to.
    """
    farthest = jnp.maximum(FARTHEST, params.far)
    # large tiles tell by themselves: flying pixels are few among sixteen
    flying = None if tile >= TILE else ~supported(depth, FLYING_GAP * jnp.maximum(depth, 1.0))
    return drop_lonely(
        make_view(camera, depth, params.pixel_noise, farthest=farthest, tile=tile, flying=flying), camera
    )


def admitted_view(
    params: FrameParams,
    stream: StreamState,
    stamp: Float[Array, ""],
    camera: Camera,
    depth: Float[Array, "height width"],
    body: Capsules | None = None,
    box: tuple[Vector3, Vector3] | None = None,
    tile: int = TILE,
) -> tuple[StreamState, View, Capsules | None, Int[Array, ""]]:
    """What of an image goes into a map: see `take_frame`.

    Returns:
        the camera's stream; the view, without anything if the frame is refused; the robot, whose capsules do not exist
        then; bits of why.
    """
    view = surface_view(params.map, camera, depth, tile)
    stream, view, refused = admit(params.stream, stream, stamp, camera, view, body)
    if box is not None:
        view = within_box(view, *box)
    if body is not None:
        # a frame that is not believed takes nothing away either
        body = Capsules(body.a, body.b, jnp.where(refused == 0, body.radius, -1.0))
        view = without_body(view, camera, body, params.body_scale, params.body_pad)
    return stream, jax.lax.optimization_barrier(view), body, refused


def take_frame(
    layout: MapLayout,
    params: FrameParams,
    state: FieldMap,
    stream: StreamState,
    stamp: Float[Array, ""],
    camera: Camera,
    depth: Float[Array, "height width"],
    body: Capsules | None = None,
    box: tuple[Vector3, Vector3] | None = None,
    tile: int = TILE,
) -> tuple[FieldMap, StreamState, FrameReport, Int[Array, ""]]:
    """The map after one image. One map can take in the images of several cameras, each with a stream of its own.

    Args:
        stamp: when the image was taken, since a moment not long ago [s].
        depth: 0 or not finite: no measurement [m].
        body: the robot at that time; None: it is not in the picture.
        box: least and greatest corner of what belongs into the map [m]; None: the whole layout.
        tile: pixels along the edge of the tiles that the image is thinned to.

    Returns:
        the map; the camera's stream; what the frame did; bits of why it was refused (`describe_frame`); 0: it was not.
    """
    stream, view, body, refused = admitted_view(params, stream, stamp, camera, depth, body, box, tile)
    state, report = fuse(layout, params.map, state, camera, view, body)
    return state, stream, report, refused


class MapPoints(NamedTuple):
    """The points of level 0 of a map."""

    cloud: Cloud
    """Where they are."""
    label: Int[Array, "point"]
    """NONE, NEW, STATIC or DYNAMIC."""
    unmet: Int[Array, "point"]
    """Frames in a row that did not observe the point, up to 127: it was occluded, or nothing was measured there."""
    more: Bool[Array, ""]
    """True if there were more points than places."""


def map_points(state: FieldMap, most: int) -> MapPoints:
    """The points of level 0 in `most` places."""
    rows = state.levels[0].rows
    there = (rows[:, 3] > 0).reshape(-1)
    index = jnp.nonzero(there, size=most, fill_value=there.size)[0]
    points = rows.at[index // VOXELS, :3, index % VOXELS].get(mode="fill", fill_value=0)
    label, unmet = (
        a.reshape(-1).at[index].get(mode="fill", fill_value=0).astype(jnp.int32) for a in (state.label, state.unmet)
    )
    return MapPoints(Cloud(points, index < there.size), label, unmet, jnp.sum(there) > most)
