"""A sensor's cloud into a map: its stamp and pose are checked once, then it is fused look by look.

A look is a virtual pinhole camera at the cloud (`hrcjax.map.cloud_view`).
"""

import dataclasses

import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.map.clean import within_box, without_body
from hrcjax.map.cloud_view import cloud_camera, view_from_cloud
from hrcjax.map.fuse import fuse
from hrcjax.map.layout import MapLayout
from hrcjax.map.state import FieldMap, FrameReport
from hrcjax.map.stream import StreamParams, StreamState, admit
from hrcjax.map.take import FrameParams
from hrcjax.map.view import View
from hrcjax.sense import Camera
from hrcjax.typing import Array, Bool, Float, Int, Matrix3, Scalar, Vector3


def admit_cloud(
    params: StreamParams,
    stream: StreamState,
    stamp: Float[Array, ""],
    rotation: Matrix3,
    position: Vector3,
    body: Capsules | None = None,
) -> tuple[StreamState, Int[Array, ""]]:
    """Whether a cloud that has points is to be believed: see `admit`.

    Args:
        rotation, position: of the sensor [m].

    Returns:
        the sensor's stream, and bits of why the cloud is refused (`describe_frame`); 0: it is not.
    """
    one = jnp.ones((), position.dtype)
    camera = Camera(rotation, position, one, one, one, one, 1, 1)
    view = View(position[None], jnp.ones(1, bool), one[None], one[None, None])
    stream, _, reasons = admit(params, stream, stamp, camera, view, body)
    return stream, reasons


def take_cloud(
    layout: MapLayout,
    params: FrameParams,
    state: FieldMap,
    rotation: Matrix3,
    position: Vector3,
    cloud: Float[Array, "point 3"],
    mask: Bool[Array, "point"],
    gap: Scalar,
    through: Bool[Array, ""],
    tiles: int,
    body: Capsules | None = None,
    box: tuple[Vector3, Vector3] | None = None,
) -> tuple[FieldMap, FrameReport]:
    """The map after one look at a cloud.

    Args:
        rotation, position: of the look's camera [m].
        cloud: in its axes [m].
        mask: which points exist.
        gap: the points of one surface are nearer to each other than this [m].
        through: False: nothing is seen through.
        tiles: along each edge of the look's image.
        body: the robot at that time; None: it is not in the picture.
        box: least and greatest corner of what belongs into the map [m]; None: the whole layout.
    """
    camera = cloud_camera(rotation, position, tiles)
    view = view_from_cloud(camera, cloud, mask, params.map.pixel_noise, gap)
    view = dataclasses.replace(view, depth=jnp.where(through, view.depth, 0.0))
    if box is not None:
        view = within_box(view, *box)
    if body is not None:
        view = without_body(view, camera, body, params.body_scale, params.body_pad)
    return fuse(layout, params.map, state, camera, view, body)
