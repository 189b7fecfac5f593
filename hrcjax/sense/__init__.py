"""The depth camera, its noise, point clouds, and what the camera delivers of a world."""

from hrcjax.sense.camera import Camera, cell_camera, d435i
from hrcjax.sense.observe import Frames, SenseParams, sense_sequence

__all__ = ["Camera", "Frames", "SenseParams", "cell_camera", "d435i", "sense_sequence"]
