"""Whether the arm can hold its camera where the program lets it look from."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.rotation import look_at, rotation_z
from hrcjax.grasp.reach import OFF, TURNED
from hrcjax.robot import Arm, control_points, inverse_kinematics
from hrcjax.sense.rig import HAND_BACK, HAND_OFFSET

SWINGS = (0.0, 0.7, -0.7)
"""Turns of the shoulder of the guesses [rad]."""


@partial(jax.jit, static_argnums=(0,))
def look_reached(arm: Arm, eye: jax.Array, target: jax.Array) -> jax.Array:
    """True if some turn of the image about the line of sight is reached, within joint limits and above the table.

    Args:
        arm: with the gripper as its tool.
        eye: of the camera [m].
        target: what it looks at [m].
    """
    dtype = eye.dtype
    home = jnp.asarray(arm.home, dtype)
    q_min, q_max = (jnp.asarray(a, dtype) for a in (arm.q_min, arm.q_max))
    mount = jnp.asarray([HAND_OFFSET, 0.0, -HAND_BACK], dtype)

    def sought(turn: jax.Array, swing: jax.Array) -> jax.Array:
        R = look_at(eye, target) @ rotation_z(turn)
        guess = home.at[0].set(home[0] + swing)
        q, off, twist = inverse_kinematics(arm, R, eye - R @ mount, guess)
        height = control_points(arm, q)[:, 2] - jnp.asarray(arm.control_radii, dtype)
        return (off < OFF) & (twist < TURNED) & jnp.all((q > q_min) & (q < q_max)) & jnp.all(height > 0)

    turns = jnp.asarray(np.arange(8) * np.pi / 4, dtype)
    swings = jnp.asarray(SWINGS, dtype)
    return jnp.any(jax.vmap(jax.vmap(sought, in_axes=(None, 0)), in_axes=(0, None))(turns, swings))
