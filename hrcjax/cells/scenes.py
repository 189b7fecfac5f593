"""A scene by its name, or from a file of named shapes; and what cameras make of it."""

from collections.abc import Sequence
from pathlib import Path

import jax

from hrcjax.io.scene_file import is_scene_file, read_scene
from hrcjax.sense.rig import cell_rig
from hrcjax.sim import Cell
from hrcjax.sim.sensed_obstacles import sense_obstacles
from hrcjax.task_space import instances_scene
from hrcjax.world import CAPACITY, Scene, scene_named

OBSTACLES = ("known", "sensed")
"""What the planner is given: the exact shapes, or what the cameras of the set-up make of them."""


def scene_of(name: str, seed: int = 0) -> Scene:
    """The scene of a name, or of a TOML file.

    Raises:
        ValueError: an unknown name, or a file that is no scene.
    """
    return read_scene(Path(name))[0] if is_scene_file(name) else scene_named(name, seed)


def sensed_scenes(cell: Cell, scenes: Sequence[tuple[str, int]]) -> dict[tuple[str, int], Scene]:
    """What the set-up's stationary cameras make of the obstacles of some scenes, all with room for as many as the fullest.

    Args:
        scenes: names and seeds; the seed is that of the noise too.

    Raises:
        ValueError: as `scene_of`, or the start of the task is out of reach.
    """
    found = {}
    for name, seed in scenes:
        scene = scene_of(name, seed)
        cameras = cell_rig(scene, hand=False, decimation=1).cameras
        found[name, seed] = scene, sense_obstacles(cell, scene, cameras, jax.random.key(seed))
    room = max([CAPACITY, *(len(task.instances) for _, task in found.values())])
    return {key: instances_scene(task.instances, scene, task.table, room) for key, (scene, task) in found.items()}
