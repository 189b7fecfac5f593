"""Sensing of a world: every camera image is fused into the map, which separates static from moving points.

The exact scene and person enter only by the camera images. Sensing does not depend on the settings of a sweep: it is done
once for each scene and person.
"""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.cloud import Cloud
from hrcjax.map import (
    STATIC,
    FieldMap,
    FrameParams,
    MapLayout,
    MapParams,
    MapPoints,
    StreamParams,
    StreamState,
    empty_map,
    initial_stream,
    map_points,
    take_frame,
)
from hrcjax.sense import Camera, NoiseParams
from hrcjax.sense.camera import render_capsules, render_scene
from hrcjax.sense.noise import measure
from hrcjax.sense.points import moved
from hrcjax.sense.thin import thin
from hrcjax.typing import Array, Bool, Float, PRNGKeyArray, Vector3
from hrcjax.world import Person, Scene
from hrcjax.world.person import person_at

STATIC_CAPACITY = 128
"""Default capacity of the static cloud."""
MOVING_CAPACITY = 576
"""Default capacity of a cloud of moving points."""
SETUP_FRAMES = 9
"""Images of the empty cell before the person enters."""
MAP_POINTS = 3072
"""Capacity for the points read from the map."""
TILE_COLUMNS = 80
"""Least number of tiles along the width of an image."""
CELL_LAYOUT = MapLayout(
    lower=(-2.0, -2.0, 0.0), shape=(20, 20, 8), spacing=0.05, capacity=256, levels=2, seen=256, born=128, refitted=0
)
"""A map of the surroundings of the arm's base. The fields of the settings are fitted to its points, with their own
weights."""


def cell_frame_params() -> FrameParams:
    """The map's parameters at the cell's spacing of 5 cm, with a camera 2 m away."""
    return FrameParams(
        map=MapParams(clear_distance=0.05, new_distance=0.075, far=5.0), stream=StreamParams(least_share=0.4)
    )


class SenseParams(eqx.Module):
    """Parameters of sensing: crop box, separation of moving points, camera noise."""

    frame: FrameParams = eqx.field(default_factory=cell_frame_params)
    """Parameters of fusing an image into the map."""
    threshold: float = 0.08
    """A point farther than this from all static points is a moving point; a usual value for depth cameras [m]."""
    memory: float = 2.0
    """Frames after which moving points that another surface occludes are removed: people occlude where they were a moment
    ago. Points that the robot occludes are kept [1]."""
    table_margin: float = 0.03
    """Points lower than this above the table top are cropped, because of noise [m]."""
    reach: float = 2.0
    """Half width of the crop box around the robot's base, in x and y [m]."""
    ceiling: float = 1.3
    """Height of the crop box above the table [m]."""
    noise: NoiseParams = NoiseParams()
    """Noise of the camera."""


class Frames(eqx.Module):
    """All sensed data of one scene and one person."""

    static: Cloud
    """Static points: observed before the person enters."""
    moving: Cloud
    """Moving points: all others, frame by frame, (frame point)."""
    stamp: Float[Array, "frame"]
    """When each frame was taken [s]."""
    valid: Bool[Array, "frame"]
    """False where a frame is invalid: it carries no information, also not that nobody is present."""
    overflow: Bool[Array, "frame"]
    """True where points were dropped for lack of capacity, in the cloud or in the map; the cloud keeps the points nearest to
    the robot's base."""
    static_overflow: Bool[Array, ""]
    """The same for the static cloud."""
    map: FieldMap | None = None
    """The map after the set-up frames, for fields that read the map itself. Its weights are fitted only if
    `MapLayout.refitted` of the cell is not 0. None: the frames have no map."""


def crop_box(params: SenseParams, dtype: jnp.dtype) -> tuple[Vector3, Vector3]:
    """Minimum and maximum corner of the crop box [m]."""
    lower = jnp.stack([jnp.asarray(v, dtype) for v in (-params.reach, -params.reach, params.table_margin)])
    upper = jnp.stack([jnp.asarray(v, dtype) for v in (params.reach, params.reach, params.ceiling)])
    return lower, upper


def sense_sequence(
    camera: Camera,
    scene: Scene,
    person: Person,
    robot: Capsules,
    stamps: Float[Array, "frame"],
    key: PRNGKeyArray,
    params: SenseParams,
    layout: MapLayout = CELL_LAYOUT,
    static_capacity: int = STATIC_CAPACITY,
    moving_capacity: int = MOVING_CAPACITY,
) -> Frames:
    """Senses a scene and a person: one image at every stamp, each fused into the map.

    Static points are those observed repeatedly in `SETUP_FRAMES` images of the empty cell. Surfaces that the robot occludes
    in these are missing, and become moving points when observed later, which is conservative. Points that are occluded
    later, for instance by the robot, stay where they were last observed.

    Args:
        camera: its pose and intrinsics.
        scene: static obstacles.
        person: motion of the person.
        robot: the arm's capsules at every stamp (frame capsule). The empty cell is observed with the first of them.
        stamps: times of the images, increasing [s].
        key: random key of the noise.
        params: parameters of sensing.
        layout: of the map.
        static_capacity: capacity of the static cloud.
        moving_capacity: capacity of each cloud of moving points.

    Raises:
        ValueError: the number of arm poses differs from that of stamps.
    """
    if robot.radius.shape[0] != stamps.shape[0]:
        raise ValueError(f"{robot.radius.shape[0]} poses of the arm for {stamps.shape[0]} stamps")
    dtype = stamps.dtype
    scene_image = render_scene(camera, scene)
    box = crop_box(params, dtype)
    tile = max(1, camera.width // TILE_COLUMNS)
    centre = jnp.zeros((3,), dtype)
    before = stamps[0] - (SETUP_FRAMES - jnp.arange(SETUP_FRAMES).astype(dtype)) / 30.0
    somebody = jnp.arange(SETUP_FRAMES + stamps.shape[0]) >= SETUP_FRAMES
    poses = jax.tree.map(lambda a: jnp.concatenate([jnp.repeat(a[:1], SETUP_FRAMES, axis=0), a]), robot)
    keys = jax.random.split(key, somebody.shape[0])

    def frame(
        known: tuple[FieldMap, StreamState, FieldMap], item: tuple[Array, Array, Capsules, PRNGKeyArray]
    ) -> tuple[tuple[FieldMap, StreamState, FieldMap], tuple[MapPoints, Array, Array]]:
        """The map after one more image and that of the set-up; points, whether the image was accepted, whether the map
        exceeded a capacity."""
        stamp, there, arm, frame_key = item
        body = person_at(person, stamp)
        body = Capsules(body.a, body.b, jnp.where(there, body.radius, -1.0))
        exact = render_capsules(camera, arm, render_capsules(camera, body, scene_image))
        depth = measure(exact, camera, frame_key, params.noise)
        state, stream, report, refused = take_frame(
            layout, params.frame, *known[:2], stamp, camera, depth, arm, box, tile
        )
        settled = jax.tree.map(lambda new, old: jnp.where(there, old, new), state, known[2])
        short = (report.lost > 0) | (report.unseen > 0) | (report.left_out > 0)
        return (state, stream, settled), (map_points(state, MAP_POINTS), refused == 0, short)

    empty = empty_map(layout, dtype)
    start = (empty, initial_stream(dtype), empty)
    items = (jnp.concatenate([before, stamps]), somebody, poses, keys)
    (_, _, settled), (points, believed, short) = jax.lax.scan(frame, start, items)

    setup = jax.tree.map(lambda a: a[SETUP_FRAMES - 1], points)
    stood = Cloud(setup.cloud.points, setup.cloud.mask & (setup.label == STATIC))
    static, static_dropped = thin(stood, layout.spacing, static_capacity, centre)

    def moving_points(points: MapPoints) -> tuple[Cloud, Array]:
        cloud = Cloud(points.cloud.points, points.cloud.mask & (points.unmet.astype(dtype) < params.memory))
        return thin(moved(cloud, static, params.threshold), layout.spacing, moving_capacity, centre)

    short, then = short | points.more, jax.tree.map(lambda a: a[SETUP_FRAMES:], points)
    moving, overflow = jax.lax.map(moving_points, then)
    static_overflow = static_dropped | jnp.any(short[:SETUP_FRAMES])
    return Frames(
        static, moving, stamps, believed[SETUP_FRAMES:], overflow | short[SETUP_FRAMES:], static_overflow, settled
    )
