"""Recorded depth data, frame by frame: RGB-D folders, point clouds and ROS bags. Entry point: `open_input`."""
