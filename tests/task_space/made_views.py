"""Views of a table without noise, by the renderer; the truth is the scene."""

import jax.numpy as jnp
import numpy as np

from hrcjax.sense import d435i
from hrcjax.sense.camera import render_scene
from hrcjax.task_space import View, view_of
from hrcjax.world.scenes import Obstacle, make_scene

EYES = ((1.2, -0.2, 1.2), (-0.6, -0.2, 1.2))
TARGET = (0.3, 0.45, 0.0)
UP = np.array([0.0, 0.0, 1.0])


def views_of(things: list[Obstacle], decimation: int = 2, eyes=EYES) -> list[View]:
    scene = make_scene(things, (0.1, 0.7, 0.15), (0.7, 0.3, 0.05), (0.0,) * 3, (1.0,) * 3)
    found = []
    for eye in eyes:
        camera = d435i(jnp.asarray(eye, jnp.float32), jnp.asarray(TARGET, jnp.float32), decimation)
        depth = np.asarray(render_scene(camera, scene))
        images = np.repeat(np.where(np.isfinite(depth), depth, 0)[None], 16, axis=0)  # as sure as the mean of sixteen
        found.append(view_of(camera, images))
    return found
