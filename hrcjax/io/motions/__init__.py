"""Recorded people: motion capture files, with units, axes and joint names."""
