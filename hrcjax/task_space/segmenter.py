"""Detectors of objects in a colour image: the protocol, and what becomes of their boxes and masks."""

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Int, UInt


class Detection(NamedTuple):
    """One object in an image."""

    box: tuple[float, float, float, float]
    """Left, upper, right and lower edge [px]."""
    score: float
    """[1]"""
    name: str
    """What it is."""
    mask: Bool[np.ndarray, "height width"] | None = None
    """Its pixels; None: the detector gives boxes alone."""


@runtime_checkable
class Segmenter(Protocol):
    """Finds objects in a colour image, as a Mask R-CNN does."""

    def __call__(self, colour: UInt[np.ndarray, "height width 3"]) -> list[Detection]:
        """Objects of an image of red, green and blue in 0 to 255."""
        ...


def no_segmenter(colour: UInt[np.ndarray, "height width 3"]) -> list[Detection]:
    """Finds nothing: instances are told by depth alone."""
    return []


def pixel_labels(shape: tuple[int, int], found: list[Detection], least: float = 0.5) -> Int[np.ndarray, "height width"]:
    """Which detection every pixel belongs to: its index, or -1. Where several overlap, the smallest box counts, as the object in
    front or on top; those with a score under `least` don't."""
    labels = np.full(shape, -1)

    def area(one: Detection) -> float:
        return max(one.box[2] - one.box[0], 0.0) * max(one.box[3] - one.box[1], 0.0)

    for k in sorted(range(len(found)), key=lambda k: -area(found[k])):
        one = found[k]
        if one.score < least:
            continue
        left, upper, right, lower = (round(v) for v in one.box)
        window = (slice(max(upper, 0), max(lower, 0)), slice(max(left, 0), max(right, 0)))
        if one.mask is None:
            labels[window] = k
        else:
            labels[one.mask] = k
    return labels
