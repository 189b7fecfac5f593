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
    settled: float
    """How far the object turned while the fingers closed: it gives way until it fits between the pads [rad]."""
    turned: float
    """How far the object had turned in the hand from the end of closing to the end of holding [rad]."""


def touching(scene: Scene) -> set[str]:
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


def lift(
    scene: Scene, R: NDArray, p: NDArray, opening: float, approach: float = 0.1, watch: Callable[[], None] | None = None,
    came: tuple[NDArray, NDArray] | None = None,
) -> Lifted:  # fmt: skip
    """Plays one lift; the scene's state changes.

    Args:
        R: axes of the gripper in the world.
        p: its tool point at the grasp [m].
        opening: between the pads on the approach [m].
        approach: length of the straight approach [m].
        came: axes (time, 3, 3) and tool points (time, 3) [m] of the gripper on its way, which ends at R and p, spread over the time of the
            approach; None: the straight approach.
        watch: called after every step, to record.
    """
    model, data = scene.model, scene.data
    hand = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "hand")
    turns, places = (R[None], np.array([p - approach * R[:, 2], p])) if came is None else came
    quats = Rotation.from_matrix(turns).as_quat()[:, [3, 0, 1, 2]]
    quat, start = quats[0], places[0]
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
        "approach": lambda s: (_between(places, s), opening / 2),
        "close": lambda s: (p, opening / 2 * (1 - min(1.5 * s, 1.0))),
        "lift": lambda s: (p + s * s * (3 - 2 * s) * up, 0.0),
        "hold": lambda s: (p + up, 0.0),
    }
    pushed, settled, axes, before = 0.0, 0.0, np.eye(3), np.eye(3)
    for stage, seconds in SECONDS.items():
        steps = round(seconds / TIMESTEP)
        for k in range(steps):
            data.mocap_pos[0], half = ways[stage]((k + 1) / steps)
            if stage == "approach":
                data.mocap_quat[0] = quats[round((k + 1) / steps * (len(quats) - 1))]
            data.ctrl[:] = half
            mujoco.mj_step(model, data)
            if watch is not None:
                watch()
        if stage == "approach":
            pushed, before = float(np.linalg.norm(scene.centre() - first)), _in_hand(scene, hand)
        if stage == "close":
            axes = _in_hand(scene, hand)
            settled = _angle(before, axes)
    risen = float(scene.centre()[2] - first[2])
    held = touching(scene) == {"left", "right"}
    return Lifted(risen > RISEN and held, risen, held, pushed, settled, _angle(axes, _in_hand(scene, hand)))


def _between(places: NDArray, share: float) -> NDArray:
    """The place after a share of the time of a way."""
    at = share * (len(places) - 1)
    k = min(int(at), len(places) - 2)
    return places[k] + (at - k) * (places[k + 1] - places[k])


def _angle(a: NDArray, b: NDArray) -> float:
    """Of the turn from one set of axes to another [rad]."""
    return float(Rotation.from_matrix(a.T @ b).magnitude())


def _in_hand(scene: Scene, hand: int) -> NDArray:
    """Axes of the object in the hand."""
    R_hand = scene.data.xmat[hand].reshape(3, 3)
    return R_hand.T @ scene.data.xmat[scene.body].reshape(3, 3)
