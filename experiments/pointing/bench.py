"""The cell of the program: scenes surveyed with the table in the map, trials in them, and the places that are found."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.cells.ur5 import make_cell
from hrcjax.geom.shape import box_distance
from hrcjax.hand import Line, PointingParams, pointed_place
from hrcjax.hand.pointing import Pointed
from hrcjax.lab.errors import UsageError
from hrcjax.map import FieldMap, MapLayout, distance_function
from hrcjax.sense.camera import Camera
from hrcjax.sense.rig import cell_rig
from hrcjax.sim import Cell, PlaceParams, SenseParams, ToolPlace, reached_place, tool_place
from hrcjax.sim.prepare import check_start, posture_at
from hrcjax.sim.scan import scan_postures
from hrcjax.sim.survey import survey
from hrcjax.typing import Array, DistanceFn
from hrcjax.world import Scene, obstacle_distances, scene_distance, scene_named
from hrcjax.world.scene import table_solid

from .bound import bound_errors
from .trials import Trials, draw_trials, number_of
from .watch import RATE, WATCHES, Watched, watch_trials

LAYOUT = MapLayout(
    lower=(-2.0, -2.0, -0.05), shape=(40, 40, 14), spacing=0.025, capacity=1024, levels=3, seen=768, born=512, refitted=384
)  # fmt: skip
"""Of the map: the table's top lies in the middle of a layer of blocks, and there is room for it."""
SENSE = SenseParams(table_margin=-0.05)
"""The table is not cropped."""

CHUNK = 12
"""Trials of one call."""


class SetUp(NamedTuple):
    """A scene after its survey."""

    scene: Scene
    cameras: Camera
    """The stationary ones, at full resolution."""
    map: FieldMap
    points: NDArray
    """(point 3) of the map [m]."""


class Found(NamedTuple):
    """The places that a line points at, by the map, by the exact shapes, and of other lines by the map; and the tool's."""

    map: Pointed
    exact: Pointed
    true: Pointed
    """Of the true line."""
    marks: Pointed
    """Of the line by the landmarks alone."""
    world: Pointed
    """Of the line by the detector's model in space."""
    tool: ToolPlace
    tool_true: ToolPlace
    """Of the true line, by the exact shapes."""


@dataclass(frozen=True)
class Bench:
    """Trials with one noise of the landmarks."""

    pixel: float
    """Standard deviation of a landmark in a colour image [px]."""
    shared: float
    """Share of its variance that is the same in all images of a trial [1]."""

    @cached_property
    def cell(self) -> Cell:
        """The cell whose arm goes to the places."""
        return make_cell()

    @cached_property
    def _set_ups(self) -> dict[tuple[str, int], SetUp]:
        return {}

    def set_up(self, name: str, seed: int) -> SetUp:
        """A scene, surveyed once.

        Raises:
            UsageError: the map can't hold it.
        """
        if (name, seed) not in self._set_ups:
            scene, cell = scene_named(name, seed), self.cell
            q = posture_at(cell, scene.start)
            check_start(cell, scene, q)
            found = survey(
                cell.arm, LAYOUT, cell.voxels, cell_rig(scene), scene, scan_postures(cell.arm, scene, q),
                jax.random.key(1), SENSE,
            )  # fmt: skip
            if bool(found.overflow):
                raise UsageError(
                    f"scene {name} {seed} exceeds a capacity of the map, or a camera sees too little of it"
                )
            rows = np.asarray(found.map.levels[0].rows, float)
            cameras = cell_rig(scene, hand=False, decimation=1).cameras
            self._set_ups[name, seed] = SetUp(scene, cameras, found.map, np.moveaxis(rows, 1, 2)[rows[:, 3] > 0][:, :3])
        return self._set_ups[name, seed]

    def play(self, name: str, seed: int, kind: str, count: int) -> Mapping[str, NDArray]:
        """Trials of a kind in a scene, what is measured in them, and what is true."""
        known = self.set_up(name, seed)
        trials = draw_trials(kind, known.scene, known.cameras, known.points, count, seed)
        numbers = [jnp.asarray(a, jnp.float32) for a in (trials.line, trials.wrist, trials.velocity, trials.size)]
        keys = jax.random.split(jax.random.key(1000 * seed + number_of(kind)), count)
        shared = 0.0 if kind == "fresh" else self.shared
        params = PointingParams()

        def some(rows: NDArray) -> tuple[Watched, Found]:
            body, own, own_keys, true = jax.tree.map(
                lambda a: a[rows], (trials.capsules, numbers, keys, true_line(trials))
            )
            watched = watch_trials(
                WATCHES[kind], known.cameras, known.scene, body, *own, own_keys, jnp.float32(self.pixel),
                jnp.float32(shared), params,
            )  # fmt: skip
            return watched, _find(known.map, known.scene, watched.line, watched.marks, watched.world, true, params)

        watched, found = in_chunks(some, count)
        arrays = _arrays(trials, watched, found, known.scene)
        return arrays | self._bounds(kind, known.cameras, arrays) | {
            "verdict": self._verdicts(found.tool), "verdict_true": self._verdicts(found.tool_true)
        }  # fmt: skip

    def _bounds(self, kind: str, cameras: Camera, arrays: Mapping[str, NDArray]) -> dict[str, NDArray]:
        """(trial draw) Least errors of the places of fingers [m]."""
        if kind != "finger":
            return {}
        rows = list(zip(arrays["line"], arrays["place"], arrays["normal_true"], strict=True))
        images = round(PointingParams().dwell * RATE)

        def of(depths: bool) -> NDArray:
            return np.array([
                bound_errors(cameras, *row, self.pixel, self.shared, images, depths, k) for k, row in enumerate(rows)
            ])  # fmt: skip

        return {"bound_marks": of(False), "bound_depths": of(True)}

    def _verdicts(self, places: ToolPlace) -> NDArray:
        """(trial) Why each place is refused; 0: it is not."""
        rows = [jax.tree.map(lambda a, k=k: jnp.asarray(a[k]), places) for k in range(len(places.reasons))]
        return np.array([reached_place(self.cell, row).reasons for row in rows])


def in_chunks(function: Callable[[NDArray], Any], count: int) -> Any:
    """What a function makes of the rows 0 to count - 1, called for `CHUNK` rows at a time: one compiled program for any number."""
    parts = []
    for start in range(0, count, CHUNK):
        part = function(np.minimum(np.arange(start, start + CHUNK), count - 1))
        parts.append(jax.tree.map(lambda a, left=count - start: np.asarray(a)[:left], part))
    return jax.tree.map(lambda *a: np.concatenate(a), *parts)


def true_line(trials: Trials) -> Line:
    """The lines as they are; nothing about them is uncertain."""
    tip, u = (jnp.asarray(a, jnp.float32) for a in (trials.line[:, -1], trials.direction))
    return Line(tip, u, jnp.zeros((len(tip), 6, 6), jnp.float32))


@jax.jit
def _find(
    map: FieldMap, scene: Scene, lines: Line, marks: Line, world: Line, true: Line, params: PointingParams
) -> Found:
    sensed = distance_function(LAYOUT, map.levels, SENSE.frame.map.ratio)
    exact = partial(scene_distance, scene)

    def places(distance: DistanceFn, *lines: Line) -> list[Pointed]:
        """One after the other: the program is compiled once for all."""
        stacked = jax.tree.map(lambda *a: jnp.stack(a), *lines)
        found = jax.lax.map(lambda line: pointed_place(params, line, distance), stacked)
        return [jax.tree.map(lambda a, k=k: a[k], found) for k in range(len(lines))]

    def one(line: Line, marks: Line, world: Line, true: Line) -> Found:
        found, ideal, plain, model = places(sensed, line, true, marks, world)
        by_shapes, truth = places(exact, line, true)
        tools = tool_place(PlaceParams(), found, sensed), tool_place(PlaceParams(), truth, exact)
        return Found(found, by_shapes, ideal, plain, model, *tools)

    return jax.lax.map(lambda item: one(*item), (lines, marks, world, true))


@jax.jit
def _solids(scene: Scene, x: Array) -> Array:
    center, half = table_solid(scene)

    def one(x: Array) -> Array:
        return jnp.argmin(jnp.append(jnp.abs(obstacle_distances(scene, x)), jnp.abs(box_distance(x, center, half))))

    return jax.vmap(one)(x)


def solids(scene: Scene, x: Any) -> NDArray:
    """(place) On which solid places lie: the number of an obstacle, or that of all for the table."""
    return np.asarray(_solids(scene, jnp.asarray(np.nan_to_num(np.asarray(x)), jnp.float32)))


def _arrays(trials: Trials, watched: Watched, found: Found, scene: Scene) -> dict[str, NDArray]:
    arrays: dict[str, Array | NDArray] = {
        "place": trials.place, "way": trials.way, "direction": trials.direction, "line": trials.line, "hand": trials.hand,
        "velocity": trials.velocity, "chosen": watched.chosen, "time": watched.time, "tip_found": watched.line.tip,
        "direction_found": watched.line.direction, "line_covariance": watched.line.covariance,
        "direction_marks": watched.marks.direction, "shoulder": trials.shoulder, "wrist": trials.wrist,
    }  # fmt: skip
    for name in ("map", "exact", "true", "marks", "world"):
        pointed: Pointed = getattr(found, name)
        arrays |= {f"{name}_place": pointed.place, f"{name}_found": pointed.found, f"{name}_covariance": pointed.covariance}  # fmt: skip
    arrays |= {"solid": solids(scene, trials.place), "solid_found": solids(scene, found.map.place)}
    arrays |= {"touched": found.map.touched, "normal": found.tool.normal, "normal_true": found.tool_true.normal}
    arrays |= {f"scene_{k}": getattr(scene, k) for k in ("kind", "center", "size", "yaw", "mask", "table_lower", "table_upper")}  # fmt: skip
    return {name: np.asarray(a) for name, a in arrays.items()}
