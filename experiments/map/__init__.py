"""A recording into a map: the parts of `python -m experiments.map`."""
