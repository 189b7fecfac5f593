"""The 21 landmarks of a hand in an image, in MediaPipe's order."""

import numpy as np

WRIST = 0
LANDMARKS = 21
FINGERS = {
    "thumb": (1, 2, 3, 4),
    "index": (5, 6, 7, 8),
    "middle": (9, 10, 11, 12),
    "ring": (13, 14, 15, 16),
    "little": (17, 18, 19, 20),
}
"""Landmarks of each finger, from its base to its tip."""
PALM = (0, 5, 9, 13, 17)
"""Wrist and bases of the four fingers: they move least against each other."""
BONES = tuple(
    pair for chain in FINGERS.values() for pair in zip((WRIST, *chain), chain, strict=False)
)  # fmt: skip
"""Pairs of landmarks to draw a line between."""

OPEN, CLOSED, POINTING, NONE = range(4)
GESTURES = ("open", "closed", "pointing", "none")
"""Names of the classes; "none" is what resembles no other."""
PAIRS = tuple(zip(*(tuple(int(i) for i in half) for half in np.triu_indices(LANDMARKS, 1)), strict=True))
"""All 210 pairs of landmarks."""
