"""A serial chain of hinges as plain constants, read from a compiled MuJoCo model."""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

from dataclasses import dataclass

import mujoco
import numpy as np

EXACT = 1e-12
"""Rounding below this, relative to the largest entry, is taken out, so that right angles are exact and cost nothing."""


@dataclass(frozen=True, eq=False)
class Chain:
    """A serial chain of n hinges. Constant and hashable by identity: close over it, do not batch it.

    Joint frame i has its origin on the axis of joint i and its z axis along it; it moves with the link that joint i
    drives. From joint frame i-1 to joint frame i: move by `pos[i]`, turn by `rotation[i]`, turn by q[i] about z.
    Frame -1 is the world.
    """

    pos: np.ndarray
    """(joint 3) origin of joint frame i in joint frame i-1 [m]"""
    rotation: np.ndarray
    """(joint 3 3) axes of joint frame i in joint frame i-1 at q = 0"""
    mass: np.ndarray
    """(joint) [kg]"""
    com: np.ndarray
    """(joint 3) centre of mass in the joint frame [m]"""
    inertia: np.ndarray
    """(joint 3 3) inertia about the centre of mass, in the axes of the joint frame [kg m^2]"""
    link_pos: np.ndarray
    """(joint 3) origin of the link's own frame, the body frame of the model, in the joint frame [m]"""
    link_rotation: np.ndarray
    """(joint 3 3) axes of the link's own frame in the joint frame"""
    gravity: np.ndarray
    """(3) acceleration of free fall in the world [m/s^2]"""
    damping: np.ndarray
    """(joint) viscous friction [N m s/rad]"""
    armature: np.ndarray
    """(joint) inertia of the rotor as seen at the joint [kg m^2]"""

    @property
    def size(self) -> int:
        """Number of joints."""
        return len(self.mass)


def _exact(x: np.ndarray) -> np.ndarray:
    """x without the compiler's rounding: entries far below the largest are 0, those next to 1 or -1 are 1 or -1."""
    x = np.where(np.abs(x) < EXACT * np.max(np.abs(x)), 0.0, x)
    return np.where(np.abs(np.abs(x) - 1) < EXACT, np.sign(x), x)


def _matrix(quat: np.ndarray) -> np.ndarray:
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, np.asarray(quat, np.float64))
    return flat.reshape(3, 3)


def _skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def _turn_z_onto(axis: np.ndarray) -> np.ndarray:
    """The smallest rotation that takes the z axis to `axis`: right angles become signed permutations."""
    axis = axis / np.linalg.norm(axis)
    v, c = np.array([-axis[1], axis[0], 0.0]), axis[2]
    if c < -1 + EXACT:
        return np.diag([1.0, -1.0, -1.0])
    return np.eye(3) + _skew(v) + _skew(v) @ _skew(v) / (1 + c)


def _turn_about_z(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _check(model: mujoco.MjModel) -> None:
    hinge = int(mujoco.mjtJoint.mjJNT_HINGE)
    faults = {
        "has no joints": model.njnt == 0,
        "has joints other than hinges": bool(np.any(model.jnt_type != hinge)),
        "has joint springs": bool(np.any(model.jnt_stiffness) or np.any(model.jnt_stiffnesspoly)),
        "has nonlinear joint damping": bool(np.any(model.dof_dampingpoly)),
        "has dry friction in joints": bool(np.any(model.dof_frictionloss)),
        "has gravity compensation": bool(np.any(model.body_gravcomp)),
        "has tendons": model.ntendon > 0,
        "has equality constraints": model.neq > 0,
        "moves in a fluid": model.opt.density > 0 or model.opt.viscosity > 0,
    }
    for fault, present in faults.items():
        if present:
            raise ValueError(
                f"the model {fault}; accepted: one serial chain of hinges with linear damping and armature"
            )
    moving = [b for b in range(1, model.nbody) if model.body_jntnum[b] > 0]
    for previous, body in zip([0, *moving], moving, strict=False):
        if model.body_weldid[model.body_parentid[body]] != previous:
            raise ValueError(
                f"the model is a tree: it branches before body {body}; accepted: one serial chain of hinges"
            )


def chain_from_mujoco(model: mujoco.MjModel) -> Chain:
    """The chain of a model that is one series of hinges; welded bodies are merged into the link that carries them.

    Only the smooth dynamics are taken over: joint limits, contacts and actuators are not part of a chain. A body with
    several hinges gives as many links, all but the last without mass.

    Raises:
        ValueError: the model is a tree, or has slides, ball or free joints, springs, dry friction, tendons, equalities.
    """
    _check(model)
    n = model.njnt
    R, p = [np.eye(3)], [np.zeros(3)]  # body frames in the world, all joints at their reference
    for body in range(1, model.nbody):
        parent = model.body_parentid[body]
        p.append(p[parent] + R[parent] @ model.body_pos[body])
        R.append(R[parent] @ _matrix(model.body_quat[body]))

    carriers = model.jnt_bodyid
    axes = [R[b] @ _turn_z_onto(model.jnt_axis[i]) for i, b in enumerate(carriers)]
    anchors = [p[b] + R[b] @ model.jnt_pos[i] for i, b in enumerate(carriers)]

    mass, moment, about_anchor = np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3, 3))
    for body in range(1, model.nbody):
        weld = model.body_weldid[body]
        if weld == 0:
            continue
        link = int(model.body_jntadr[weld] + model.body_jntnum[weld] - 1)
        m = model.body_mass[body]
        c = axes[link].T @ (p[body] + R[body] @ model.body_ipos[body] - anchors[link])
        turned = axes[link].T @ R[body] @ _matrix(model.body_iquat[body])
        mass[link] += m
        moment[link] += m * c
        about_anchor[link] += turned @ np.diag(model.body_inertia[body]) @ turned.T - m * _skew(c) @ _skew(c)
    com = np.where(mass[:, None] > 0, moment / np.where(mass > 0, mass, 1)[:, None], 0.0)
    about_com = np.stack([about_anchor[i] + mass[i] * _skew(com[i]) @ _skew(com[i]) for i in range(n)])

    before = [(np.eye(3), np.zeros(3)), *zip(axes, anchors, strict=True)]
    off = bool(model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_GRAVITY))
    return Chain(
        pos=_exact(np.stack([Q.T @ (anchors[i] - o) for i, (Q, o) in enumerate(before[:n])])),
        rotation=_exact(
            np.stack([Q.T @ axes[i] @ _turn_about_z(-model.qpos0[i]) for i, (Q, _) in enumerate(before[:n])])
        ),
        mass=mass,
        com=_exact(com),
        inertia=np.stack([_exact((A + A.T) / 2) for A in about_com]),
        link_pos=_exact(np.stack([axes[i].T @ (p[b] - anchors[i]) for i, b in enumerate(carriers)])),
        link_rotation=_exact(np.stack([axes[i].T @ R[b] for i, b in enumerate(carriers)])),
        gravity=np.zeros(3) if off else np.array(model.opt.gravity),
        damping=np.array(model.dof_damping).reshape(n),
        armature=np.array(model.dof_armature).reshape(n),
    )
