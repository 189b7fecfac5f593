"""A world of a cell: a scene with people, sensed once, and its arrays for figures."""

from typing import Any

import jax
import jax.numpy as jnp

from hrcjax.cells.people import make_people
from hrcjax.cells.scenes import scene_of
from hrcjax.sense.rig import cell_rig
from hrcjax.sim import Cell, World, make_world
from hrcjax.sweeps.sweepable import Trace
from hrcjax.world import Scene

DESCRIBED = {
    "obstacle_kind": Trace(("obstacle",), "", "0 sphere, 1 column, 2 box"),
    "obstacle_center": Trace(("obstacle", "xyz"), "m", "centre of the obstacle"),
    "obstacle_size": Trace(("obstacle", "xyz"), "m", "half extents; radius first"),
    "obstacle_yaw": Trace(("obstacle",), "rad", "rotation about the vertical axis"),
    "obstacle_mask": Trace(("obstacle",), "", "1 where an obstacle exists"),
    "start": Trace(("xyz",), "m", "start of the path"),
    "goal": Trace(("xyz",), "m", "goal of the path"),
    "person_a": Trace(("frame", "capsule", "xyz"), "m", "one end of the person's capsules"),
    "person_b": Trace(("frame", "capsule", "xyz"), "m", "other end"),
    "person_radius": Trace(("capsule",), "m", "radius"),
}
"""Arrays of a world that are stored once, for figures."""


def describe(world: World) -> dict[str, Any]:
    """The arrays of `DESCRIBED`."""
    scene, person = world.scene, world.person
    return {
        "obstacle_kind": scene.kind,
        "obstacle_center": scene.center,
        "obstacle_size": scene.size,
        "obstacle_yaw": scene.yaw,
        "obstacle_mask": scene.mask.astype(jnp.int8),
        "start": scene.start,
        "goal": scene.goal,
        "person_a": person.a,
        "person_b": person.b,
        "person_radius": jnp.where(jnp.any(person.present), person.radius, -1),
    }


def build_world(cell: Cell, scene_name: str, person_name: str, seed: int, known: Scene | None = None) -> World:
    """One scene with one person or more, sensed.

    Args:
        known: the obstacles that the planner is told of; None: those of the scene.
    """
    scene = scene_of(scene_name, seed)
    person = make_people(person_name, scene, seed, cell.ticks * cell.dt, cell.people)
    return make_world(cell, scene, person, cell_rig(scene), jax.random.key(seed), known=known)
