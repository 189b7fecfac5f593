"""Set-up, sensing and episodes: each step compiled once, the set-up shared by all people of a scene."""

import time
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.cells.people import make_people
from hrcjax.field.grid import GridField
from hrcjax.robot import arm_capsules
from hrcjax.sense import FaultSchedule, no_faults
from hrcjax.sense.rig import Rig, cell_rig
from hrcjax.sim import (
    Cell,
    Episode,
    Fields,
    Frames,
    Params,
    Record,
    SenseParams,
    Survey,
    World,
    episode,
    sense_sequence,
)
from hrcjax.sim.own_sensing import episode_own
from hrcjax.sim.prepare import Surveyed, frame_stamps, hidden_field, nominal_motion, posture_at, scene_field, stage_for
from hrcjax.sim.scan import scan_postures
from hrcjax.sim.survey import survey
from hrcjax.typing import Array
from hrcjax.world import Person, Scene, scene_named

MOTION_SHARE = 0.6
"""Share of an episode in which the nominal arm of shared sensing moves; see `hrcjax.sim.prepare` [1]."""


@dataclass(frozen=True)
class SetUp:
    """A scene after its set-up."""

    name: str
    seed: int
    scene: Scene
    rig: Rig
    q_start: Array
    q_goal: Array
    postures: Array
    """Of the scan (look joint) [rad]."""
    survey: Survey
    field: GridField
    hidden: GridField | None
    """Distance to space where somebody may be unseen; None: nobody is there."""
    seconds: float
    """Time that the set-up's images took to compute [s]."""
    key: Array
    """Random key of the episode's images."""


@dataclass(frozen=True)
class Bench:
    """A cell with its parameters, and its compiled steps."""

    cell: Cell
    params: Params
    sense: SenseParams
    own: bool = False
    """Whether the images show the arm where it really is."""

    @cached_property
    def dtype(self) -> Any:
        """Of all arrays: single precision, as in a sweep."""
        return jnp.float32

    @cached_property
    def _sensed(self) -> Any:
        cell = self.cell

        def sensed(known: Surveyed, q: Array, stamps: Array, cameras: Array, key: Array, params: SenseParams) -> Frames:
            robot = jax.vmap(partial(arm_capsules, cell.arm))(q)
            capacity = cell.moving_points * cell.people
            return sense_sequence(
                cell.voxels, capacity, cell.latency, known.survey, known.field, known.stage, robot, stamps, cameras, key,
                params, known.hidden,
            )  # fmt: skip

        return jax.jit(sensed)

    @cached_property
    def _fit(self) -> Any:
        return jax.jit(self.cell.field.fit)

    @cached_property
    def _play(self) -> Any:
        def play(params: Params, world: World, fields: Fields) -> Episode:
            return episode(params, self.cell, world, fields)

        return jax.jit(play)

    @cached_property
    def _own(self) -> Any:
        def own(params: Params, known: Surveyed, key: Array, sense: SenseParams) -> Episode:
            return episode_own(params, self.cell, known, key, sense)

        return jax.jit(own)

    def set_up(self, name: str, seed: int) -> SetUp:
        """Looks at the empty cell."""
        scene = scene_named(name, seed)
        rig = cell_rig(scene)
        q_start, q_goal = posture_at(self.cell, scene.start), posture_at(self.cell, scene.goal)
        survey_key, frame_key = jax.random.split(jax.random.key(seed))
        postures = scan_postures(self.cell.arm, scene, q_start)
        begin = time.perf_counter()
        surveyed = jax.block_until_ready(
            survey(self.cell.arm, self.cell.layout, self.cell.voxels, rig, scene, postures, survey_key, self.sense)
        )
        seconds = time.perf_counter() - begin
        field = scene_field(self.cell, self.sense, surveyed)
        hidden = hidden_field(self.cell, self.sense, surveyed)
        return SetUp(name, seed, scene, rig, q_start, q_goal, postures, surveyed, field, hidden, seconds, frame_key)

    def person(self, made: SetUp, name: str) -> Person:
        """The people of a name in a scene."""
        return make_people(name, made.scene, made.seed, self.cell.ticks * self.cell.dt, self.cell.people)

    def known(self, made: SetUp, person: Person, faults: FaultSchedule | None = None) -> Surveyed:
        """The cell after its set-up, with the people who will come."""
        suffered = no_faults(made.rig.count, self.dtype) if faults is None else faults
        stage = stage_for(made.rig, made.scene, person, suffered)
        return Surveyed(made.scene, made.q_start, made.survey, made.field, made.hidden, stage)

    def world(self, made: SetUp, person: Person, faults: FaultSchedule | None = None) -> World:
        """The world with every image of an episode."""
        stamps, cameras = frame_stamps(self.cell, made.rig)
        times = jnp.asarray(stamps, self.dtype)
        q = nominal_motion(made.q_start, made.q_goal, times, MOTION_SHARE * self.cell.ticks * self.cell.dt)
        frames = self._sensed(self.known(made, person, faults), q, times, jnp.asarray(cameras), made.key, self.sense)
        return World(made.scene, person, frames, made.q_start)

    def play(self, made: SetUp, person: Person, faults: FaultSchedule | None = None) -> "Played":
        """One episode."""
        stamps, cameras = frame_stamps(self.cell, made.rig)
        if self.own:
            record = self._own(self.params, self.known(made, person, faults), made.key, self.sense)
            return played_own(self.cell, stamps, cameras, record)
        return self.play_in(self.world(made, person, faults))

    def play_in(self, world: World) -> "Played":
        """One episode in a world that all settings share."""
        return played_shared(
            self.cell, world, self._play(self.params, world, self._fit(self.params.field, world.frames))
        )


def bench(cell: Cell, params: Params, sensing: str) -> Bench:
    """The bench of a cell, in single precision.

    Args:
        sensing: "shared" or "own"; see `SensingConfig.sensing`.
    """
    return Bench(
        cell, jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), params), SenseParams(), sensing == "own"
    )


@dataclass(frozen=True)
class Played:
    """An episode on the host: every tick, and the image that each tick used."""

    t: NDArray
    """Start of the tick [s]."""
    q: NDArray
    qd: NDArray
    tool: NDArray
    zone: NDArray
    speed_limit: NDArray
    separation: NDArray
    """Sensed lower bound of the distance of any control point to people [m]."""
    cameras: NDArray
    """What is wrong with the cameras: bits."""
    reasons: NDArray
    """Why the arm is stopped: bits."""
    image: NDArray
    """Index of the image in use."""
    age: NDArray
    """Time since its exposure; infinite: none [s]."""
    guarded: NDArray
    """True where full speed is not allowed because somebody may be hidden, or a camera is missing."""
    plan_status: int
    """Bits of the plan; 7: clear."""

    stamp: NDArray
    """When each image was exposed [s]."""
    camera: NDArray
    """By which camera."""


def _columns(record: Record) -> dict[str, Any]:
    names = ("q", "qd", "tool", "zone", "speed_limit", "separation", "cameras", "reasons")
    return {name: np.asarray(getattr(record, name)) for name in names}


def played_shared(cell: Cell, world: World, run: Episode) -> Played:
    """An episode whose images show a nominal arm."""
    frames, t = world.frames, np.asarray(cell.times, float)
    stamp = np.asarray(frames.stamp, float)
    image, age = image_in_use(stamp, np.asarray(frames.valid), t, cell.latency)
    latest, _ = image_in_use(stamp, np.ones(len(stamp), bool), t, cell.latency)
    guarded = np.asarray(frames.guarded)
    return Played(
        t=t, image=image, age=age, guarded=guarded[image] | guarded[latest], plan_status=int(run.path.status),
        stamp=stamp, camera=np.asarray(frames.camera), **_columns(run.record),
    )  # fmt: skip


def played_own(cell: Cell, stamp: NDArray, camera: NDArray, run: Episode) -> Played:
    """An episode whose images show this arm. Its images are not kept: which were good is told by what the ticks know of the
    cameras, and it counts as guarded where the zone is not green."""
    t, columns = np.asarray(cell.times, float), _columns(run.record)
    latest, some = image_in_use(stamp, np.ones(len(stamp), bool), t, cell.latency)
    valid = np.ones(len(stamp), bool)
    wrong = ((columns["cameras"] >> (8 * camera[latest])) & 255) != 0
    valid[latest[wrong & np.isfinite(some)]] = False
    image, age = image_in_use(stamp, valid, t, cell.latency)
    return Played(
        t=t, image=image, age=age, guarded=columns["zone"] > 0, plan_status=int(run.path.status), stamp=np.asarray(stamp, float),
        camera=np.asarray(camera), **columns,
    )  # fmt: skip


def image_in_use(stamp: NDArray, valid: NDArray, t: NDArray, latency: float) -> tuple[NDArray, NDArray]:
    """Index of the newest valid image that is there at each time, and its age [s]; none: index 0, age infinite.

    Args:
        latency: time from exposure to use [s].
    """
    # the loop compares in single precision
    due = (t - latency).astype(np.float32)
    usable = np.flatnonzero(valid)
    place = np.searchsorted(stamp[usable].astype(np.float32), due, side="right") - 1
    index = usable[np.maximum(place, 0)] if len(usable) else np.zeros(len(t), int)
    some = place >= 0 if len(usable) else np.zeros(len(t), bool)
    return np.where(some, index, 0), np.where(some, t - stamp[index], np.inf)
