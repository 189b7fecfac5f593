"""Planners of a point, compared in seeded scenes with obstacles on the straight line."""
