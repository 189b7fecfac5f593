"""Recorded people: files of motion capture, their units, axes and names."""
