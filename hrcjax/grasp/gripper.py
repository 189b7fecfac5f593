"""A parallel gripper with two fingers: its sizes, and its body as spheres.

Frame: x along the breadth of the fingers, y along which they close, z out of the palm; the tool point is between the
middles of the pads.
"""

from dataclasses import dataclass

import numpy as np

COVER = 1.2
"""Radius of a finger's spheres over half its thickness: they stand out of its faces by as little as its corners stand out of them [1]."""


@dataclass(frozen=True)
class Gripper:
    """Sizes of a gripper. Defaults: about a Robotiq 2F-85."""

    stroke: float = 0.085
    """Greatest opening between the pads [m]."""
    pad: tuple[float, float] = (0.011, 0.011)
    """Half sizes of a pad along x and z [m]."""
    thickness: float = 0.01
    """Of a finger, along y [m]."""
    length: float = 0.05
    """From the palm to the tool point [m]."""
    palm: tuple[float, float, float] = (0.02, 0.06, 0.03)
    """Half sizes of the palm along x, y and z [m]."""
    force: float = 40.0
    """Limit of the force of each finger's actuator [N]."""
    friction: float = 0.8
    """Of the pads, as of rubber [1]."""

    def spheres(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Spheres that stand for the body: centres with the fingers closed [m], by what share of half the opening each moves
        along y [1], and radii [m]. The fingers' corners stand out of them by half a finger's thickness or less; of the palm its
        front is there."""
        half = self.thickness / 2
        z = np.linspace(self.pad[1] - half, -self.length, 1 + round((self.pad[1] - half + self.length) / (1.4 * half)))
        x = np.linspace(-self.pad[0] + half, self.pad[0] - half, 3)
        grid = np.array([[a, half, c] for a in x for c in z])
        fingers = np.concatenate([grid * [1, side, 1] for side in (1.0, -1.0)])
        moved = np.repeat([1.0, -1.0], len(grid))
        big = self.palm[0] / 2
        y = np.linspace(-self.palm[1] + big, self.palm[1] - big, 7)
        palm = np.array([[a, b, -self.length - big] for a in (-big, big) for b in y])
        centres = np.concatenate([fingers, palm])
        radii = np.concatenate([np.full(len(fingers), COVER * half), np.full(len(palm), big)])
        return centres, np.concatenate([moved, np.zeros(len(palm))]), radii
