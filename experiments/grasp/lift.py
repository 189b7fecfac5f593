"""The gripper goes to a grasp along its approach, closes, lifts and holds, in C MuJoCo. Nothing but friction holds the object."""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from .scene import TIMESTEP, Scene

HEIGHT = 0.15
"""Of the lift [m]."""
RISEN = 0.1
"""How far the object's centre must have risen [m]."""
BACK = 0.1
"""Length of the approach [m]."""
SECONDS = {"approach": 0.8, "close": 0.6, "lift": 1.0, "hold": 1.0}
"""Of the stages [s]."""


@dataclass(frozen=True)
class Lifted:
    """What became of a lift."""

    lifted: bool
    """The centre rose by more than RISEN, and both pads hold the object."""
    risen: float
    """How far the centre rose [m]."""
    held: bool
    """Both pads or fingers touch the object at the end."""
    pushed: float
    """How far the object's centre had moved when the fingers began to close: the approach touched it [m]."""
    turned: float
    """How far the object had turned in the hand from the end of closing to the end of holding [rad]."""


def _touching(scene: Scene) -> set[str]:
    """Fingers that touch the object."""
    model, data = scene.model, scene.data
    own = set(scene.geoms.tolist())
    found = set()
    for k in range(data.ncon):
        pair = {int(data.contact.geom1[k]), int(data.contact.geom2[k])}
        if pair & own:
            other = (pair - own).pop() if pair - own else 0
            name = model.body(model.geom_bodyid[other]).name
            if name in ("left", "right"):
                found.add(name)
    return found


def lift(scene: Scene, R: NDArray, p: NDArray, opening: float, watch: Callable[[], None] | None = None) -> Lifted:
    """Plays one lift; the scene's state changes.

    Args:
        R: axes of the gripper in the world.
        p: its tool point at the grasp [m].
        opening: between the pads on the approach [m].
        watch: called after every step, to record.
    """
    model, data = scene.model, scene.data
    hand = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "hand")
    quat = Rotation.from_matrix(R).as_quat()[[3, 0, 1, 2]]
    start = p - BACK * R[:, 2]
    at = model.jnt_qposadr[model.body_jntadr[hand]]
    data.qpos[at : at + 3], data.qpos[at + 3 : at + 7] = start, quat
    for name in ("left", "right"):
        data.qpos[model.jnt_qposadr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)]] = opening / 2
    data.mocap_quat[0] = quat
    data.ctrl[:] = opening / 2
    data.qvel[:] = 0
    first = scene.centre()
    up = np.array([0.0, 0.0, HEIGHT])
    ways = {
        "approach": lambda s: (start + s * (p - start), opening / 2),
        "close": lambda s: (p, opening / 2 * (1 - min(1.5 * s, 1.0))),
        "lift": lambda s: (p + s * s * (3 - 2 * s) * up, 0.0),
        "hold": lambda s: (p + up, 0.0),
    }
    pushed, axes = 0.0, np.eye(3)
    for stage, seconds in SECONDS.items():
        steps = round(seconds / TIMESTEP)
        for k in range(steps):
            data.mocap_pos[0], half = ways[stage]((k + 1) / steps)
            data.ctrl[:] = half
            mujoco.mj_step(model, data)
            if watch is not None:
                watch()
        if stage == "approach":
            pushed = float(np.linalg.norm(scene.centre() - first))
        if stage == "close":
            axes = _in_hand(scene, hand)
    risen = float(scene.centre()[2] - first[2])
    held = _touching(scene) == {"left", "right"}
    turned = float(Rotation.from_matrix(axes.T @ _in_hand(scene, hand)).magnitude())
    return Lifted(risen > RISEN and held, risen, held, pushed, turned)


def _in_hand(scene: Scene, hand: int) -> NDArray:
    """Axes of the object in the hand."""
    R_hand = scene.data.xmat[hand].reshape(3, 3)
    return R_hand.T @ scene.data.xmat[scene.body].reshape(3, 3)
