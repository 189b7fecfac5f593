"""The paper's law of motion as a speed along a path: q' = 30 F(q) a second (Robotica 2025, tables I to VII)."""

import jax.numpy as jnp

from hrcjax.plan.descent import STEP_TIME
from hrcjax.plan.params import PotentialParams
from hrcjax.typing import Array, Float, Scalar


def law_speed(params: PotentialParams, remaining: Scalar, ratio: Scalar) -> Float[Array, ""]:
    """Speed of the reference along its path [m/s].

    The attraction K_att min(r, d*), a length per step of 1/30 s, with the way r that remains in place of the distance to the
    goal, which on a straight path it is: the time to goal is that of the tables. Repulsion slows the motion: the speed is divided by
    1 + U_rep / U_att, as an element of the path is weighed by it in the path's cost.

    Args:
        remaining: length of the path not yet travelled [m].
        ratio: U_rep / U_att at this place [1].
    """
    way = jnp.minimum(jnp.asarray(remaining), params.d_star)
    return params.k_att * way / STEP_TIME / (1 + ratio)
