"""One depth image as the baseline gets it: measured depth, and where the robot was expected."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.presence import PresenceParams
from hrcjax.presence.background import shows_robot
from hrcjax.presence.sight import least_around
from hrcjax.robot import Arm, arm_capsules
from hrcjax.sense import Camera, NoiseParams
from hrcjax.sense.camera import render_capsules
from hrcjax.sense.noise import measure
from hrcjax.typing import Array, Joints, PRNGKeyArray
from hrcjax.world import Person
from hrcjax.world.person import person_at

PRESENCE = PresenceParams()
"""The robot is told from the rest as in our own sensing: by the depth expected of it."""


class Eye(NamedTuple):
    """A camera in plain numbers."""

    position: NDArray
    """Of the pinhole [m]."""
    rays: NDArray
    """(pixel 3) world direction of every pixel, at depth 1"""


class Frame(NamedTuple):
    """An image."""

    stamp: float
    """Time of the exposure [s]."""
    eye: Eye
    """The camera."""
    depth: NDArray
    """(pixel) measured; 0: nothing [m]"""
    robot: NDArray
    """(pixel) depth before which nothing is the robot; infinite: the robot is not near this pixel [m]"""


def eye_of(camera: Camera) -> Eye:
    """The rays of a camera."""
    cx, cy, fx, fy = (np.asarray(value, float) for value in (camera.cx, camera.cy, camera.fx, camera.fy))
    x, y = (np.arange(camera.width) - cx) / fx, (np.arange(camera.height) - cy) / fy
    grid = np.stack([*np.meshgrid(x, y), np.ones((camera.height, camera.width))], axis=-1).reshape(-1, 3)
    return Eye(np.asarray(camera.position, float), grid @ np.asarray(camera.rotation, float).T)


def exposed(
    arm: Arm,
    camera: Camera,
    scene_depth: Array,
    person: Person,
    q: Joints,
    t: Array,
    key: PRNGKeyArray,
    noise: NoiseParams,
) -> tuple[Array, Array]:
    """Measured depth of an image, and the depth before which nothing is the robot [m]; the images of `watch_image`.

    The robot's pixels are removed as there: not nearer than the expected robot less `robot_margin` and noise. Their depth
    is returned as 0 with the robot's own depth beside it, so that the ray may still be seen through up to the robot.
    """  # fmt: skip
    nothing = jnp.full_like(scene_depth, jnp.inf)
    robot = render_capsules(camera, arm_capsules(arm, q), nothing)
    people = render_capsules(camera, person_at(person, t), nothing)
    depth = measure(jnp.minimum(jnp.minimum(scene_depth, robot), people), camera, key, noise)
    own = shows_robot(PRESENCE, depth, robot)
    near = least_around(robot)
    slack = PRESENCE.robot_margin + PRESENCE.deviations * PRESENCE.pixel_noise * near**2
    return jnp.where(own, 0.0, depth), jnp.where(own & (depth > 0), near - slack, jnp.inf)
