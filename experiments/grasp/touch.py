"""Whether an arm that moves touches object or table: by the exact shapes in C MuJoCo, which the policies do not know."""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from hrcjax.robot import Arm

from .scene import Scene

FAR = 0.3
"""Distances are told apart up to here [m]."""


def least_distances(scene: Scene, R: NDArray, p: NDArray, opening: float) -> NDArray:
    """Least distance of the gripper's boxes from object and table at each of its poses (time) [m]; below 0: they touch.

    Args:
        R: axes of the gripper (time, 3, 3).
        p: its tool point (time, 3) [m].
        opening: between the pads [m].
    """
    model, data = scene.model, mujoco.MjData(scene.model)
    data.qpos[:] = scene.data.qpos
    bodies = {mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name) for name in ("hand", "left", "right")}
    gripper = [g for g in range(model.ngeom) if int(model.geom_bodyid[g]) in bodies]
    table = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "table")
    for name in ("left", "right"):
        data.qpos[model.jnt_qposadr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)]] = opening / 2
    at = model.jnt_qposadr[model.body_jntadr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "hand")]]
    found, fromto = [], np.zeros(6)
    for quat, place in zip(Rotation.from_matrix(R).as_quat()[:, [3, 0, 1, 2]], p, strict=True):
        data.qpos[at : at + 3], data.qpos[at + 3 : at + 7] = place, quat
        mujoco.mj_kinematics(model, data)
        found.append(
            min(
                mujoco.mj_geomDistance(model, data, other, int(g), FAR, fromto)
                for g in gripper
                for other in (table, *(int(k) for k in scene.geoms))
            )
        )
    return np.array(found)


def link_distances(arm: Arm, q: NDArray, centre: NDArray, radius: float) -> NDArray:
    """Least distance of the arm's capsules before the gripper from a ball about the object, and from the table (time) [m].

    Args:
        q: joint positions (time, joint) [rad].
        centre: of the ball [m].
        radius: of the ball [m].
    """
    import jax
    import jax.numpy as jnp

    from hrcjax.robot import arm_capsules

    shown = np.array([name not in ("base", "shoulder", "tool") for name in arm.capsule_names])
    capsules = jax.jit(jax.vmap(lambda one: arm_capsules(arm, one)))(jnp.asarray(q))
    a, b, r = (np.asarray(v, float)[:, shown] for v in (capsules.a, capsules.b, capsules.radius))
    along = b - a
    length = np.maximum(np.sum(along * along, axis=-1), 1e-12)
    share = np.clip(np.sum((centre - a) * along, axis=-1) / length, 0, 1)
    ball = np.linalg.norm(a + share[..., None] * along - centre, axis=-1) - r - radius
    table = np.minimum(a[..., 2], b[..., 2]) - r
    return np.minimum(ball, table).min(axis=1)
