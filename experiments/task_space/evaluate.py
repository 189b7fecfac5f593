"""One random table: images of both cameras, the map, and its measures."""

import time
from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any

import jax
import numpy as np
from numpy.typing import NDArray

from hrcjax.lab.case_store import Make
from hrcjax.lab.provenance import fingerprint
from hrcjax.sense.rig import cell_rig
from hrcjax.task_space import TaskSpace, View, map_table, simulated_views
from hrcjax.task_space.simulated import exact_depths
from hrcjax.world import Scene

from .measures import measure_table
from .tables import scene_of, table_of

UP = np.array([0.0, 0.0, 1.0])


def look(scene: Scene, seed: int, images: int) -> tuple[list[View], list[NDArray]]:
    """Views of both cameras of the cell at full resolution, and their exact depth images [m]."""
    cameras = cell_rig(scene, hand=False, decimation=1).cameras
    return simulated_views(cameras, scene, jax.random.key(seed), images), exact_depths(cameras, scene)


def mapped(seed: int, images: int) -> tuple[TaskSpace, list[NDArray], float]:
    """The map of a table, its exact depth images [m], and how long mapping took, without the drawing of images [s]."""
    views, exact = look(scene_of(table_of(seed)), seed, images)
    begin = time.perf_counter()
    found = map_table(views, UP)
    return found, exact, time.perf_counter() - begin


def measure(seed: int, images: int) -> Mapping[str, Any]:
    """Arrays of one table; the first one of a process is mapped twice, as its time includes compilation."""
    found, exact, seconds = mapped(seed, images)
    if seconds > 3:
        found, exact, seconds = mapped(seed, images)
    return measure_table(table_of(seed), found, exact, seed) | {"seconds": seconds, "offset": found.table.offset, "normal": found.table.normal}  # fmt: skip


def wanted(numbers: Iterable[int], images: int) -> dict[str, tuple[str, Make]]:
    """Every table by name, with the name of its file and what computes it."""
    mark = fingerprint({"images": images})[:6]
    return {f"table {k}": (f"table/{k}-{mark}", partial(measure, k, images)) for k in numbers}
