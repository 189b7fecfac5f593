"""Obstacles, people and their motion; exact distances."""

from hrcjax.world.motions import MOTIONS, motion_named
from hrcjax.world.person import Person, person_at
from hrcjax.world.recorded import person_from_joints
from hrcjax.world.scene import Scene, capsules_obstacle_distances, obstacle_distances, scene_distance
from hrcjax.world.scenes import SCENES, scene_named

__all__ = [
    "MOTIONS", "SCENES", "Person", "Scene", "capsules_obstacle_distances", "motion_named", "obstacle_distances",
    "person_at", "person_from_joints", "scene_distance", "scene_named",
]  # fmt: skip
