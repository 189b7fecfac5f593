"""Where a map lies and how much it can hold: everything static, so that a growing map never recompiles.

Level 0 keeps one point a voxel. 4 x 4 x 4 voxels are a block; the points of a block and of its neighbours are a local
Gaussian process. The mean points of blocks are the voxels of level 1, and so on: by these the nearest blocks are found from
anywhere.
"""

from dataclasses import dataclass

from jaxtyping import ArrayLike

EDGE = 4
"""Voxels along the edge of a block."""
VOXELS = EDGE**3
"""Voxels of a block."""
OCCUPIED = 16
"""Voxels of a block that hold a point, of all blocks that one frame sees, at most."""
REACH = 4
"""Blocks on every side of a query's block among which its local process is looked for."""


@dataclass(frozen=True)
class MapLayout:
    """Sizes of a map. Defaults: the surroundings of an arm."""

    lower: tuple[float, float, float] = (-2.0, -2.0, -0.4)
    """Corner of the mapped box with the least coordinates [m]."""
    shape: tuple[int, int, int] = (40, 40, 24)
    """Blocks of level 0 along x, y and z."""
    spacing: float = 0.025
    """Edge of a voxel of level 0 [m]."""
    capacity: int = 4096
    """Blocks of level 0 that can hold points; at most all that the box has."""
    levels: int = 3
    """Level 0 and the coarser ones, each with four times the spacing of the one before."""
    seen: int = 2048
    """Blocks that one frame can update; the others are served round robin by later frames and counted in the report."""
    born: int = 1024
    """Blocks that one frame can add."""
    refitted: int = 384
    """Blocks whose weights are refitted with one frame; further ones wait for later frames. 0: weights stay those of a flat sample, for
    maps of which the points alone are read."""

    def __post_init__(self) -> None:
        """Refuses sizes that no map can have.

        Raises:
            ValueError: fewer than 2 levels, a size under 1.
        """
        if self.levels < 2 or min(self.capacity, self.seen, self.born, self.refitted + 1, *self.shape) < 1:
            raise ValueError(f"{self}: accepted are at least 2 levels and sizes of at least 1, refitted 0 or more")
        places = self.shape[0] * self.shape[1] * self.shape[2]
        object.__setattr__(self, "capacity", min(self.capacity, places))

    @property
    def entries(self) -> int:
        """Points that one frame can update: a surface has some 14 in a block."""
        return self.seen * OCCUPIED

    def spacing_of(self, level: int) -> float:
        """Edge of a voxel [m]."""
        return self.spacing * EDGE**level

    def scale_of(self, ratio: ArrayLike) -> ArrayLike:
        """Length scale of the field [m].

        Args:
            ratio: over the spacing [1].
        """
        return ratio * self.spacing

    def edge_of(self, level: int) -> float:
        """Edge of a block [m]."""
        return self.spacing_of(level) * EDGE

    def shape_of(self, level: int) -> tuple[int, int, int]:
        """Blocks along x, y and z."""
        x, y, z = (-(-n // EDGE**level) for n in self.shape)
        return x, y, z

    def capacity_of(self, level: int) -> int:
        """Blocks that can hold points; a surface has at most as many coarse blocks as fine ones."""
        x, y, z = self.shape_of(level)
        return min(x * y * z, self.capacity)
