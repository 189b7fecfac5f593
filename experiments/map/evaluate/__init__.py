"""Accuracy of a map: generated worlds with exact distances, other methods on the same data, recorded frames."""
