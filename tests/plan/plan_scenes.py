"""The Robotica paper's scene in closed form, for the tests of the planner."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from hrcjax.numerics import safe_norm

PRINTED = np.array([[30, 55, 20], [25, 30, 20], [52, 50, 20], [55, 20, 20]]) / 100.0
START = np.array([10, 70, 15]) / 100.0
GOAL = np.array([70, 30, 5]) / 100.0


class Scene(NamedTuple):
    start: object
    goal: object
    distances: object
    radius: object
    lower: object
    upper: object


def scene(
    kind="spheres", dtype=jnp.float64, centers=PRINTED, radius=0.03, start=START, goal=GOAL, turn=None, shift=0.0
):
    """Balls about the centres, or upright columns from the floor to their height; turned, then shifted if wished."""
    R = np.eye(3) if turn is None else np.asarray(turn)
    R, shift = jnp.asarray(R, dtype), jnp.asarray(shift, dtype)
    c = jnp.asarray(centers, dtype)
    r = jnp.broadcast_to(jnp.asarray(radius, dtype), c.shape[:1])

    def balls(x):
        return safe_norm(R.T @ (x - shift) - c) - r

    def columns(x):
        x = R.T @ (x - shift)
        across = safe_norm((x - c)[:, :2]) - r
        along = jnp.abs(x[2] - c[:, 2] / 2) - c[:, 2] / 2
        outside = safe_norm(jnp.maximum(jnp.stack([across, along], axis=-1), 0))
        return outside + jnp.minimum(jnp.maximum(across, along), 0)

    def place(x):
        return R @ jnp.asarray(x, dtype) + shift

    wide = jnp.full(3, 10.0, dtype)
    return Scene(place(start), place(goal), balls if kind == "spheres" else columns, r, -wide, wide)
