"""Pictures of a scene by MuJoCo's ray casting, without a graphics library: colours of the parts, light from the normals."""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from .scene import Scene

LIGHT = np.array([0.35, -0.55, 0.76])
"""Direction to the light [1]."""
TABLE_COLOURS = ((0.93, 0.93, 0.94), (0.87, 0.88, 0.9))
"""Of the table's squares."""
SQUARE = 0.05
"""Edge of a square [m]."""
AMBIENT = 0.45
"""Share of the light from everywhere [1]."""


@dataclass(frozen=True)
class Viewpoint:
    """A pinhole camera for pictures."""

    eye: NDArray
    """[m]"""
    target: NDArray
    """What is in the middle [m]."""
    width: int = 320
    """[px]"""
    height: int = 300
    """[px]"""
    focal: float = 520.0
    """[px]"""

    def axes(self) -> NDArray:
        """Right, down and forward in the world, as columns."""
        forward = self.target - self.eye
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right = right / np.linalg.norm(right)
        return np.column_stack([right, np.cross(forward, right), forward])

    def project(self, points: NDArray) -> NDArray:
        """Columns and rows of points (point, 3) [m] in the picture [px]."""
        local = (points - self.eye) @ self.axes()
        return self.focal * local[:, :2] / local[:, 2:] + [self.width / 2, self.height / 2]


def picture(scene: Scene, view: Viewpoint) -> NDArray:
    """The scene (row, column, 3), 0 to 1."""
    model, data = scene.model, scene.data
    u, v = np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5)
    local = np.stack([u - view.width / 2, v - view.height / 2, np.full_like(u, view.focal)], axis=-1) / view.focal
    rays = np.ascontiguousarray(local.reshape(-1, 3) @ view.axes().T)
    count = len(rays)
    geom, distance, normal = np.full(count, -1, np.int32), np.zeros(count), np.zeros(3 * count)
    eye = np.ascontiguousarray(view.eye, float).reshape(3, 1)
    mujoco.mj_multiRay(model, data, eye, rays.reshape(-1, 1), None, True, -1, geom, distance, normal, count, 10.0)
    hit = view.eye + distance[:, None] * rays
    colour = np.where(geom[:, None] >= 0, model.geom_rgba[np.maximum(geom, 0), :3], 1.0)
    square = (np.floor(hit[:, 0] / SQUARE) + np.floor(hit[:, 1] / SQUARE)).astype(int) % 2
    table = geom == mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "table")
    colour[table] = np.array(TABLE_COLOURS)[square[table]]
    n = normal.reshape(-1, 3)
    n = n * -np.sign(np.sum(n * rays, axis=1, keepdims=True))  # on the side of the eye
    light = AMBIENT + (1 - AMBIENT) * np.clip(n @ (LIGHT / np.linalg.norm(LIGHT)), 0, 1)
    shaded = np.where(geom[:, None] >= 0, colour * light[:, None], 1.0)
    return np.clip(shaded, 0, 1).reshape(view.height, view.width, 3)
