"""Views of a simulated scene: several noisy images of every camera, with the arm in the way or without it."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.capsules import Capsules
from hrcjax.sense import Camera, NoiseParams
from hrcjax.sense.camera import render_capsules, render_scene
from hrcjax.sense.noise import measure
from hrcjax.task_space.view import View, view_of
from hrcjax.typing import Array, Float, Int, PRNGKeyArray
from hrcjax.world import Scene

MARGIN = 3
"""Pixels about the arm's outline that are left out too: those at its edge may fly [px]."""


@jax.jit
def _exact(camera: Camera, scene: Scene) -> Float[Array, "height width"]:
    return render_scene(camera, scene)


@jax.jit
def _noisy(
    camera: Camera, exact: Float[Array, "height width"], keys: Array, noise: NoiseParams
) -> Float[Array, "image height width"]:
    return jax.lax.map(lambda key: measure(exact, camera, key, noise), keys)


@partial(jax.jit, static_argnums=4)
def _behind_arm(
    camera: Camera, exact: Float[Array, "height width"], arm: Capsules, keys: Array, margin: int, noise: NoiseParams
) -> Float[Array, "image height width"]:  # fmt: skip
    """One image for every posture, without the pixels of the arm."""

    def one(item: tuple[Capsules, PRNGKeyArray]) -> Array:
        capsules, key = item
        robot = render_capsules(camera, capsules, jnp.full_like(exact, jnp.inf))
        depth = measure(jnp.minimum(exact, robot), camera, key, noise)
        window: tuple[Int[Array, ""] | int, ...] = (2 * margin + 1, 2 * margin + 1)
        least = jax.lax.reduce_window(robot, jnp.inf, jax.lax.min, window, (1, 1), "SAME")
        return jnp.where(jnp.isfinite(least), 0, depth)

    return jax.lax.map(one, (arm, keys))


def exact_depths(cameras: Camera, scene: Scene) -> list[np.ndarray]:
    """Depth images without noise of some stacked cameras; infinity where nothing is hit [m]."""
    count = cameras.position.shape[0]
    return [np.asarray(_exact(jax.tree.map(lambda a, c=c: a[c], cameras), scene)) for c in range(count)]


def simulated_views(
    cameras: Camera,
    scene: Scene,
    key: PRNGKeyArray,
    images: int = 16,
    noise: NoiseParams | None = None,
    arm: Capsules | None = None,
) -> list[View]:
    """A view of each of some stacked cameras on a still scene.

    Args:
        images: of every camera [1].
        noise: of the cameras.
        arm: of several postures, as a leading axis: one image is taken with the arm in each, without the pixels that it covers,
            and `images` does not count.
    """
    noise = NoiseParams() if noise is None else noise
    views = []
    for c in range(cameras.position.shape[0]):
        camera = jax.tree.map(lambda a, c=c: a[c], cameras)
        exact = _exact(camera, scene)
        own = jax.random.fold_in(key, c)
        if arm is None:
            taken = _noisy(camera, exact, jax.random.split(own, images), noise)
        else:
            keys = jax.random.split(own, arm.radius.shape[0])
            taken = _behind_arm(camera, exact, arm, keys, MARGIN, noise)
        views.append(view_of(camera, np.asarray(taken), noise))
    return views
