"""Recorded depth data, frame by frame: RGB-D folders, point clouds and ROS bags. Begin at `open_input`."""
