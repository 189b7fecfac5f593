"""Rotations, segments, shapes, rays and point clouds."""
