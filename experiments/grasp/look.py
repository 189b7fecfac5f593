"""What the cameras see of a scene: two stationary ones beyond the object and one in the hand that looks from three sides.

MuJoCo casts the rays, which needs no graphics library; noise, holes and flying pixels are those of `hrcjax.sense`.
"""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from numpy.typing import NDArray

from hrcjax.sense import Camera, d435i

from .scene import WORK, Scene

STATIONARY = ((0.6, 0.45, 0.6), (-0.6, 0.45, 0.6))
"""Where stationary cameras are, beyond the middle of the places [m]."""
HAND_AZIMUTHS = (-65.0, 0.0, 65.0)
"""Directions from the object in which the camera in the hand is, 0 towards the arm's base [deg]."""
HAND_DISTANCE, HAND_ELEVATION = 0.36, 42.0
"""Of the camera in the hand from the object [m], and over the table [deg]."""
TARGET_HEIGHT = 0.04
"""Of the place that all look at [m]."""
WINDOW = 128
"""Rows and columns of the part of an image that is read: about the object."""


@dataclass(frozen=True)
class Look:
    """What one camera sees from one place, without noise."""

    camera: Camera
    """With the window as its image."""
    depth: NDArray
    """Along the optical axis; infinity: nothing (row, column) [m]."""
    normal: NDArray
    """Of what is hit (row, column, 3) [1]."""
    own: NDArray
    """True where the object is hit (row, column)."""


def window(camera: Camera, middle: NDArray) -> Camera:
    """The camera's image cut to a window about the picture of a place [m]."""
    R, eye, fx, fy, cx, cy = _numbers(camera)
    local = R.T @ (middle - eye)
    u = round(float(fx * local[0] / local[2] + cx)) - WINDOW // 2
    v = round(float(fy * local[1] / local[2] + cy)) - WINDOW // 2
    return replace(camera, cx=camera.cx - u, cy=camera.cy - v, width=WINDOW, height=WINDOW)


def _numbers(camera: Camera) -> list[NDArray]:
    """Axes, position, focal lengths and principal point."""
    return [np.asarray(v, float) for v in (camera.rotation, camera.position, camera.fx, camera.fy, camera.cx, camera.cy)]  # fmt: skip


def _rays(camera: Camera) -> NDArray:
    """Directions of all pixels in the world, of depth 1 along the optical axis (row, column, 3)."""
    R, _, fx, fy, cx, cy = _numbers(camera)
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    return np.stack([(u - cx) / fx, (v - cy) / fy, np.ones(u.shape)], axis=-1) @ R.T


def hand_eyes(middle: NDArray) -> list[NDArray]:
    """Where the camera in the hand looks from [m]."""
    eyes = []
    for azimuth in np.deg2rad(HAND_AZIMUTHS):
        up = np.deg2rad(HAND_ELEVATION)
        aside = np.array([np.sin(azimuth) * np.cos(up), -np.cos(azimuth) * np.cos(up), np.sin(up)])
        eyes.append(middle + HAND_DISTANCE * aside)
    return eyes


def stationary_cameras(dtype: jnp.dtype | type = jnp.float32) -> list[Camera]:
    """Those beyond the object, cut to windows about the middle of the places where objects stand."""
    middle = np.array([*WORK, TARGET_HEIGHT])
    at = jnp.asarray(middle, dtype)
    return [window(d435i(jnp.asarray(middle + eye, dtype), at, 1), middle) for eye in STATIONARY]


def hand_cameras(place: NDArray, dtype: jnp.dtype | type = jnp.float32) -> list[Camera]:
    """The one in the hand from each side, cut to windows about where an object is taken to be on the table (2) [m]."""
    at = np.array([*place, TARGET_HEIGHT])
    aim = jnp.asarray(at, dtype)
    return [window(d435i(jnp.asarray(eye, dtype), aim, 2), at) for eye in hand_eyes(at)]


def look(scene: Scene, camera: Camera) -> Look:
    """Exact depth and normals."""
    rays = np.ascontiguousarray(_rays(camera).reshape(-1, 3))
    count = len(rays)
    geom, distance, normal = np.full(count, -1, np.int32), np.zeros(count), np.zeros(3 * count)
    eye = np.asarray(camera.position, float).reshape(3, 1)
    mujoco.mj_multiRay(scene.model, scene.data, eye, rays.reshape(-1, 1), None, True, -1, geom, distance, normal, count, 10.0)  # fmt: skip
    shape = (camera.height, camera.width)
    depth = np.where(geom >= 0, distance, np.inf).reshape(shape)  # rays have z = 1 along the optical axis
    own = np.isin(geom, scene.geoms).reshape(shape)
    return Look(camera, depth, normal.reshape(*shape, 3), own)


def unseen(one: Look) -> Look:
    """The same without an image: the camera did not get there."""
    return replace(one, depth=np.full_like(one.depth, np.inf))


def exact_surface(looks: list[Look]) -> tuple[NDArray, NDArray]:
    """Points and unit normals of the object's surface as far as it is seen, without noise (point, 3) [m], [1]."""
    points, normals = [], []
    for one in looks:
        with np.errstate(invalid="ignore"):
            world = one.depth[..., None] * _rays(one.camera) + np.asarray(one.camera.position, float)
        points.append(world[one.own])
        normals.append(one.normal[one.own])
    n = np.concatenate(normals)
    return np.concatenate(points), n / np.linalg.norm(n, axis=1, keepdims=True)


def stacked(looks: list[Look], key: jax.Array) -> tuple[Camera, jax.Array, jax.Array]:
    """The cameras with a leading axis, their exact images, and a key for the noise of each."""
    camera = jax.tree.map(lambda *a: jnp.stack(a), *[one.camera for one in looks])
    depth = jnp.asarray(np.stack([one.depth for one in looks]), camera.position.dtype)
    return camera, depth, jax.random.split(key, len(looks))
