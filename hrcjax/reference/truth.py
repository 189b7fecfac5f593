"""The ground truth of a world in NumPy: capsules of arm and person over time, and exact distances between them."""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

from collections.abc import Callable

import mujoco
import numpy as np
from numpy.typing import NDArray

from hrcjax.robot.body import Arm
from hrcjax.world import Person, Scene

FAR = 10.0
"""Distance if there is no object [m]; see `hrcjax.geom.segment`."""
SPHERE, COLUMN = 0, 1
THIRDS = 90
"""Steps of the ternary search along a segment: the remaining interval is (2/3)^90 = 1e-16."""


def arm_axes(arm: Arm, q: NDArray) -> tuple[NDArray, NDArray]:
    """Both ends of the arm's capsules at every time, (time capsule 3) [m], by MuJoCo's kinematics; the base first.

    Args:
        q: (time joint) [rad].
    """
    model = arm.model
    data = mujoco.MjData(model)
    first = int(model.jnt_bodyid[0])
    bodies = [
        int(model.jnt_bodyid[link]) if link >= 0 else int(model.body_parentid[first]) for link in arm.capsule_links
    ]
    a, b = np.empty((2, len(q), len(bodies), 3))
    for k, one in enumerate(q):
        data.qpos[:] = one
        mujoco.mj_kinematics(model, data)
        R, p = data.xmat[bodies].reshape(-1, 3, 3), data.xpos[bodies]
        a[k] = p + (R @ arm.capsule_a[:, :, None])[..., 0]
        b[k] = p + (R @ arm.capsule_b[:, :, None])[..., 0]
    return a, b


def person_axes(person: Person, times: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Both ends of the person's capsules, (time capsule 3) [m], and whether the person is present, (time).

    Linear between frames; held before the first and after the last.
    """
    a, b, present = (np.asarray(v) for v in (person.a, person.b, person.present))
    last = len(a) - 1
    at = np.clip(times * float(person.rate), 0, last)
    low, high = np.floor(at).astype(int), np.ceil(at).astype(int)
    part = (at - low)[:, None, None]
    there = present[low] | present[high]
    return a[low] * (1 - part) + a[high] * part, b[low] * (1 - part) + b[high] * part, there


def nearest_places(a: NDArray, b: NDArray, c: NDArray, d: NDArray) -> tuple[NDArray, NDArray]:
    """Nearest points of the segments a to b and c to d, (... 3), as shares of their lengths [1], by clamping one after the other.

    C. Ericson, Real-Time Collision Detection (2005), 5.1.9.
    """
    u, v, w = b - a, d - c, a - c
    uu, vv, uv = (u * u).sum(-1), (v * v).sum(-1), (u * v).sum(-1)
    uw, vw = (u * w).sum(-1), (v * w).sum(-1)
    point_u, point_v = uu < 1e-24, vv < 1e-24
    uu_, vv_ = np.where(point_u, 1.0, uu), np.where(point_v, 1.0, vv)
    across = uu * vv - uv * uv
    parallel = across <= 1e-12 * uu * vv
    s = np.where(parallel, 0.0, np.clip((uv * vw - uw * vv) / np.where(parallel, 1.0, across), 0, 1))
    t = np.where(point_v, 0.0, (uv * s + vw) / vv_)
    s = np.where(t < 0, -uw / uu_, np.where(t > 1, (uv - uw) / uu_, s))
    t = np.clip(t, 0, 1)
    s = np.clip(np.where(point_v, -uw / uu_, s), 0, 1)
    return np.where(point_u, 0.0, s), t


def segment_gap(a: NDArray, b: NDArray, c: NDArray, d: NDArray) -> NDArray:
    """From the nearest point of the segment a to b to that of the segment c to d, (... 3) [m]."""
    s, t = nearest_places(a, b, c, d)
    return c + t[..., None] * (d - c) - a - s[..., None] * (b - a)


def segment_distance(a: NDArray, b: NDArray, c: NDArray, d: NDArray) -> NDArray:
    """Distance of the segments a to b and c to d, (... 3) [m]."""
    gap = segment_gap(a, b, c, d)
    return np.sqrt((gap * gap).sum(-1))


def person_distances(arm: Arm, person: Person, q: NDArray, times: NDArray) -> NDArray:
    """Distances between the surfaces of the arm's capsules and of the person's, (time capsule other) [m]; FAR where nobody is."""
    a, b = arm_axes(arm, q)
    c, d, there = person_axes(person, times)
    radius = np.asarray(person.radius)
    axes = segment_distance(a[:, :, None], b[:, :, None], c[:, None], d[:, None])
    surfaces = axes - arm.capsule_radii[:, None] - radius
    return np.where(there[:, None, None] & (radius >= 0), surfaces, FAR)


def person_distance(arm: Arm, person: Person, q: NDArray, times: NDArray) -> NDArray:
    """Least distance between the surfaces of the whole arm and of the person at every time [m]; FAR if nobody is present."""
    return person_distances(arm, person, q, times).min(axis=(1, 2))


def approach_speeds(arm: Arm, person: Person, q: NDArray, qd: NDArray, times: NDArray) -> NDArray:
    """Speed of the arm's nearest point towards the person at every time, by MuJoCo's Jacobians [m/s]; 0 if nobody is present."""
    model = arm.model
    data, jacobian = mujoco.MjData(model), np.empty((3, model.nv))
    a, b = arm_axes(arm, q)
    c, d, _ = person_axes(person, times)
    distances = person_distances(arm, person, q, times)
    found = np.zeros(len(q))
    for k, surfaces in enumerate(distances):
        i, j = np.unravel_index(surfaces.argmin(), surfaces.shape)
        link = arm.capsule_links[i]
        if surfaces[i, j] == FAR or link < 0:
            continue
        ends = a[k, i], b[k, i], c[k, j], d[k, j]
        share, gap = nearest_places(*ends)[0], segment_gap(*ends)
        data.qpos[:] = q[k]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        body = int(model.jnt_bodyid[link])
        mujoco.mj_jac(model, data, jacobian, None, a[k, i] + share * (b[k, i] - a[k, i]), body)
        size = np.sqrt((gap * gap).sum())
        found[k] = gap @ (jacobian @ qd[k]) / size if size > 0 else 0.0
    return found


def solid_distance(kind: int, center: NDArray, size: NDArray, yaw: float, x: NDArray) -> NDArray:
    """Signed distance of points (... 3) to an upright solid [m]: a sphere, a cylinder or a box, negative inside."""
    offset = x - center
    if kind == SPHERE:
        return np.sqrt((offset * offset).sum(-1)) - size[0]
    if kind == COLUMN:
        beyond = np.stack([np.hypot(offset[..., 0], offset[..., 1]) - size[0], np.abs(offset[..., 2]) - size[2]], -1)
    else:
        turn = np.array([[np.cos(yaw), np.sin(yaw), 0], [-np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
        beyond = np.abs(offset @ turn.T) - size
    outside = np.sqrt((np.maximum(beyond, 0) ** 2).sum(-1))
    return outside + np.minimum(beyond.max(-1), 0)


def obstacle_distances(arm: Arm, scene: Scene, q: NDArray) -> NDArray:
    """Least signed distance of the moving links' surfaces to every obstacle, (time obstacle) [m]; FAR for masked obstacles.

    The signed distance to a convex solid is convex along a line: its minimum is found by ternary search.
    """
    a, b = (ends[:, 1:] for ends in arm_axes(arm, q))  # without the base, which does not move
    found = np.full((len(q), len(scene.kind)), FAR)
    for k in np.flatnonzero(scene.mask):
        solid = int(scene.kind[k]), np.asarray(scene.center[k]), np.asarray(scene.size[k]), float(scene.yaw[k])
        least = _least(lambda s, solid=solid: solid_distance(*solid, a + s[..., None] * (b - a)), a.shape[:2])
        found[:, k] = (least - arm.capsule_radii[1:]).min(axis=1)
    return found


def _least(at: Callable[[NDArray], NDArray], shape: tuple[int, ...]) -> NDArray:
    """Minima of convex functions on [0, 1]."""
    zero = np.zeros(shape)
    low, high = zero, zero + 1
    for _ in range(THIRDS):
        s, t = low + (high - low) / 3, high - (high - low) / 3
        left = at(s) <= at(t)
        low, high = np.where(left, low, s), np.where(left, t, high)
    return np.minimum(at((low + high) / 2), np.minimum(at(zero), at(zero + 1)))
