"""Sensing: a depth camera, its noise, and point clouds from its images."""

from hrcjax.sense.camera import Camera, cell_camera, d435i, render_depth
from hrcjax.sense.noise import NoiseParams

__all__ = ["Camera", "NoiseParams", "cell_camera", "d435i", "render_depth"]
