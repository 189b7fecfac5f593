"""The map of what stands against the exact obstacles: errors of its distance, obstacles missed, space never seen."""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.field.grid import GridField, grid_distance
from hrcjax.map import labelled_points
from hrcjax.presence import centres
from hrcjax.robot import Arm
from hrcjax.sense import Camera
from hrcjax.sense.rig import Rig
from hrcjax.typing import Scalar
from hrcjax.world import Scene

from .truth import link_frames, obstacles_distance, on_links, solid_distance, solids, tool_poses
from .worlds import Bench, SetUp

BAND = (0.04, 0.10)
"""Distances from seen surfaces at which the field is compared [m]."""
RANDOM = 60_000
"""Random places of which those in the band are compared."""
ALONG = 25
"""Ticks between two postures whose control points are compared."""
THINNEST = 0.03
"""Obstacles with a smaller radius may be missed [m]."""
NEAR_MAP = 0.02
"""A map point this near to a surface shows it [m]."""
LEAST_SEEN = 0.05
"""Share of an obstacle's surface that must be seen for it to count as in view [1]."""
AROUND = 1.0
"""Radius about the base within which unseen space counts [m]."""


@dataclass(frozen=True)
class View:
    """One place from which a camera looked."""

    R: NDArray
    """World from camera."""
    p: NDArray
    """Pinhole [m]."""
    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int


def number(value: Scalar) -> float:
    """A scalar on the host."""
    return float(np.asarray(value))


def _view(camera: Camera, R: NDArray, p: NDArray) -> View:
    fx, fy, cx, cy = (number(v) for v in (camera.fx, camera.fy, camera.cx, camera.cy))
    return View(R, p, fx, fy, cx, cy, camera.width, camera.height)


def views_of(arm: Arm, rig: Rig, postures: NDArray) -> list[View]:
    """All places of the cameras in the set-up: the stationary ones, and the hand in every posture of the scan."""
    found = []
    for c in range(rig.count):
        camera = jax.tree.map(lambda a, c=c: np.asarray(a)[c], rig.cameras)
        found.append(_view(camera, np.asarray(camera.rotation, float), np.asarray(camera.position, float)))
    if rig.hand is not None:
        offset, turn = np.asarray(rig.hand.position, float), np.asarray(rig.hand.rotation, float)
        for R, p in zip(*tool_poses(arm, postures), strict=True):
            found.append(_view(rig.hand, R @ turn, p + R @ offset))
    return found


def _least_on_way(solid: tuple[int, NDArray, NDArray, float], eye: NDArray, x: NDArray) -> NDArray:
    """Least signed distance to a solid on the way from `eye` to each point x (point 3) [m]: convex along the way."""
    low, high = np.zeros(len(x)), np.ones(len(x))
    share, least = np.linspace(0, 1, 17), np.full(len(x), np.inf)
    for _ in range(4):
        s = low[:, None] + share * (high - low)[:, None]
        distance, _ = solid_distance(*solid, eye + s[..., None] * (x - eye)[:, None])
        k, step = distance.argmin(1), (high - low) / 16
        least = np.minimum(least, distance.min(1))
        middle = np.take_along_axis(s, k[:, None], 1)[:, 0]
        low, high = np.maximum(middle - step, 0), np.minimum(middle + step, 1)
    return least


def seen_by(scene: Scene, view: View, x: NDArray, near: float, far: float) -> NDArray:
    """True for points of surfaces (point 3) that a camera's ray reaches, with the robot absent."""
    local = (x - view.p) @ view.R
    z = np.maximum(local[:, 2], 1e-6)
    u, v = view.fx * local[:, 0] / z + view.cx, view.fy * local[:, 1] / z + view.cy
    inside = (local[:, 2] >= near) & (local[:, 2] <= far)
    inside &= (u >= -0.5) & (u < view.width - 0.5) & (v >= -0.5) & (v < view.height - 0.5)
    for solid in solids(scene):
        asked = np.flatnonzero(inside)
        inside[asked] = _least_on_way(solid, view.p, x[asked]) > -1e-3
    return inside


def seen(scene: Scene, views: list[View], x: NDArray, near: float, far: float) -> NDArray:
    """True for points of surfaces that any camera's ray reaches."""
    found = np.zeros(len(x), bool)
    for view in views:
        rest = np.flatnonzero(~found)
        found[rest] = seen_by(scene, view, x[rest], near, far)
    return found


def surface_points(solid: tuple[int, NDArray, NDArray, float], count: int, draw: np.random.Generator) -> NDArray:
    """Points on the surface of a solid (point 3), from all around it [m]."""
    kind, center, size, yaw = solid
    extent = np.array([size[0], size[0], size[2]]) if kind == 1 else size if kind == 2 else np.full(3, size[0])
    outer = center + draw.uniform(-1, 1, (8 * count, 3)) * (np.hypot(extent, extent[::-1]) + extent + 0.05)
    distance, near = solid_distance(kind, center, size, yaw, outer)
    return near[distance > 0.01][:count]


def _asked(
    scene: Scene, views: list[View], x: NDArray, least_z: float, near: float, far: float
) -> tuple[NDArray, NDArray]:
    """Of places x those in `BAND` of a seen part of a surface, and their exact distances [m]."""
    distance, place = obstacles_distance(scene, x)
    kept = (distance >= BAND[0]) & (distance <= BAND[1]) & (place[:, 2] > least_z)
    x, distance, place = x[kept], distance[kept], place[kept]
    shown = seen(scene, views, place, near, far)
    return x[shown], distance[shown]


def control_points(arm: Arm, q: NDArray) -> NDArray:
    """Middles of the control spheres in postures q (posture joint), (point 3) [m]."""
    return on_links(link_frames(arm, q), np.asarray(arm.control_links), arm.control_offsets).reshape(-1, 3)


_read = jax.jit(jax.vmap(grid_distance, in_axes=(None, 0)))


def read_grid(field: GridField, x: NDArray) -> NDArray:
    """The sensed distance at places (point 3) [m]."""
    size = -len(x) % 1024
    padded = np.concatenate([x, np.zeros((size, 3))])
    return np.asarray(_read(field, jnp.asarray(padded, field.coefficients.dtype)))[: len(x)]


def error_at(bench: Bench, made: SetUp, x: NDArray) -> NDArray:
    """Sensed minus exact distance at those of places x (point 3) that are in the band [m]."""
    noise, margin = bench.sense.noise, number(bench.sense.table_margin)
    views = views_of(bench.cell.arm, made.rig, np.asarray(made.postures, float))
    x, exact = _asked(made.scene, views, x, margin, number(noise.near), number(noise.far))
    return read_grid(made.field, x) - exact


def static_case(bench: Bench, made: SetUp) -> dict[str, Any]:
    """Everything of the set-up."""
    cell, scene = bench.cell, made.scene
    draw = np.random.default_rng(1000 + made.seed)
    views = views_of(cell.arm, made.rig, np.asarray(made.postures, float))
    noise = bench.sense.noise
    near, far = number(noise.near), number(noise.far)

    grid = cell.grid
    lower = np.maximum(np.asarray(grid.lower), [-0.9, -0.9, number(bench.sense.table_margin)])
    upper = np.minimum(np.asarray(grid.upper), [0.9, 0.9, 1.2])
    places = draw.uniform(lower, upper, (RANDOM, 3))
    distance, _ = obstacles_distance(scene, places)
    places = places[(distance >= BAND[0]) & (distance <= BAND[1])][:1500]

    points, _ = labelled_points(made.survey.map)
    share, shown = [], []
    for solid in solids(scene):
        surface = surface_points(solid, 300, draw)
        surface = surface[surface[:, 2] > number(bench.sense.table_margin)]
        share.append(float(seen(scene, views, surface, near, far).mean()) if len(surface) else 0.0)
        shown.append(bool((np.abs(solid_distance(*solid, points)[0]) < NEAR_MAP).any()) if len(points) else False)
    radius = np.asarray(scene.radius)[np.asarray(scene.mask)]

    middle = np.asarray(centres(cell.voxels, jnp.float32))
    box = (np.linalg.norm(middle, axis=1) < AROUND) & (middle[:, 2] > number(bench.sense.table_margin))
    solid_space = obstacles_distance(scene, middle)[0] < 0
    unseen = np.asarray(made.survey.unseen)
    return {
        "error": error_at(bench, made, places),
        "share_seen": share,
        "in_map": shown,
        "radius": radius,
        "unseen_share": unseen[box].mean(),
        "unseen_free_share": unseen[box & ~solid_space].mean(),
        "rounds": int(made.survey.rounds),
        "settled": bool(made.survey.settled),
        "seconds": made.seconds,
    }
