"""Scenes that change: an object that is moved, and a person who passes in front of static objects. All images have sensor noise."""

import dataclasses

import jax.numpy as jnp
import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]  # made at run time
from scipy.spatial.transform import Rotation

from hrcjax.map import FieldMap
from hrcjax.world import motion_named, person_at
from hrcjax.world.scene import COLUMN
from hrcjax.world.scenes import Obstacle, make_scene

from .accuracy import Measures
from .families import Case, plain, robotica_case, with_capsules
from .queries import project, truth
from .solids import World
from .survey import LAYOUT, Frame, look, map_points, number, survey, take

ON_SURFACE, OFF_SURFACE = 0.02, 0.04
"""A point is on a surface if nearer than the first, and off it if farther than the second [m]."""
FREE = 0.1
"""Depth behind a stale point that the exact image must show for the point to be in free space [m]."""
STIRRED = 1e-3
"""A point that is farther from all points of the map than this was removed [m]."""
POSITION, ANGLE = 0.005, 0.3
"""Errors of poses [m], [degrees]."""
LEAST_PIXELS = 16
"""Least pixels of a voxel's surface in an image for it to be counted: one tile."""


def _table(place: tuple[float, float]) -> World:
    """Two static columns and a box of 16 cm at a position."""
    columns = [Obstacle(COLUMN, (x, 0.5, 0.1), (0.04, 0.04, 0.1), 0.0, 0.04) for x in (0.1, 0.7)]
    box = Obstacle(2, (*place, 0.09), (0.08, 0.07, 0.09), 0.3, 0.1)
    return plain(make_scene([*columns, box], (0.0,) * 3, (0.1,) * 3, (-1.0,) * 3, (1.0,) * 3))


def _seen_through(frame: Frame, p: np.ndarray) -> np.ndarray:
    """Which of the points (point, 3) are in free space of the exact image, at their pixel and its neighbours."""
    row, column, z, inside = project(frame, p)
    least = np.min([frame.exact[row + i, column + j] for i in (-1, 0, 1) for j in (-1, 0, 1)], axis=0)
    return inside & (least > z + FREE)


def mistaken(frame: Frame, draw: np.random.Generator) -> Frame:
    """The frame with an error of POSITION and ANGLE in the pose that the map is told, in a random direction."""
    shift, turn = (v / np.linalg.norm(v) for v in draw.normal(size=(2, 3)))
    c = frame.camera
    rotation = Rotation.from_rotvec(np.deg2rad(ANGLE) * turn).as_matrix() @ np.asarray(c.rotation)
    position = np.asarray(c.position) + POSITION * shift
    camera = dataclasses.replace(
        c, position=jnp.asarray(position, jnp.float32), rotation=jnp.asarray(rotation, jnp.float32)
    )
    return frame._replace(camera=camera)


def moved_box(seed: int, noisy: bool = False) -> Measures:
    """A box is moved between two frames; the camera does not move after that.

    Args:
        noisy: all poses have errors.

    Returns:
        gone: share of the points of its old position, in free space of the camera, that are removed after one frame, and
        after two; found: share of the voxels in view at its new position that have a point after one frame; ghosts: share of
        the points after two frames that are off all surfaces and in free space; eaten: share of the voxels of surfaces that
        did not move that have lost their point to a frame; and numbers.
    """
    draw = np.random.default_rng(seed)

    def told(frame: Frame) -> Frame:
        return mistaken(frame, draw) if noisy else frame

    x = draw.uniform(0.25, 0.35)
    before, after = _table((float(x), 0.25)), _table((float(x + 0.25), float(draw.uniform(0.2, 0.3))))
    case = robotica_case(seed)
    seen = survey(Case(before, *case[1:]), seed, every=3, told=told)
    old = map_points(seen.state)
    frames = [look(after, case.eyes[3], case.targets[3], 9000 + 10 * seed + k) for k in range(2)]
    d_before, _ = truth(before, old)
    d_after, _ = truth(after, old)
    stale = (np.abs(d_before) < ON_SURFACE) & (d_after > OFF_SURFACE) & _seen_through(frames[0], old)
    wanted = new_surface(before, after, frames[0])
    stays = (np.abs(d_before) < ON_SURFACE) & (np.abs(d_after) < ON_SURFACE)
    state, found, gone = seen.state, 0.0, []
    for k, frame in enumerate(frames):
        state, _ = take(state, told(frame))
        if k == 0:
            found = _share_near(state, wanted, LAYOUT.spacing)
        gone.append(float(np.mean(cKDTree(map_points(state)).query(old[stale])[0] > STIRRED)))
    left = map_points(state)
    ghosts = (truth(after, left)[0] > OFF_SURFACE) & _seen_through(frames[0], left)
    eaten = cKDTree(left).query(old[stays])[0] > LAYOUT.spacing
    return {
        "gone": gone[0],
        "gone_2": gone[1],
        "found": found,
        "ghosts": float(np.mean(ghosts)),
        "eaten": float(np.mean(eaten)),
        "stale": int(np.sum(stale)),
        "new": len(wanted),
    }


def new_surface(before: World, after: World, frame: Frame) -> np.ndarray:
    """Mean points of the new surfaces in an image, voxel by voxel (voxel, 3) [m]."""
    c, z = frame.camera, frame.exact
    v, u = np.nonzero(np.isfinite(z) & (z < 4.0))
    z = z[v, u]
    local = np.stack([(u - number(c.cx)) / number(c.fx) * z, (v - number(c.cy)) / number(c.fy) * z, z], axis=1)
    p = (local @ np.asarray(c.rotation).T + np.asarray(c.position)).astype(np.float32)
    p = p[(np.abs(p) < 2).all(axis=1)]
    p = p[(truth(before, p)[0] > OFF_SURFACE) & (np.abs(truth(after, p)[0]) < 0.005)]
    voxel = np.floor((p - np.asarray(LAYOUT.lower)) / LAYOUT.spacing).astype(np.int64)
    _, index, count = np.unique(voxel @ np.array([1 << 40, 1 << 20, 1]), return_inverse=True, return_counts=True)
    middle = np.stack([np.bincount(index, p[:, a]) for a in range(3)], axis=1) / count[:, None]
    return middle[count >= LEAST_PIXELS]


def _share_near(state: FieldMap, p: np.ndarray, distance: float) -> float:
    """Share of points (point, 3) with a point of the map within a distance [m]."""
    return float(np.mean(cKDTree(map_points(state)).query(p)[0] < distance))


def person_passes(seed: int, frames: int = 12) -> Measures:
    """A person walks between camera and table; occluded static points should stay in the map.

    Returns:
        lost: share of the points in view, occluded in some frame, that have no point within a voxel's edge afterwards,
        and the number of occluded points.
    """
    case = robotica_case(seed)
    person = motion_named("pass_by", case.world.scene, seed)
    eye, target = np.asarray([0.4, 2.0, 0.75], np.float32), np.asarray([0.4, 0.3, 0.1], np.float32)
    seen = survey(case, seed, every=3)
    state = seen.state
    for k in range(3):  # the static camera's own view
        state, _ = take(state, look(case.world, eye, target, 9500 + k))
    before = map_points(state)
    hidden = np.zeros(len(before), bool)
    for k, t in enumerate(np.linspace(3.0, 5.0, frames)):
        world = with_capsules(case.world, person_at(person, float(t)))
        frame = look(world, eye, target, 9600 + 100 * seed + k)
        row, column, z, inside = project(frame, before)
        hidden |= inside & (frame.exact[row, column] < z - OFF_SURFACE) & (truth(case.world, before)[0] < ON_SURFACE)
        state, _ = take(state, frame)
    lost = cKDTree(map_points(state)).query(before[hidden])[0] > LAYOUT.spacing
    return {"lost": float(np.mean(lost)), "hidden": int(np.sum(hidden))}
