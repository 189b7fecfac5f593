"""Exact geometry in plain NumPy, and the arm's kinematics in C MuJoCo: nothing of the geometry that senses is used.

Of arms, people and scenes only the numbers are read: capsules, frames, solids.
"""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

import mujoco
import numpy as np
from numpy.typing import NDArray

from hrcjax.robot import Arm
from hrcjax.world import Person, Scene

FAR = 10.0
"""Distance if there is nobody or nothing [m]."""
SPHERE, COLUMN = 0, 1
GAP = 0.03
"""Largest distance between two neighbours of the points that stand for a capsule's axis [m]."""


def watched(arm: Arm) -> NDArray:
    """Capsules that the control points cover: all but those nearer to the base than the first covered link."""
    return np.asarray(arm.capsule_links) >= min(arm.control_links)


def link_frames(arm: Arm, q: NDArray) -> tuple[NDArray, NDArray]:
    """Rotation (time link 3 3) and origin (time link 3) [m] of the base and of every moving link; the base comes first.

    Args:
        q: (time joint) [rad].
    """
    model = arm.model
    data = mujoco.MjData(model)
    first = int(model.jnt_bodyid[0])
    bodies = [int(model.body_parentid[first]), *(int(body) for body in model.jnt_bodyid)]
    R, p = np.empty((len(q), len(bodies), 3, 3)), np.empty((len(q), len(bodies), 3))
    for k, one in enumerate(q):
        data.qpos[:] = one
        mujoco.mj_kinematics(model, data)
        R[k], p[k] = data.xmat[bodies].reshape(-1, 3, 3), data.xpos[bodies]
    return R, p


def on_links(frames: tuple[NDArray, NDArray], links: NDArray, offsets: NDArray) -> NDArray:
    """Points (time point 3) [m] from their offsets in the frames of their links; link -1 is the base."""
    R, p = frames
    rows = np.asarray(links) + 1
    return p[:, rows] + np.einsum("tkij,kj->tki", R[:, rows], offsets)


def arm_axes(arm: Arm, q: NDArray) -> tuple[NDArray, NDArray]:
    """Both ends of the arm's capsules at every time, (time capsule 3) [m]."""
    frames, links = link_frames(arm, q), np.asarray(arm.capsule_links)
    return on_links(frames, links, arm.capsule_a), on_links(frames, links, arm.capsule_b)


def tool_poses(arm: Arm, q: NDArray) -> tuple[NDArray, NDArray]:
    """Axes (time 3 3), world from tool, and the tool point (time 3) [m]."""
    R, p = (v[:, arm.tool_link + 1] for v in link_frames(arm, q))
    return R @ arm.tool_axes, p + R @ arm.tool_offset


def axis_points(arm: Arm) -> tuple[NDArray, NDArray, NDArray]:
    """Links, offsets [m] and radii [m] of spheres along the axes of the watched capsules, at most `GAP` apart."""
    links, offsets, radii = [], [], []
    for k in np.flatnonzero(watched(arm)):
        a, b = arm.capsule_a[k], arm.capsule_b[k]
        count = int(np.ceil(np.linalg.norm(b - a) / GAP)) + 1
        offsets.append(np.linspace(a, b, max(count, 2)))
        links += [arm.capsule_links[k]] * len(offsets[-1])
        radii += [arm.capsule_radii[k]] * len(offsets[-1])
    return np.asarray(links), np.concatenate(offsets), np.asarray(radii)


def person_capsules(person: Person, times: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Both ends (time capsule 3) and radii (time capsule) of the person's capsules [m]; a radius of NaN: not there.

    Between two frames on a straight line; before the first and after the last one held. There if a frame on either side,
    as far as it counts, says so.
    """
    a, b = np.asarray(person.a, float), np.asarray(person.b, float)
    present, radius = np.asarray(person.present), np.asarray(person.radius, float)
    last = len(a) - 1
    at = np.clip(np.asarray(times, float) * float(person.rate), 0, last)
    low = np.floor(at).astype(int)
    high, part = np.minimum(low + 1, last), at - low
    there = present[low] | (present[high] & (part > 0))
    mix = part[:, None, None]
    radii = np.where(there[:, None] & (radius >= 0), radius, np.nan)
    return (1 - mix) * a[low] + mix * a[high], (1 - mix) * b[low] + mix * b[high], radii


def point_to_segment(x: NDArray, a: NDArray, b: NDArray) -> tuple[NDArray, NDArray]:
    """Distance (...) of points to segments, and the nearest point of each segment (... 3) [m]."""
    way = b - a
    square = (way * way).sum(-1)
    part = ((x - a) * way).sum(-1) / np.where(square > 0, square, 1.0)
    nearest = a + np.clip(np.where(square > 0, part, 0.0), 0, 1)[..., None] * way
    return np.linalg.norm(x - nearest, axis=-1), nearest


def segments_apart(a: NDArray, b: NDArray, c: NDArray, d: NDArray) -> NDArray:
    """Distance of the segments a to b and c to d, (... 3) [m].

    The squared distance is a convex quadratic of the two parameters, so its least value on the unit square lies on an edge,
    where an end meets the other segment, or within, where the gap is at right angles to both.
    """
    ends = [point_to_segment(a, c, d)[0], point_to_segment(b, c, d)[0], point_to_segment(c, a, b)[0], point_to_segment(d, a, b)[0]]  # fmt: skip
    least = np.minimum(np.minimum(ends[0], ends[1]), np.minimum(ends[2], ends[3]))
    u, v, w = b - a, d - c, a - c
    normal = np.cross(u, v)
    square = (normal * normal).sum(-1)
    across = square > 1e-16
    safe = np.where(across, square, 1.0)
    s = (np.cross(v, w) * normal).sum(-1) / safe
    t = (np.cross(u, w) * normal).sum(-1) / safe
    within = across & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    return np.where(within, np.minimum(least, np.abs((w * normal).sum(-1)) / np.sqrt(safe)), least)


def arm_person(arm: Arm, person: Person, q: NDArray, times: NDArray, whole: bool = False) -> NDArray:
    """Distance between the surfaces of arm and person at every time [m]; FAR if nobody is there.

    Args:
        q: of the arm at each time (time joint) [rad].
        times: of the person [s].
        whole: with the base and what turns about it alone; otherwise the watched capsules.
    """
    some = np.full(len(arm.capsule_links), True) if whole else watched(arm)
    a, b = (ends[:, some, None] for ends in arm_axes(arm, q))
    c, d, radius = person_capsules(person, times)
    gap = segments_apart(a, b, c[:, None], d[:, None]) - arm.capsule_radii[some][:, None] - radius[:, None]
    gap = np.where(np.isnan(gap), FAR, gap)
    return gap.min(axis=(1, 2))


def solid_distance(kind: int, center: NDArray, size: NDArray, yaw: float, x: NDArray) -> tuple[NDArray, NDArray]:
    """Signed distance of points (... 3) to a sphere, an upright cylinder or an upright box, negative inside, and the nearest
    point of its surface for points outside [m]."""
    offset = x - center
    if kind == SPHERE:
        size_of = np.linalg.norm(offset, axis=-1)
        return size_of - size[0], center + offset * (size[0] / np.maximum(size_of, 1e-12))[..., None]
    if kind == COLUMN:
        flat = np.hypot(offset[..., 0], offset[..., 1])
        radial, high = flat - size[0], np.abs(offset[..., 2]) - size[2]
        outside = np.hypot(np.maximum(radial, 0), np.maximum(high, 0))
        shrink = np.minimum(size[0] / np.maximum(flat, 1e-12), 1.0)
        near = np.stack(
            [offset[..., 0] * shrink, offset[..., 1] * shrink, np.clip(offset[..., 2], -size[2], size[2])], -1
        )
        return np.where(outside > 0, outside, np.maximum(radial, high)), center + near
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    own = offset @ turn  # in the box's axes
    near = np.clip(own, -size, size)
    outside = np.linalg.norm(own - near, axis=-1)
    return np.where(outside > 0, outside, (np.abs(own) - size).max(-1)), center + near @ turn.T


def solids(scene: Scene) -> list[tuple[int, NDArray, NDArray, float]]:
    """The obstacles of a scene: index, kind, middle, half extents, turn are read once; absent ones are left out."""
    return [
        (int(scene.kind[k]), np.asarray(scene.center[k], float), np.asarray(scene.size[k], float), float(scene.yaw[k]))
        for k in np.flatnonzero(np.asarray(scene.mask))
    ]


def obstacles_distance(scene: Scene, x: NDArray) -> tuple[NDArray, NDArray]:
    """Signed distance of points to the nearest obstacle, and the nearest point of its surface [m]; without one: FAR, the
    point itself."""
    best, near = np.full(x.shape[:-1], FAR), x.copy()
    for solid in solids(scene):
        distance, place = solid_distance(*solid, x)
        nearer = distance < best
        best, near = np.where(nearer, distance, best), np.where(nearer[..., None], place, near)
    return best, near


def arm_obstacles(arm: Arm, scene: Scene, q: NDArray) -> NDArray:
    """Least signed distance of the moving links' surfaces to the nearest obstacle at every time [m].

    Along an axis the distance to a convex solid is convex: it is sampled densely, then again around the least sample.
    """
    moving = np.asarray(arm.capsule_links) >= 0
    a, b = (ends[:, moving] for ends in arm_axes(arm, q))
    found = np.full(len(q), FAR)
    share = np.linspace(0, 1, 17)
    for solid in solids(scene):
        low, high = np.zeros(a.shape[:2]), np.ones(a.shape[:2])
        least = np.full(a.shape[:2], np.inf)
        for _ in range(7):  # each time to an eighth
            s = low[..., None] + share * (high - low)[..., None]
            distance, _ = solid_distance(*solid, a[..., None, :] + s[..., None] * (b - a)[..., None, :])
            k = distance.argmin(-1)
            least = np.minimum(least, distance.min(-1))
            step = (high - low) / 16
            middle = np.take_along_axis(s, k[..., None], -1)[..., 0]
            low, high = np.maximum(middle - step, 0), np.minimum(middle + step, 1)
        found = np.minimum(found, (least - arm.capsule_radii[moving]).min(axis=1))
    return found
