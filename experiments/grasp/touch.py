"""Whether an arm that moves touches object or table: by the exact shapes in C MuJoCo, which the policies do not know."""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from hrcjax.robot import Arm, arm_capsules

from .scene import Scene

UNMOVED = ("base", "shoulder", "tool")
"""Capsules that are not judged: what stands whatever the arm does, and what the gripper's boxes stand for."""
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


def link_distances(scene: Scene, xml: str, arm: Arm, q: NDArray) -> NDArray:
    """Least distance of the arm's capsules before the gripper from object and table (time) [m]; below 0: they touch.

    Args:
        xml: of the scene.
        q: joint positions (time, joint) [rad].
    """
    shown = np.array([name not in UNMOVED for name in arm.capsule_names])
    capsules = jax.jit(jax.vmap(lambda one: arm_capsules(arm, one)))(jnp.asarray(q))
    a, b, r = (np.asarray(v, float)[:, shown] for v in (capsules.a, capsules.b, capsules.radius))
    along = b - a
    length = np.linalg.norm(along, axis=-1)
    bodies = "".join(
        f'<body name="link{k}" mocap="true"><geom name="link{k}" type="capsule" size="{r[0, k]} {length[0, k] / 2}"/></body>'
        for k in range(shown.sum())
    )
    model = mujoco.MjModel.from_xml_string(xml.replace("</worldbody>", bodies + "</worldbody>"))
    data = mujoco.MjData(model)
    data.qpos[:] = scene.data.qpos
    links = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, f"link{k}") for k in range(shown.sum())]
    places = [int(model.body_mocapid[model.geom_bodyid[g]]) for g in links]
    table = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "table")
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "object")
    others = [table, *(int(g) for g in np.flatnonzero(model.geom_bodyid == body))]
    found, fromto = [], np.zeros(6)
    for t in range(len(q)):
        for k, place in enumerate(places):
            data.mocap_pos[place] = (a[t, k] + b[t, k]) / 2
            mujoco.mju_quatZ2Vec(data.mocap_quat[place], along[t, k])
        mujoco.mj_kinematics(model, data)
        found.append(min(mujoco.mj_geomDistance(model, data, o, g, FAR, fromto) for g in links for o in others))
    return np.array(found)
