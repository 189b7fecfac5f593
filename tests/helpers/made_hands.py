"""Hands drawn by hand: a palm, and fingers that are stretched out or folded."""

import numpy as np

BASES = {1: (-0.45, 0.25), 5: (-0.3, 1.0), 9: (-0.1, 1.05), 13: (0.1, 1.0), 17: (0.3, 0.9)}
AIMS = {5: -0.2, 9: -0.03, 13: 0.12, 17: 0.28}


def made_hand(up, angle: float = 0.0, noise: float = 0.0, seed: int = 0) -> np.ndarray:
    """A hand whose four fingers are out where `up` says so (21, 2), turned by an angle [rad]."""
    x = np.zeros((21, 2))
    for k in range(4):
        x[1 + k] = np.array(BASES[1]) + k * np.array([-0.12, 0.14])
    for out, base in zip(up, AIMS, strict=True):
        along = np.array([np.sin(AIMS[base]), np.cos(AIMS[base])])
        steps = (0.0, 0.45, 0.75, 1.0) if out else (0.0, 0.2, -0.05, -0.25)
        for k, step in enumerate(steps):
            x[base + k] = np.array(BASES[base]) + step * along + (0.0 if out else 0.03 * k)
    x += noise * np.random.default_rng(seed).normal(size=x.shape)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return x @ turn.T
