"""How hard an object in the hand can be pulled until it is lost: a measure of a grasp that does not end at "lifted"."""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

import mujoco
import numpy as np

from .lift import touching
from .scene import TIMESTEP, Scene

LADDER = tuple(float(v) for v in 2.0 ** (1 + np.arange(11) / 2))
"""Forces in turn, over the object's weight: 2 to 64, each by a factor of 1.4 more [1]."""
SECONDS = 0.06
"""For which a force acts along each direction [s]."""
SLIPPED = 0.02
"""Distance that the object's centre moves in the hand when it counts as lost [m]."""


def pull(scene: Scene) -> float:
    """The largest force, over the weight, that an object held after a lift bears along all six axes of the hand, one after the
    other, at its centre of mass; 0: not even twice its weight, or it isn't held. The scene's state changes."""
    model, data = scene.model, scene.data
    hand = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "hand")
    if touching(scene) != {"left", "right"}:
        return 0.0
    weight = float(model.body_mass[scene.body]) * 9.81

    def place() -> np.ndarray:
        return data.xmat[hand].reshape(3, 3).T @ (scene.centre() - data.xpos[hand])

    start, borne = place(), 0.0
    for times in LADDER:
        for axis in np.concatenate([np.eye(3), -np.eye(3)]):
            data.xfrc_applied[scene.body, :3] = times * weight * (data.xmat[hand].reshape(3, 3) @ axis)
            for _ in range(round(SECONDS / TIMESTEP)):
                mujoco.mj_step(model, data)
            if touching(scene) != {"left", "right"} or np.linalg.norm(place() - start) > SLIPPED:
                return borne
        borne = times
    return borne
