"""Rotations, segments, shapes, rays, point clouds, and the geometry of a path of waypoints."""
