"""The depth cameras of a cell: stationary ones whose views overlap, and one in the robot's hand."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.sense.camera import Camera, d435i
from hrcjax.typing import Matrix3, Vector3
from hrcjax.world.place import path_middle
from hrcjax.world.scene import Scene

EYE = (1.2, 0.7, 1.5)
"""Where stationary cameras are: beside the middle of the path, before it, and above the table [m]."""
TARGET_HEIGHT = 0.3
"""Height above the table of the place that they look at, over the middle of the path [m]."""
HAND_OFFSET = 0.08
"""Distance of the camera in the hand from the tool's axis [m]."""
HAND_BACK = 0.1
"""And behind the tool point [m]."""


class Rig(eqx.Module):
    """Depth cameras with one kind of image."""

    cameras: Camera
    """The stationary cameras, stacked."""
    hand: Camera | None
    """The camera in the hand, in the tool's frame: it looks along the tool's z axis. None: there is none."""
    rates: tuple[float, ...] = eqx.field(static=True)
    """Images of each stationary camera in a second [Hz]."""

    @property
    def count(self) -> int:
        """Number of stationary cameras."""
        return len(self.rates)


def stack_cameras(cameras: list[Camera]) -> Camera:
    """Several cameras as one, with a leading axis."""
    return jax.tree.map(lambda *a: jnp.stack(a), *cameras)


def cell_rig(scene: Scene, cameras: int = 2, rate: float = 15.0, hand: bool = True, decimation: int = 4) -> Rig:
    """The cameras of the papers' cells: two D435i of 15 Hz each whose views overlap (HRI 2025), and an eye in the hand
    (Robotica 2025, section 4).

    The stationary ones look over the robot's shoulders at the path and at whoever stands behind it: from 1.2 m beside the
    middle of the path, 0.7 m before it and 1.5 m above the table. Together they see everything in the arm's reach on its
    working side.

    Args:
        cameras: 1 or 2 stationary ones; the first is on the goal's side.
        rate: of each [Hz].
        hand: whether there is one in the hand.
        decimation: of their 640 x 480 pixels every n-th column and row is kept.

    Raises:
        ValueError: another number of cameras.
    """
    if cameras not in (1, 2):
        raise ValueError(f"{cameras} stationary cameras; accepted: 1 or 2")
    middle = path_middle(scene)
    dtype = middle.dtype
    away = jnp.where(scene.goal[0] >= scene.start[0], 1.0, -1.0).astype(dtype)
    target = jnp.stack([middle[0], middle[1], jnp.asarray(TARGET_HEIGHT, dtype)])
    aside, before, height = EYE
    fixed = []
    for side in (1.0, -1.0)[:cameras]:
        eye = jnp.stack([middle[0] + side * aside * away, middle[1] - before, jnp.asarray(height, dtype)])
        fixed.append(d435i(eye, target, decimation))
    mounted = None
    if hand:
        place = jnp.asarray([HAND_OFFSET, 0.0, -HAND_BACK], dtype)
        mounted = eqx.tree_at(lambda c: (c.rotation, c.position), fixed[0], (jnp.eye(3, dtype=dtype), place))
    return Rig(stack_cameras(fixed), mounted, (rate,) * cameras)


def hand_camera(hand: Camera, R: Matrix3, p: Vector3) -> Camera:
    """The camera in the hand, with the tool at p and R (world from tool)."""
    return eqx.tree_at(lambda c: (c.rotation, c.position), hand, (R @ hand.rotation, p + R @ hand.position))


def exposures(rates: tuple[float, ...], begin: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    """When images are taken from `begin` until before `end`, and by which camera; the cameras alternate.

    Returns:
        times, increasing [s], and indices of the cameras.
    """
    times, index = [], []
    for c, rate in enumerate(rates):
        own = begin + (np.arange(int(np.ceil((end - begin) * rate)) + 1) + c / len(rates)) / rate
        times.append(own[own < end - 1e-9])
        index.append(np.full(len(times[-1]), c))
    order = np.argsort(np.concatenate(times), kind="stable")
    return np.concatenate(times)[order], np.concatenate(index)[order].astype(np.int32)
