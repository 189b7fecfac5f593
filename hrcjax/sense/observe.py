"""From exact images to what the policy may know: a static cloud, and the moving points of every frame.

The truth of scene and person enters by the camera's image alone. Sensing does not depend on the settings of a sweep: it
is done once for each scene and person.
"""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.cloud import Cloud
from hrcjax.sense.camera import Camera, render_capsules, render_scene
from hrcjax.sense.noise import NoiseParams, measure
from hrcjax.sense.points import crop, deproject, moved, remove_body, supported, valid_depth
from hrcjax.sense.thin import thin
from hrcjax.typing import Array, Bool, Float, PRNGKeyArray, Vector3
from hrcjax.world.person import Person, person_at
from hrcjax.world.scene import Scene

STATIC_CAPACITY = 192
"""Places of the static cloud; our scenes need up to 160 at the default voxel."""
MOVING_CAPACITY = 512
"""Places of a moving cloud; our motions need up to 511 at the default voxel."""


class SenseParams(eqx.Module):
    """Sizes of the way from image to cloud. Sources: the public presets of the HRI paper's map, where they have one."""

    voxel: float = 0.04
    """Edge of the voxels that thin a cloud; presets use 0.01 to 0.05 [m]."""
    threshold: float = 0.08
    """A point farther than this from the background moves; recommended for depth cameras [m]."""
    body_scale: float = 1.1
    """The robot's capsules are taken this much thicker [1]."""
    body_pad: float = 0.05
    """And this much more [m]."""
    table_margin: float = 0.03
    """Points lower than this over the table's top are cropped: noise makes the table thick [m]."""
    reach: float = 2.0
    """Half width of the crop box about the robot's base, in x and y [m]."""
    ceiling: float = 1.3
    """Height of the crop box over the table [m]."""
    least_count: float = 2.0
    """Points under which a voxel is taken for a flying pixel [1]."""
    support_gap: float = 0.05
    """A pixel's neighbour within this depth of it supports it [m]."""
    support: float = 2.0
    """Supporting neighbours, of four, under which a pixel is taken for a flying one [1]."""
    least_valid: float = 0.5
    """Share of pixels that must have a depth for a frame to count [1]."""
    noise: NoiseParams = NoiseParams()
    """The camera's errors."""


class Frames(eqx.Module):
    """All that was sensed of one scene and one person."""

    static: Cloud
    """What stood there before anybody came."""
    moving: Cloud
    """What does not belong to it, frame by frame: (frame point)."""
    stamp: Float[Array, "frame"]
    """When each frame was taken [s]."""
    valid: Bool[Array, "frame"]
    """False where too few pixels had a depth: the frame says nothing, not that nobody is there."""
    overflow: Bool[Array, "frame"]
    """True where moving points were left out for want of places; the nearest to the robot's base were kept."""
    static_overflow: Bool[Array, ""]
    """The same for the static cloud."""


def crop_box(params: SenseParams, dtype: jnp.dtype) -> tuple[Vector3, Vector3]:
    """Lower and upper corner of the part of the cell that counts [m]."""
    lower = jnp.stack([jnp.asarray(v, dtype) for v in (-params.reach, -params.reach, params.table_margin)])
    upper = jnp.stack([jnp.asarray(v, dtype) for v in (params.reach, params.reach, params.ceiling)])
    return lower, upper


def points_of(camera: Camera, depth: Float[Array, "height width"], robot: Capsules, params: SenseParams) -> Cloud:
    """The points of a measured image that are neither flying nor robot nor table nor outside the cell."""
    kept = jnp.where(supported(depth, params.support_gap, params.support), depth, 0)
    cloud = crop(deproject(camera, kept), *crop_box(params, depth.dtype))
    return remove_body(cloud, robot, params.body_scale, params.body_pad)


def background(
    camera: Camera,
    scene_image: Float[Array, "height width"],
    robot: Capsules,
    key: PRNGKeyArray,
    params: SenseParams,
    frames: int = 9,
    capacity: int = STATIC_CAPACITY,
) -> tuple[Cloud, Bool[Array, ""]]:
    """The static cloud, from the median of several measured images of the cell with nobody in it, and its overflow.

    A pixel counts if most of its images have a depth; the median drops most flying pixels. What the robot hides in these images is missing, and will be
    taken for moving when it is seen later: the safe side.

    Args:
        camera: where it is seen from.
        scene_image: the exact depth of the scene, from `render_scene` [m].
        robot: where the arm is meanwhile.
        key: of the noise.
        params: sizes.
        frames: images that are taken together.
        capacity: places of the cloud.
    """
    exact = render_capsules(camera, robot, scene_image)
    images = jax.lax.map(lambda k: measure(exact, camera, k, params.noise), jax.random.split(key, frames))
    valid = valid_depth(images)
    count = jnp.sum(valid, axis=0)
    ordered = jnp.sort(jnp.where(valid, images, jnp.inf), axis=0)  # those without a depth come last
    median = jnp.take_along_axis(ordered, (jnp.maximum(count, 1) - 1)[None] // 2, axis=0)[0]
    cloud = points_of(camera, jnp.where(2 * count > frames, median, 0), robot, params)
    return thin(cloud, params.voxel, capacity, jnp.zeros((3,), images.dtype), params.least_count)


def moving_points(
    camera: Camera,
    depth: Float[Array, "height width"],
    robot: Capsules,
    static: Cloud,
    params: SenseParams,
    capacity: int = MOVING_CAPACITY,
) -> tuple[Cloud, Bool[Array, ""]]:
    """What a measured image shows that is not static, thinned, and whether points were left out."""
    cloud = moved(points_of(camera, depth, robot, params), static, params.threshold)
    return thin(cloud, params.voxel, capacity, jnp.zeros((3,), depth.dtype), params.least_count)


def sense_sequence(
    camera: Camera,
    scene: Scene,
    person: Person,
    robot: Capsules,
    stamps: Float[Array, "frame"],
    key: PRNGKeyArray,
    params: SenseParams,
    static_capacity: int = STATIC_CAPACITY,
    moving_capacity: int = MOVING_CAPACITY,
) -> Frames:
    """Everything the camera says about a scene and a person; one image at every stamp.

    Args:
        camera: where it is seen from.
        scene: what stands there.
        person: who moves there.
        robot: the arm's capsules at every stamp (frame capsule). The background is taken with the first of them.
        stamps: times of the images [s].
        key: of the noise.
        params: sizes.
        static_capacity: places of the static cloud.
        moving_capacity: places of each moving cloud.

    Raises:
        ValueError: not as many poses of the arm as stamps.
    """
    if robot.radius.shape[0] != stamps.shape[0]:
        raise ValueError(f"{robot.radius.shape[0]} poses of the arm for {stamps.shape[0]} stamps")
    scene_image = render_scene(camera, scene)
    key_background, key_frames = jax.random.split(key)
    first = Capsules(robot.a[0], robot.b[0], robot.radius[0])
    static, static_overflow = background(camera, scene_image, first, key_background, params, capacity=static_capacity)

    def frame(item: tuple[Array, Capsules, PRNGKeyArray]) -> tuple[Cloud, Array, Array]:
        stamp, arm, frame_key = item
        exact = render_capsules(camera, arm, render_capsules(camera, person_at(person, stamp), scene_image))
        depth = measure(exact, camera, frame_key, params.noise)
        moving, overflow = moving_points(camera, depth, arm, static, params, moving_capacity)
        share = jnp.mean(valid_depth(depth), dtype=depth.dtype)
        return moving, overflow, share >= params.least_valid

    keys = jax.random.split(key_frames, stamps.shape[0])
    moving, overflow, valid = jax.lax.map(frame, (stamps, robot, keys))
    return Frames(static, moving, stamps, valid, overflow, static_overflow)
