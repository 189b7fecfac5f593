"""The obstacle grid of the Robotica paper's figure 4: 1 where an obstacle stands, 0 in its surroundings, in metres."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, UInt

from hrcjax.task_space.mapping import TaskSpace
from hrcjax.task_space.solid_distance import POINTS, solid_distances
from hrcjax.task_space.view import points


class ObstacleGrid(NamedTuple):
    """A binary map of the table from above, in the table's frame."""

    cells: UInt[np.ndarray, "x y"]
    """1: an obstacle stands over the cell's middle; 0: none does."""
    seen: Bool[np.ndarray, "x y"]
    """Whether any camera measured something there; the rest is 0 because nothing is known."""
    lower: Float[np.ndarray, "2"]
    """Least corner of the first cell [m]."""
    edge: float
    """Of a cell [m]."""

    def middles(self) -> Float[np.ndarray, "x y 2"]:
        """Middles of the cells [m]."""
        x, y = (self.lower[a] + (np.arange(self.cells.shape[a]) + 0.5) * self.edge for a in (0, 1))
        return np.stack(np.meshgrid(x, y, indexing="ij"), -1)


def obstacle_grid(
    found: TaskSpace, edge: float = 0.01, lower: np.ndarray | None = None, upper: np.ndarray | None = None
) -> ObstacleGrid:
    """The grid of a mapped table.

    Args:
        edge: of a cell [m].
        lower: least x and y in the table's frame; None: of the table's outline [m].
        upper: greatest [m].

    Raises:
        ValueError: an edge that is not positive, or bounds without area.
    """
    low = found.table.corners.min(0) if lower is None else np.asarray(lower, float)
    high = found.table.corners.max(0) if upper is None else np.asarray(upper, float)
    if edge <= 0 or np.any(high <= low):
        raise ValueError(f"grid of cells of {edge} m from {low} to {high}: accepted are positive sizes")
    shape = np.ceil((high - low) / edge - 1e-9).astype(int)
    grid = ObstacleGrid(np.zeros(shape, np.uint8), np.zeros(shape, bool), low, edge)
    middles = grid.middles().reshape(-1, 2)
    for one in found.instances:
        place = np.concatenate([middles, np.full((len(middles), 1), one.center[2])], axis=1)
        if one.kind == POINTS:
            at = np.floor((one.points[:, :2] - low) / edge).astype(int)
            at = at[np.all((at >= 0) & (at < shape), axis=1)]
            grid.cells[tuple(at.T)] = 1
        else:  # the widest section of a sphere is at its middle, and all sections of the others are alike
            grid.cells[(solid_distances(one.kind, one.center, one.size, one.yaw, place) <= 0).reshape(shape)] = 1
    for view in found.views:
        at = np.floor((points(view)[view.depth > 0][:, :2] - low) / edge).astype(int)
        at = at[np.all((at >= 0) & (at < shape), axis=1)]
        grid.seen[tuple(at.T)] = True
    return grid
