"""Distance of the arm to the octree's obstacles: a distance transform of the occupied voxels, read at the arm's spheres."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from .arm_spheres import ArmSpheres
from .octree import Octree

FAR = 2.0
"""Distance where nothing is occupied [m]."""
HALF_DIAGONAL = float(np.sqrt(3) / 2)
"""Of a voxel with edge 1 [1]."""


class DistanceGrid:
    """Distances to the middles of occupied voxels at the middles of all voxels of a box, read between them linearly."""

    def __init__(self, occupied: NDArray, first: NDArray, edge: float) -> None:
        """
        Args:
            occupied: (x y z).
            first: index of the first voxel, whose corner is `first` times the edge.
            edge: of the voxels [m].
        """
        self.edge, self.first = edge, first
        self.empty = not occupied.any()
        far = np.full(occupied.shape, FAR) if self.empty else np.asarray(distance_transform_edt(~occupied)) * edge
        self.values = far.astype(np.float32)
        self.shape: tuple[int, ...] = occupied.shape

    def distances(self, x: NDArray) -> NDArray:
        """Distances of points (... 3) to the occupied voxels, each taken as the ball about it [m]."""
        if self.empty:
            return np.full(x.shape[:-1], FAR)
        top = np.array(self.shape) - 1
        place = np.clip(x / self.edge - self.first - 0.5, 0, top - 1e-6)
        low = place.astype(int)
        u = place - low
        sy, sx = self.shape[2], self.shape[1] * self.shape[2]
        at = low[..., 0] * sx + low[..., 1] * sy + low[..., 2]
        flat = self.values.ravel()
        found = 0.0
        for i in (0, 1):
            wx = u[..., 0] if i else 1 - u[..., 0]
            for j in (0, 1):
                wxy = wx * (u[..., 1] if j else 1 - u[..., 1])
                corner = at + (i * sx + j * sy)
                found = found + wxy * (flat[corner] * (1 - u[..., 2]) + flat[corner + 1] * u[..., 2])
        return found - HALF_DIAGONAL * self.edge


class CollisionScene:
    """The arm among what the octree holds, the table and itself."""

    def __init__(self, spheres: ArmSpheres, octree: Octree) -> None:
        self.spheres, self.octree = spheres, octree
        self.checks = 0
        self.update()

    def update(self) -> None:
        """Takes over what the octree holds now."""
        self.grid = DistanceGrid(self.octree.occupied, self.octree.first, self.octree.edge)

    def clearance(self, centres: NDArray) -> NDArray:
        """(configuration) distance of the moving links to the octree's obstacles [m]

        Args:
            centres: (configuration sphere 3) of the arm's spheres [m].
        """  # fmt: skip
        moving = self.spheres.moving
        return (self.grid.distances(centres[:, moving]) - self.spheres.radii[moving]).min(1)

    def free(self, q: NDArray, gap: float) -> NDArray:
        """(configuration) whether the arm keeps a gap to obstacles, and is off the table and itself

        Args:
            q: (configuration joint) [rad].
            gap: padding [m].
        """  # fmt: skip
        self.checks += len(q)
        centres = self.spheres.centres(q)
        return self.spheres.at_ease(q, centres) & (self.clearance(centres) > gap)

    def motion_free(self, a: NDArray, b: NDArray, gap: float, step: float) -> bool:
        """Whether the straight motion of the joints from a to b is free at steps of at most `step`; its ends too."""
        count = max(int(np.ceil(np.abs(b - a).max() / step)), 1)
        return bool(self.free(a + np.linspace(0, 1, count + 1)[:, None] * (b - a), gap).all())
