"""What is in the cell: scenes of obstacles, people and their motion, and the exact distances to them."""

from hrcjax.world.motions import MOTIONS, motion_named
from hrcjax.world.person import Person, person_at, together
from hrcjax.world.recorded import person_from_joints
from hrcjax.world.scene import (
    Scene,
    capsules_obstacle_distances,
    capsules_scene_distance,
    first_obstacles,
    obstacle_distances,
    scene_distance,
)
from hrcjax.world.scenes import CAPACITY, SCENES, clutter, hri, robotica, scene_named

__all__ = [
    "CAPACITY", "MOTIONS", "SCENES", "Person", "Scene", "capsules_obstacle_distances", "capsules_scene_distance", "clutter", "first_obstacles", "hri",
    "motion_named", "obstacle_distances", "person_at", "person_from_joints", "robotica", "scene_distance", "scene_named",
    "together",
]  # fmt: skip
