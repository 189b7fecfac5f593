"""The cameras of an episode: the images of our own sensing, with the arm where it is, delivered after the latency."""

from collections import deque
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.robot import tool_frame
from hrcjax.sense import Camera, NoiseParams
from hrcjax.sense.camera import render_scene
from hrcjax.sense.rig import Rig, hand_camera
from hrcjax.sim import Cell
from hrcjax.sim.own_sensing import tick_images
from hrcjax.sim.scan import scan_postures
from hrcjax.typing import PRNGKeyArray
from hrcjax.world import Person, Scene, motion_named

from .frame import Frame, exposed, eye_of

STILL_IMAGES = 10
"""Images of each camera before anyone comes, where nothing stands on the table."""


class Cameras:
    """Takes the images of one episode."""

    def __init__(
        self, cell: Cell, scene: Scene, rig: Rig, person: Person, key: PRNGKeyArray, noise: NoiseParams | None = None
    ) -> None:  # fmt: skip
        """
        Args:
            key: of the noise; images of the same key in the same tick have the same noise as in `episode_own`.
        """
        self.cell, self.scene, self.rig, self.person = cell, scene, rig, person
        self.early, _, self.times, self.which = tick_images(cell, rig.rates)
        self.set_up_key = jax.random.fold_in(key, 1)
        self.keys = jax.random.split(key, len(self.early) + cell.ticks)
        self.dtype = scene.start.dtype
        noise = NoiseParams() if noise is None else noise
        arm = cell.arm
        self._image = jax.jit(partial(exposed, arm))
        self._render = jax.jit(render_scene)
        self._hand = jax.jit(lambda hand, q: hand_camera(hand, *tool_frame(arm, q)))
        self.noise = noise
        self.stationary = [jax.tree.map(lambda a, k=k: a[k], rig.cameras) for k in range(rig.count)]
        self.standing = [self._render(camera, scene) for camera in self.stationary]
        self.eyes = [eye_of(camera) for camera in self.stationary]
        self._sent: deque[Frame] = deque()

    def set_up(self, q_start: NDArray) -> list[Frame]:
        """Images of the cell before anyone comes: as in our own set-up, in the postures of its scan and with the camera in the
        hand, where something stands on the table; else a few with the arm at its start."""  # fmt: skip
        nobody = motion_named("nobody", self.scene)
        frames = []
        if not bool(jnp.any(self.scene.mask)):
            keys = jax.random.split(self.set_up_key, STILL_IMAGES * self.rig.count)
            for k, key in enumerate(keys):
                frames.append(self._frame(k % self.rig.count, jnp.asarray(q_start, self.dtype), -1.0, key, nobody))
            return frames
        postures = scan_postures(self.cell.arm, self.scene, jnp.asarray(q_start, self.dtype))
        keys = jax.random.split(self.set_up_key, (len(postures), self.rig.count + 1))
        for q, row in zip(postures, keys, strict=True):
            frames += [self._frame(c, q, -1.0, row[c], nobody) for c in range(self.rig.count)]
            if self.rig.hand is not None:
                camera = self._hand(self.rig.hand, q)
                image = self._image(
                    camera, self._render(camera, self.scene), nobody, q, self._time(-1.0), row[-1], self.noise
                )
                frames.append(Frame(-1.0, eye_of(camera), *(np.asarray(x, float).ravel() for x in image)))
        return frames

    def _time(self, t: float) -> jax.Array:
        return jnp.asarray(t, self.dtype)

    def _frame(self, camera: int, q: jax.Array, t: float, key: PRNGKeyArray, person: Person) -> Frame:
        eye: Camera = self.stationary[camera]
        image = self._image(eye, self.standing[camera], person, q, self._time(t), key, self.noise)
        return Frame(t, self.eyes[camera], *(np.asarray(x, float).ravel() for x in image))

    def expose(self, tick: int, q: NDArray) -> None:
        """Takes the image of a tick, if there is one, with the arm where it is [rad]."""
        camera = int(self.which[tick])
        if camera >= 0:
            noise_key, _ = jax.random.split(self.keys[len(self.early) + tick])  # the first key is the noise's there too
            q_now = jnp.asarray(q, self.dtype)
            self._sent.append(self._frame(camera, q_now, float(self.times[tick]), noise_key, self.person))

    def arrived(self, t: float) -> list[Frame]:
        """Images that have arrived by now and were not handed out before."""
        frames = []
        while self._sent and self._sent[0].stamp <= t - self.cell.latency:
            frames.append(self._sent.popleft())
        return frames
