"""The set-up motion: the arm shows the cell to the camera in its hand, and makes way for the stationary ones."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.rotation import rotation_vector
from hrcjax.robot import Arm, inverse_kinematics, tool_frame
from hrcjax.typing import Array, Float, Joints
from hrcjax.world import Scene
from hrcjax.world.place import path_middle

LOOKS = ((0.45, 0.62, -0.6), (0.3, 0.6, 0.5))
"""Passes of the scan: distance of the tool from the base's axis [m], its height [m], and how far the view tilts towards
the base [rad]: outwards first, then back."""
TURNS = np.linspace(-1.3, 1.3, 6)
"""Azimuths of each pass, from the middle of the path [rad]."""
POSE_ERROR = (0.02, 0.05)
"""A look that the arm misses by more than this is left out: position [m], rotation [rad]."""


def scan_postures(arm: Arm, scene: Scene, q_start: Joints) -> Float[Array, "look joint"]:
    """Postures of the scan, in order; the last one is the start of the task. Looks out of reach are left out [rad]."""
    middle = path_middle(scene)
    ahead = float(jnp.arctan2(middle[1], middle[0]))
    looks = []
    for k, (distance, height, tilt) in enumerate(LOOKS):
        turns = TURNS if k % 2 == 0 else TURNS[::-1]
        looks += [(distance, height, tilt, ahead + turn) for turn in turns]
    q, position, rotation = _solve(arm, jnp.asarray(looks, q_start.dtype))
    beyond = np.max(np.maximum(np.asarray(q) - arm.q_max, arm.q_min - np.asarray(q)), axis=1)
    reached = (np.asarray(position) < POSE_ERROR[0]) & (np.asarray(rotation) < POSE_ERROR[1]) & (beyond <= 0)
    return _without_turns(arm, jnp.concatenate([q[np.flatnonzero(reached)], q_start[None]]))


def _without_turns(arm: Arm, postures: Float[Array, "look joint"]) -> Float[Array, "look joint"]:
    """The same postures, joints turned by whole turns so that they move least up to the last one, as far as their ranges allow."""
    q = np.array(postures)
    for k in reversed(range(len(q) - 1)):
        other = q[k] + 2 * np.pi * np.round((q[k + 1] - q[k]) / (2 * np.pi))
        q[k] = np.where((other >= arm.q_min) & (other <= arm.q_max), other, q[k])
    return jnp.asarray(q, postures.dtype)


@partial(jax.jit, static_argnums=0)
def _solve(arm: Arm, looks: Float[Array, "look 4"]) -> tuple[Float[Array, "look joint"], Array, Array]:
    """Joint positions of looks (distance, height, tilt, azimuth), and the errors of position [m] and rotation [rad]."""
    home = jnp.asarray(arm.home, looks.dtype)
    _, p_home = tool_frame(arm, home)

    def one(look: Float[Array, "4"]) -> tuple[Array, Array, Array]:
        distance, height, tilt, angle = look
        side, back = jnp.sin(angle), jnp.cos(angle)
        yaw = angle - jnp.arctan2(p_home[1], p_home[0])
        guess = home.at[0].add(jnp.arctan2(jnp.sin(yaw), jnp.cos(yaw)))
        R_down, _ = tool_frame(arm, guess)
        R = rotation_vector(tilt * jnp.stack([-side, back, jnp.zeros_like(side)])) @ R_down
        return inverse_kinematics(arm, R, jnp.stack([distance * back, distance * side, height]), guess)

    return jax.vmap(one)(looks)
