"""What the robot knows of the cell: a depth camera, its noise, and the clouds made of its images."""

from hrcjax.sense.camera import Camera, cell_camera, d435i, render_depth
from hrcjax.sense.noise import NoiseParams

__all__ = ["Camera", "NoiseParams", "cell_camera", "d435i", "render_depth"]
