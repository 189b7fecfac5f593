"""Whether the arm draws back while it is stopped for closeness: the motion of its nearest point, where a retreat is possible."""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from hrcjax.reference.truth import person_axes, solid_distance
from hrcjax.robot import Arm
from hrcjax.safety import INVALID_FRAME, MISSING_DATA, OLD_DATA, STOP, TOO_CLOSE
from hrcjax.sim import Cell
from hrcjax.world import Person, Scene

from .bench import Played, on_host

EVERY = 5
"""Of the ticks in stop one in so many is looked at."""
ABLE = 0.05
"""The nearest point can retreat if it can do so at this speed [m/s]."""
JOINT_SPEED = 1.0
"""Largest joint speed in that [rad/s]."""
NEAR = 1.0
"""Other points within this distance of the person must not approach [m]."""
BESIDE = 0.03
"""Points within this distance of the table or of an obstacle must not approach it [m]."""
AT_LIMIT = 0.02
"""Distance from a joint's limit at which it turns back only [rad]."""
AWAY = 1e-3
"""Least speed of a retreat [m/s]."""
HOLD = OLD_DATA | MISSING_DATA | INVALID_FRAME
"""Reasons for which the arm stands still in every direction."""


def control_points(arm: Arm, q: NDArray) -> tuple[NDArray, NDArray]:
    """Places (point 3) [m] and Jacobians (point 3 joint) [m/rad] of the control points, by C MuJoCo."""
    model = arm.model
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    x, J = np.empty((len(arm.control_links), 3)), np.empty((len(arm.control_links), 3, model.nv))
    for k, (link, offset) in enumerate(zip(arm.control_links, arm.control_offsets, strict=True)):
        body = int(model.jnt_bodyid[link])
        x[k] = data.xpos[body] + data.xmat[body].reshape(3, 3) @ offset
        mujoco.mj_jac(model, data, J[k], None, x[k], body)
    return x, J


def from_person(x: NDArray, a: NDArray, b: NDArray, radius: NDArray) -> tuple[NDArray, NDArray]:
    """Distance of points to a person's surface [m], and the unit vectors away from it [1].

    Args:
        x: (point 3) [m].
        a, b: ends of the person's capsules (capsule 3) [m].
        radius: of the capsules; negative: not there [m].
    """
    way = b - a
    square = (way * way).sum(-1)
    share = ((x[:, None] - a) * way).sum(-1) / np.where(square > 0, square, 1.0)
    off = x[:, None] - a - np.clip(share, 0, 1)[..., None] * way
    size = np.linalg.norm(off, axis=-1)
    apart = np.where(radius >= 0, size - radius, np.inf)
    k = apart.argmin(axis=1)
    rows = np.arange(len(x))
    return apart[rows, k], off[rows, k] / np.maximum(size[rows, k], 1e-9)[:, None]


def from_solids(scene: Scene, x: NDArray) -> tuple[NDArray, NDArray]:
    """Distance of points to every obstacle and to the table's plane (solid point) [m], and the unit vectors away (solid point
    3) [1]."""
    distances, normals = [x[:, 2]], [np.broadcast_to([0.0, 0.0, 1.0], x.shape)]
    for k in np.flatnonzero(np.asarray(scene.mask)):
        solid = (
            int(scene.kind[k]),
            np.asarray(scene.center[k], float),
            np.asarray(scene.size[k], float),
            float(scene.yaw[k]),
        )
        step = 1e-5 * np.eye(3)
        slope = np.stack([solid_distance(*solid, x + e) - solid_distance(*solid, x - e) for e in step], axis=-1)
        distances.append(solid_distance(*solid, x))
        normals.append(slope / np.maximum(np.linalg.norm(slope, axis=-1, keepdims=True), 1e-12))
    return np.stack(distances), np.stack(normals)


def best_retreat(arm: Arm, scene: Scene, person: Person, q: NDArray, t: float) -> tuple[float, NDArray]:
    """The fastest retreat of the nearest control point with which nothing near approaches anything [m/s], and the row that
    takes joint speeds to that point's retreat (joint) [m/rad].

    A linear program in the joint speeds. 0 where none exists, or nobody is there.
    """
    x, J = control_points(arm, q)
    a, b, there = person_axes(person, np.asarray([t]))
    if not there[0]:
        return 0.0, np.zeros(len(q))
    apart, away = from_person(x, a[0], b[0], np.asarray(person.radius))
    apart = apart - arm.control_radii
    rows = np.einsum("pk,pkj->pj", away, J)
    nearest = int(apart.argmin())
    keep = [rows[apart < NEAR]]
    distance, normal = from_solids(scene, x)
    close = distance - arm.control_radii < BESIDE
    keep.append(np.einsum("spk,pkj->spj", normal, J)[close])
    A = -np.concatenate(keep)
    low = np.where(q < arm.q_min + AT_LIMIT, 0.0, -JOINT_SPEED)
    high = np.where(q > arm.q_max - AT_LIMIT, 0.0, JOINT_SPEED)
    found = linprog(-rows[nearest], A, np.zeros(len(A)), bounds=np.stack([low, high], axis=1))
    return (-found.fun if found.status == 0 else 0.0), rows[nearest]


def retreat(cell: Cell, scene: Scene, person: Person, played: Played) -> dict[str, Any]:
    """At some ticks in stop, not on hold: what retreat is possible, how fast the nearest point goes away [m/s], and whether
    the person is too close at that moment."""
    host, end = on_host(person), played.end(np.asarray(scene.goal, float)) + 1
    ticks = np.flatnonzero((played.zone[:end] == STOP) & (played.reasons[:end] & HOLD == 0))[::EVERY]
    able, speed = np.zeros(len(ticks)), np.zeros(len(ticks))
    for n, k in enumerate(ticks):
        able[n], row = best_retreat(cell.arm, scene, host, played.q[k].astype(float), float(played.t[k]))
        speed[n] = row @ played.qd[k]
    return {"able": able, "away": speed, "close": played.reasons[ticks] & TOO_CLOSE != 0, "stop_t": played.t[ticks]}
