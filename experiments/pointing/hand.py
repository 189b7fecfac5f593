"""A hand whose index finger is stretched out: its 21 landmarks and the capsules between them. Lengths are our estimates for an adult."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrcjax.hand import BONES, FINGERS, WRIST

SHAPE = np.array([
    (0.0, 0.0, 0.0),
    (0.025, 0.025, -0.010), (0.050, 0.040, -0.020), (0.075, 0.038, -0.034), (0.092, 0.018, -0.046),
    (0.088, 0.022, 0.0), (0.133, 0.022, 0.0), (0.158, 0.022, 0.0), (0.178, 0.022, 0.0),
    (0.088, 0.0, 0.0), (0.115, 0.0, -0.030), (0.095, 0.0, -0.045), (0.078, 0.0, -0.035),
    (0.082, -0.020, -0.002), (0.106, -0.020, -0.032), (0.088, -0.020, -0.045), (0.072, -0.020, -0.035),
    (0.074, -0.038, -0.005), (0.094, -0.038, -0.030), (0.080, -0.038, -0.040), (0.067, -0.038, -0.032),
])  # fmt: skip
"""Landmarks of a right hand: x along the finger, y to the thumb, z out of the back of the hand; from the wrist [m]."""
INDEX = FINGERS["index"]
TIP = INDEX[-1]
PALM_SIZE = float(np.linalg.norm(SHAPE[9]))
"""Wrist to the base of the middle finger [m]."""
FINGER, THUMB, PALM = 0.008, 0.009, 0.014
"""Radii: of a finger, of the thumb, and half the thickness of the palm [m]."""


class Hand(NamedTuple):
    """Hands, with any leading axes."""

    landmarks: NDArray
    """(... 21 3) in MediaPipe's order [m]."""
    a: NDArray
    """(... bone 3) ends of the bones [m]."""
    b: NDArray
    """(... bone 3) [m]."""
    radius: NDArray
    """(... bone) [m]."""


def radii() -> NDArray:
    """(bone) Radius of each bone's capsule, of a hand of size 1 [m]."""
    return np.array([PALM if a == WRIST else THUMB if b in FINGERS["thumb"] else FINGER for a, b in BONES])


def hand_at(tip: NDArray, R: NDArray, size: NDArray, side: NDArray) -> Hand:
    """Hands whose index tip is at a place.

    Args:
        tip: (... 3) [m].
        R: (... 3 3) columns: along the finger, to the thumb's side of a right hand, out of the back of the hand.
        size: (...) factor of all lengths [1].
        side: (...) 1 of a right hand, -1 of a left one.
    """
    shape = SHAPE * size[..., None, None]
    shape = np.concatenate([shape[..., :1], shape[..., 1:2] * side[..., None, None], shape[..., 2:]], axis=-1)
    landmarks = tip[..., None, :] + np.einsum("...ij,...kj->...ki", R, shape - shape[..., TIP : TIP + 1, :])
    a, b = (landmarks[..., [bone[end] for bone in BONES], :] for end in (0, 1))
    return Hand(landmarks, a, b, radii() * size[..., None])


def frame_of(u: NDArray, roll: NDArray) -> NDArray:
    """(... 3 3) Rotations of hands along directions, back of the hand up but for a roll.

    Args:
        u: (... 3) along the finger [1].
        roll: (...) about it [rad].
    """
    up = np.broadcast_to([0.0, 0.0, 1.0], u.shape) + 1e-3 * np.array([0.0, 1.0, 0.0])
    z = up - np.sum(up * u, axis=-1, keepdims=True) * u
    z /= np.linalg.norm(z, axis=-1, keepdims=True)
    y = np.cross(z, u)
    c, s = np.cos(roll)[..., None], np.sin(roll)[..., None]
    return np.stack([u, c * y + s * z, c * z - s * y], axis=-1)
