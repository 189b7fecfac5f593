"""Trials seen by two depth cameras and by a detector of landmarks, image by image, until the line has been held."""

from functools import partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.hand import Line, PointingParams, PointingState, held_line, held_points, initial_pointing, update_pointing
from hrcjax.numerics import safe_norm
from hrcjax.sense import NoiseParams
from hrcjax.sense.camera import Camera, in_image, render_capsules, render_scene
from hrcjax.sense.finger_axis import FingerParams, Seen, finger_line
from hrcjax.sense.landmark_points import LandmarkParams, Located, locate_landmarks
from hrcjax.sense.noise import measure
from hrcjax.sense.still_depth import still_depth
from hrcjax.typing import Array, Float, PRNGKeyArray, Vector3
from hrcjax.world import Scene

from .hand import PALM_SIZE
from .people import ARM_RADII

RATE = 15.0
"""Images of each camera in a second; the second one's are taken half a period later [Hz]."""
COLOUR_FOCAL = 615.0
"""Focal length of the colour images in which landmarks are found [px]."""
WORLD_ERROR = 0.134
"""Error of a landmark of the detector's own model in space, over the palm's size (Zhang et al. 2020) [1]."""
STAYS_ANYHOW = 10.0


class Watch(NamedTuple):
    """How one kind of trial is watched; all static."""

    images: int
    """Of each camera."""
    size: tuple[int, int]
    """Columns and rows about the landmarks that are rendered; what lies outside plays no part [px]."""
    moving: bool
    finger: bool
    """Whether the line is that of a finger, whose pixels are looked at."""
    below: tuple[float, ...]
    """How far each landmark of the line is below the skin [m]."""
    depth_error: tuple[float, ...]
    """How badly that is known [m]."""
    wider: int = 0
    """By how much what is near is wider to each side [px]."""
    noise: float = 1.0
    """Errors of landmarks and depths, over what the method is told [1]."""


FINGER_WATCH = Watch(12, (128, 112), False, True, (0.007,) * 4, (0.004,) * 4)
WATCHES = {
    "tip": FINGER_WATCH,
    "finger": FINGER_WATCH,
    "fresh": FINGER_WATCH,
    "wide": FINGER_WATCH._replace(wider=1),
    "thick": FINGER_WATCH,
    "thin": FINGER_WATCH,
    "noisy": FINGER_WATCH._replace(noise=1.5),
    "away": FINGER_WATCH,
    "arm": Watch(12, (224, 208), False, False, (ARM_RADII["upper arm"], ARM_RADII["forearm"]), (0.02, 0.01)),
    "through": FINGER_WATCH._replace(images=24, size=(96, 80), moving=True),
}
"""Kind of trial -> how it is watched."""


class Watched(NamedTuple):
    """What the images of a trial say when the line has first been held; else of the last one."""

    line: Line
    marks: Line
    """By the landmarks alone."""
    world: Line
    """The same by the detector's model in space."""
    chosen: Array
    """Whether the line has been held."""
    time: Array
    """When [s]."""


def cropped(cameras: Camera, corner: Float[Array, "camera 2"], size: tuple[int, int]) -> Camera:
    """The cameras' images from a corner on."""

    def one(camera: Camera, corner: Array) -> Camera:
        cx, cy = camera.cx - corner[0], camera.cy - corner[1]
        return Camera(camera.rotation, camera.position, camera.fx, camera.fy, cx, cy, *size)

    return jax.vmap(one)(cameras, corner)


def located(cameras: Camera, images: Array, pixels: Array, watch: Watch, pixel: Array, shared: Array, noise: NoiseParams) -> Located:  # fmt: skip
    """Landmarks in space, each as far below the skin as it is."""
    parts, order = [], []
    for kind in sorted(set(zip(watch.below, watch.depth_error, strict=True))):
        rows = [k for k, own in enumerate(zip(watch.below, watch.depth_error, strict=True)) if own == kind]
        params = eqx.tree_at(lambda p: (p.pixel, p.shared), LandmarkParams(below=kind[0], depth_error=kind[1]), (pixel, shared))  # fmt: skip
        parts.append(locate_landmarks(cameras, images, pixels[:, jnp.asarray(rows)], jnp.ones(2, bool), params, noise))
        order += rows
    back = jnp.asarray([order.index(k) for k in range(len(order))])
    return jax.tree.map(lambda *a: jnp.concatenate(a)[back], *parts)


def widened(depth: Float[Array, "height width"], by: int) -> Float[Array, "height width"]:
    """A depth image [m] in which what is near is wider by some pixels to each side, as a stereo camera makes it that matches windows."""
    size = 2 * by + 1
    return jax.lax.reduce_window(depth, jnp.asarray(jnp.inf, depth.dtype), jax.lax.min, (size, size), (1, 1), "SAME")


@partial(jax.jit, static_argnums=0)
def watch_trials(
    watch: Watch,
    cameras: Camera,
    scene: Scene,
    body: Capsules,
    line: Float[Array, "trial landmark 3"],
    wrist: Float[Array, "trial 3"],
    velocity: Float[Array, "trial 3"],
    size: Float[Array, "trial"],
    keys: PRNGKeyArray,
    pixel: Array,
    shared: Array,
    params: PointingParams,
) -> Watched:
    """All trials of a kind, one after the other.

    Args:
        cameras: at full resolution, stacked.
        pixel: standard deviation of a landmark in the colour image, along each axis [px].
        shared: share of that variance that is the same in all images of a trial [1].
    """
    one = partial(_trial, watch, cameras, scene, pixel, shared, params)
    return jax.lax.map(lambda item: one(*item), (body, line, wrist, velocity, size, keys))


def _trial(
    watch: Watch, cameras: Camera, scene: Scene, pixel: Array, shared: Array, params: PointingParams,
    body: Capsules, line: Array, wrist: Vector3, velocity: Vector3, size: Array, key: PRNGKeyArray,
) -> Watched:  # fmt: skip
    dtype, count = line.dtype, len(watch.below)
    noise, marks = NoiseParams(), jnp.concatenate([line, wrist[None]])
    real = eqx.tree_at(lambda p: p.subpixel, noise, watch.noise * noise.subpixel)
    pixels_key, world_key, own_key = jax.random.split(key, 3)
    same = jax.random.normal(pixels_key, (2, count + 1, 2), dtype)
    world_same = jax.random.normal(world_key, (count, 3), dtype)
    deviation = WORLD_ERROR * PALM_SIZE * size / 3**0.5
    plain = eqx.tree_at(lambda p: (p.still, p.drift), params, (STAYS_ANYHOW, STAYS_ANYHOW))
    middle = (watch.images - 1) / 2

    def mixed(same: Array, own: Array) -> Array:
        return jnp.sqrt(shared) * same + jnp.sqrt(1 - shared) * own

    def look(k: Array) -> tuple[Array, Array, Camera, Array]:
        """Columns and rows of all landmarks in the whole images, the cropped cameras, their corners and exact images."""
        moved = velocity * ((k - middle + 0.5 * jnp.arange(2, dtype=dtype)) / RATE)[:, None]
        whole, _ = jax.vmap(in_image)(cameras, marks + moved[:, None])
        half = jnp.asarray(watch.size, dtype) / 2
        corner = jnp.round(jnp.mean(whole[:, :count], axis=1) - half)
        crop = cropped(cameras, corner, watch.size)

        def render(camera: Camera, shift: Array) -> Array:
            there = Capsules(body.a + shift, body.b + shift, body.radius)
            return widened(render_capsules(camera, there, render_scene(camera, scene)), watch.wider)

        return whole, corner, crop, jax.vmap(render)(crop, moved)

    still = None if watch.moving else look(jnp.zeros((), dtype))

    def step(known: tuple, item: tuple) -> tuple[tuple, tuple]:
        state, world, held, held_world, chosen, time = known
        k, key = item
        whole, corner, crop, exact = look(k) if still is None else still
        key_u, key_w, *key_z = jax.random.split(key, 4)
        spread = spread_of(pixel, noise)
        found = whole + watch.noise * spread * mixed(same, jax.random.normal(key_u, same.shape, dtype))
        limit = jnp.asarray([cameras.width - 1, cameras.height - 1], dtype)
        inside = jnp.all((found >= 0) & (found <= limit), axis=-1, keepdims=True)
        found = jnp.where(inside, found - corner[:, None], jnp.nan)
        images = jax.vmap(lambda z, camera, key: measure(z, camera, key, real))(exact, crop, jnp.stack(key_z))
        marks = located(crop, images, found[:, :count], watch, spread, shared, noise)
        state, done = update_pointing(params, state, *marks, True, 1 / RATE)
        root = eqx.tree_at(lambda p: p.pixel, LandmarkParams(), spread)
        at = locate_landmarks(crop, images, found[:, count:], jnp.asarray([True, False]), root, noise).point
        shape = line - wrist + deviation * mixed(world_same, jax.random.normal(key_w, world_same.shape, dtype))
        known_by = jnp.broadcast_to(jnp.eye(3, dtype=dtype) / deviation**2, (count, 3, 3))
        world, _ = update_pointing(
            plain, world, at + shape, known_by, shared * jnp.linalg.inv(known_by), True, 1 / RATE
        )
        keep = lambda old, new: jnp.where(chosen, old, new)  # noqa: E731
        held, held_world = (jax.tree.map(keep, *pair) for pair in ((held, state), (held_world, world)))
        time = keep(time, (k + 1) / RATE)
        return (state, world, held, held_world, chosen | done, time), (images, found[:, :count])

    empty = initial_pointing(count, dtype)
    begin = (empty, empty, empty, empty, jnp.zeros((), bool), jnp.zeros((), dtype))
    keys = jax.random.split(own_key, watch.images)
    (_, _, held, held_world, chosen, time), shown = jax.lax.scan(step, begin, (jnp.arange(watch.images, dtype=dtype), keys))  # fmt: skip
    by_marks = by_pixels = held_line(held)
    if watch.finger:
        at = (jnp.arange(watch.images, dtype=dtype) + 1) / RATE
        used = (at >= time - params.dwell - 1e-3) & (at <= time + 1e-3)
        depth, found = shown
        crop = look((watch.images - 1) * jnp.ones((), dtype))[2] if still is None else still[2]
        by_pixels = seen_line(crop, depth, found, used, held, by_marks, spread_of(pixel, noise), shared)
    return Watched(by_pixels, by_marks, held_line(held_world), chosen, time)


def spread_of(pixel: Array, noise: NoiseParams) -> Array:
    """Standard deviation of a landmark in a depth image [px], from that in a colour image [px]."""
    return pixel * noise.focal / COLOUR_FOCAL


def seen_line(
    cameras: Camera, images: Array, pixels: Array, used: Array, held: PointingState, start: Line, spread: Array, shared: Array
) -> Line:  # fmt: skip
    """The line of a finger by its pixels in the images that are used; hardly any landmark: the line by landmarks.

    Args:
        images: (image camera row column) [m].
        pixels: (image camera landmark 2).
        start: by the landmarks alone.
        spread: standard deviation of a landmark in them [px].
        shared: share of its variance that is the same in all images [1].
    """
    depth, count = still_depth(images, used)
    there = used[:, None, None] & jnp.all(jnp.isfinite(pixels), axis=-1)
    n = jnp.sum(there, axis=0).astype(pixels.dtype)
    mean = jnp.sum(jnp.where(there[..., None], pixels, 0), axis=0) / jnp.maximum(n, 1)[..., None]
    mean = jnp.where(n[..., None] > 0, mean, jnp.nan)
    known = spread * jnp.sqrt(shared + (1 - shared) / jnp.maximum(jnp.sum(used.astype(pixels.dtype)), 1))
    ends = held_points(held)
    seen = Seen(mean, jnp.broadcast_to(known, (2,)), jnp.ones(2, bool), depth, count)
    return finger_line(cameras, seen, start, safe_norm(ends[-1] - ends[0]), FingerParams())
