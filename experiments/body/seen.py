"""The points of people in every image of an episode, with the exact person and arm at its moment."""

from functools import cache, cached_property, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.cells.people import make_people
from hrcjax.cells.ur5 import make_cell
from hrcjax.presence.image_points import image_points
from hrcjax.robot import arm_capsules
from hrcjax.sense import no_faults
from hrcjax.sense.rig import cell_rig
from hrcjax.sim import SenseParams
from hrcjax.sim.prepare import Surveyed, frame_stamps, nominal_motion, posture_at, stage_for, survey_world
from hrcjax.sim.watch import Watch, initial_watch, watch_image
from hrcjax.typing import Array
from hrcjax.world import scene_named
from hrcjax.world.person import person_at

SCENE = "robotica"
CAPACITY = 512
"""Points of an image."""
NOMINAL_SHARE = 0.5
"""Share of the episode in which the arm of the images moves from start to goal [1]."""


class Bench:
    """The cell of the papers with two stationary cameras and one in the hand, surveyed once for each seed."""

    def __init__(self, seconds: float) -> None:
        cell = make_cell()
        self.cell = type(cell)(arm=cell.arm, ticks=round(seconds / cell.dt))
        self.sense = SenseParams()
        self._surveyed = cache(self._survey)

    @property
    def duration(self) -> float:
        """Of an episode [s]."""
        return self.cell.ticks * self.cell.dt

    def _survey(self, seed: int) -> Surveyed:
        """The cell after its set-up."""
        scene = scene_named(SCENE, seed)
        nobody = make_people("nobody", scene, seed, self.duration, 1)
        return survey_world(self.cell, scene, nobody, cell_rig(scene), jax.random.key(seed))

    @cached_property
    def _sensed(self) -> Any:
        cell, sense = self.cell, self.sense

        def sensed(known: Surveyed, q: Array, times: Array, cameras: Array, key: Array) -> tuple[Array, Array]:
            robot = jax.vmap(partial(arm_capsules, cell.arm))(q)

            def image(state: Watch, item: tuple) -> tuple[Watch, tuple[Array, Array]]:
                stamp, camera, arm, one = item
                state, good = watch_image(
                    cell.voxels, sense, known.survey, known.stage, state, camera, stamp, arm, one, cell.latency
                )
                cloud = image_points(cell.voxels, state.track, camera, CAPACITY)
                return state, (cloud.points, cloud.mask & good)

            start = initial_watch(cell.voxels, known.survey, times[0])
            items = (times, cameras, robot, jax.random.split(key, times.shape[0]))
            return jax.lax.scan(image, start, items)[1]

        return jax.jit(sensed)

    def seen(self, name: str, seed: int) -> dict[str, np.ndarray]:
        """Points and masks of all images with a seed of noise and motions, stamps, eyes, and the exact capsules of person and arm."""
        scene = scene_named(SCENE, seed)
        rig, person = cell_rig(scene), make_people(name, scene, seed, self.duration, 1)
        before = self._surveyed(seed)
        stage = stage_for(rig, scene, person, no_faults(rig.count, before.q_start.dtype))
        known = Surveyed(before.scene, before.q_start, before.survey, before.field, before.hidden, stage)
        stamps, cameras = frame_stamps(self.cell, rig)
        times = jnp.asarray(stamps, before.q_start.dtype)
        q_goal = posture_at(self.cell, scene.goal)
        q = nominal_motion(before.q_start, q_goal, times, NOMINAL_SHARE * self.duration)
        points, mask = self._sensed(known, q, times, jnp.asarray(cameras), jax.random.key(seed + 1))
        body = jax.vmap(lambda t: person_at(person, t))(times)
        arm = jax.vmap(partial(arm_capsules, self.cell.arm))(q)
        found = {
            "points": points, "mask": mask, "stamps": stamps, "eyes": rig.cameras.position[cameras],
            "a": body.a, "b": body.b, "radius": body.radius, "arm_a": arm.a, "arm_b": arm.b, "arm_radius": arm.radius,
        }  # fmt: skip
        return {key: np.asarray(value) for key, value in found.items()}
