"""What the robot knows of the cell: a depth camera, its noise, and the clouds made of its images."""

from hrcjax.sense.camera import Camera, cell_camera, d435i, render_depth
from hrcjax.sense.noise import NoiseParams
from hrcjax.sense.observe import (
    MOVING_CAPACITY,
    STATIC_CAPACITY,
    Frames,
    SenseParams,
    background,
    moving_points,
    sense_sequence,
)

__all__ = [
    "MOVING_CAPACITY", "STATIC_CAPACITY", "Camera", "Frames", "NoiseParams", "SenseParams", "background", "cell_camera", "d435i", "moving_points",
    "render_depth", "sense_sequence",
]  # fmt: skip
