"""What the cameras have seen, as an occupancy octree: OctoMap with log-odds, free space along every ray, and clamping."""

# pyright: reportMissingImports=false
# pyoctomap is compiled and an extra

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .frame import Frame
from .settings import BaselineSettings

try:
    import pyoctomap as _octomap
except ImportError:  # told once by the run
    _octomap = None
octomap: Any = _octomap

LOWER, UPPER = (-1.05, -1.05, 0.0), (1.05, 1.05, 1.2)
"""Corners of the box that is mapped: everything that the arm reaches [m]."""
BIN = 0.1
"""Rays that end at the robot are inserted together where their lengths differ by less than this [m]."""


def installed() -> bool:
    """Whether OctoMap is there."""
    return octomap is not None


class Octree:
    """An OctoMap, and the voxels in it that are occupied."""

    def __init__(self, settings: BaselineSettings) -> None:
        self.edge, self.margin = settings.resolution, settings.table_margin
        self.tree = octomap.OcTree(settings.resolution)
        self.tree.setProbHit(settings.hit)
        self.tree.setProbMiss(settings.miss)
        self.tree.setClampingThresMin(settings.clamp[0])
        self.tree.setClampingThresMax(settings.clamp[1])
        # Voxels have the tree's lattice: their corners are multiples of the edge.
        self.first = np.floor(np.array(LOWER) / self.edge).astype(int)
        self.shape = tuple(np.ceil(np.array(UPPER) / self.edge).astype(int) - self.first)
        self.hit = np.zeros(self.shape, bool)
        self._occupied = np.zeros(self.shape, bool)

    def insert(self, frame: Frame) -> None:
        """Takes an image in: rays are cut off behind the box, and carve it up to the robot where they end there."""
        ends = self._box_ends(frame)
        seen = (frame.depth > 0) & (ends[0] < np.minimum(frame.depth, ends[1]))
        beyond = ends[1] + 2 * self.edge / np.linalg.norm(frame.eye.rays, axis=1)
        reach = np.minimum(frame.depth, beyond)[seen, None]
        points = frame.eye.position + reach * frame.eye.rays[seen]
        self._carve_to_robot(frame, ends)
        if len(points):
            self.tree.insertPointCloud(np.ascontiguousarray(points), frame.eye.position, -1.0, True, True)
        self._note(points[frame.depth[seen] <= ends[1][seen]])

    def _box_ends(self, frame: Frame) -> tuple[NDArray, NDArray]:
        """Depths at which every ray enters and leaves the box; the first above the second: it passes by [m]."""
        with np.errstate(divide="ignore", invalid="ignore"):
            one, two = ((np.array(side) - frame.eye.position) / frame.eye.rays for side in (LOWER, UPPER))
        return np.maximum(np.minimum(one, two).max(1), 0.0), np.maximum(one, two).min(1)

    def _carve_to_robot(self, frame: Frame, ends: tuple[NDArray, NDArray]) -> None:
        """Free space on rays that end at the robot: OctoMap marks no end beyond the largest range, so rays of one length at a
        time."""
        own = np.isfinite(frame.robot) & (ends[0] < np.minimum(frame.robot, ends[1]))
        lengths = frame.robot[own] * np.linalg.norm(frame.eye.rays[own], axis=1) - self.edge
        bins = np.floor(lengths / BIN)
        for k in np.unique(bins[bins > 0]):
            rays = frame.eye.rays[own][bins == k]
            points = frame.eye.position + rays * ((k + 2) * BIN / np.linalg.norm(rays, axis=1))[:, None]
            self.tree.insertPointCloud(np.ascontiguousarray(points), frame.eye.position, float(k * BIN), True, True)

    def _note(self, points: NDArray) -> None:
        """After an image with these points in the box. Reads the voxels that were ever hit: no others can be occupied, and reading all would take seconds."""
        single = points.astype(np.float32).astype(float)  # as the tree takes them: at a voxel's face it matters
        at = np.floor(single * (1.0 / self.edge)).astype(int) - self.first
        high = (at[:, 2] + self.first[2] + 0.5) * self.edge >= self.margin
        at = at[((at >= 0) & (at < self.shape)).all(1) & high]
        self.hit[tuple(at.T)] = True
        where = np.argwhere(self.hit)
        middles = (where + self.first + 0.5) * self.edge
        odds = np.array([self._log_odds(x) for x in middles])
        self._occupied = np.zeros(self.shape, bool)
        self._occupied[tuple(where[odds >= 0].T)] = True
        gone = where[odds < -1.0]  # far from occupied; noted again if hit again
        self.hit[tuple(gone.T)] = False

    def _log_odds(self, x: NDArray) -> float:
        node = self.tree.search(x)
        return -10.0 if node is None else node.getLogOdds()

    @property
    def occupied(self) -> NDArray:
        """(x y z) the voxels of the box that are obstacles; the first one's corner is `first` times the edge"""
        return self._occupied

    def middles(self) -> NDArray:
        """(voxel 3) middles of the obstacles' voxels [m]"""
        return (np.argwhere(self._occupied) + self.first + 0.5) * self.edge
