"""Coarse sensing for tests of the loop: a world in a second or two, in the same box as the cell's."""

import jax

from hrcjax.field import GridLayout
from hrcjax.map import MapLayout
from hrcjax.presence import VoxelLayout
from hrcjax.sense.rig import cell_rig
from hrcjax.sim import Cell, World, make_world
from hrcjax.sim.survey import SenseParams
from hrcjax.world import Person, Scene

COARSE = {
    "layout": MapLayout(
        lower=(-2.0, -2.0, 0.0),
        shape=(20, 20, 7),
        spacing=0.05,
        capacity=256,
        levels=3,
        seen=256,
        born=128,
        refitted=64,
    ),
    "grid": GridLayout((-1.2, -1.2, -0.1), (49, 49, 29), 0.05),
    "voxels": VoxelLayout((-2.0, -2.0, 0.0), (40, 40, 14), 0.1),
}
"""Fields of a cell at twice the usual spacing."""
QUICK = SenseParams(settled=1000.0)
"""The set-up ends with the scan, whether the map has settled or not."""


def coarse_world(cell: Cell, scene: Scene, person: Person, seed: int = 0) -> World:
    """A world seen by cameras of 80 x 60 pixels."""
    return make_world(cell, scene, person, cell_rig(scene, decimation=8), jax.random.key(seed), QUICK)
