"""The cell of the program, its people and numbers, and runs of every function beside them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.cells.people import make_people
from hrcjax.cells.ur5 import make_cell
from hrcjax.interact import (
    CONTACT_OR_SEPARATION,
    FollowParams,
    GiveWayParams,
    HandOverParams,
    InteractPolicyParams,
    KeepAwayParams,
    KeepDistanceParams,
    MonitorParams,
    interactive_policy,
)
from hrcjax.numerics import unrolled_options
from hrcjax.sense import no_faults
from hrcjax.sense.rig import cell_rig
from hrcjax.sim import Cell, Params
from hrcjax.sim.prepare import Surveyed, stage_for, survey_world
from hrcjax.sim.survey import SenseParams
from hrcjax.world import Person, Scene, scene_named

from .people import held_out_hand, led_hand
from .play import Setting, program

SCENE = "hri"
"""The scene: the HRI paper's waypoints, nothing on the table."""
HOMES = {
    "keep_away": (0.3, 0.25, 0.5),
    "give_way": (0.35, 0.05, 0.5),
    "follow": (-0.3, 0.4, 0.4),
    "hand_over": (-0.3, 0.4, 0.4),
}
"""Where the tool waits in each function: the start of the run, and the refuge [m]."""
POSE = (-0.1, 0.45, 0.35)
"""What the tool holds where it keeps away [m]."""
FOLLOWED = (-0.85, -0.53, 0.0)
"""Way from a followed hand to the tool: beside the person, so that no other link comes nearer, and within reach; its length does not
count [1]."""
OFFERED = (-0.4, -0.72, 0.57)
"""The same to a tool that hands over: before and above the hand, tool pointing down at it [1]."""
OWN: dict[str, Callable[[Scene, int, float], Person]] = {"led_hand": led_hand, "held_out_hand": held_out_hand}
"""People of this program."""


class Variant(NamedTuple):
    """A way to run a function."""

    function: str
    """See `play.FUNCTIONS`."""
    on: bool
    """False: switched off."""
    contact: bool
    """The monitor is power and force limiting."""
    distance: float | None
    """Of follow and hand_over, from the hand's surface [m]."""
    text: str
    """One line."""


VARIANTS: dict[str, Variant] = {
    "keep_away": Variant("keep_away", True, False, None, "the tool holds a pose and keeps 0.7 m from people"),
    "keep_away_off": Variant("keep_away", False, False, None, "the same without the distance leaf: collision leaf and safety layer alone"),
    "follow": Variant("follow", True, False, 0.9, "the tool stays 0.9 m from a hand, under speed and separation"),
    "follow_off": Variant("follow", False, False, 0.9, "the tool stays at home"),
    "follow_close": Variant("follow", True, False, 0.45, "the same at 0.45 m, where speed and separation is in its red zone"),
    "follow_contact": Variant("follow", True, True, 0.25, "the same at 0.25 m, under power and force limiting"),
    "hand_over": Variant("hand_over", True, False, 0.45, "an offer at 0.45 m, under speed and separation"),
    "hand_over_off": Variant("hand_over", False, False, 0.45, "the tool stays at home"),
    "hand_over_near": Variant("hand_over", True, False, 0.05, "an offer at 0.05 m, which speed and separation forbids"),
    "hand_over_contact": Variant("hand_over", True, True, 0.05, "an offer at 0.05 m, under power and force limiting"),
    "give_way": Variant("give_way", True, False, None, "to and fro between the paper's waypoints; makes way, waits in a refuge, resumes"),
    "give_way_off": Variant("give_way", False, False, None, "the same task, which the safety layer alone slows and stops"),
}  # fmt: skip
"""Variant -> what it is."""


def setting_of(variant: Variant, scene: Scene) -> Setting:
    """What the function of a variant is told."""
    dtype = scene.start.dtype

    def place(x: Any, length: float | None = None) -> Any:
        x = np.asarray(x, float)
        return jnp.asarray(x if length is None else x / np.linalg.norm(x) * length, dtype)

    follow, offer = FollowParams(), HandOverParams()
    if variant.distance is not None:
        follow = eqx.tree_at(lambda p: p.distance, follow, variant.distance)
        offer = eqx.tree_at(lambda p: p.distance, offer, variant.distance)
    return Setting(
        KeepAwayParams(), follow, offer, GiveWayParams(), place(HOMES[variant.function]), place(POSE),
        place(OFFERED if variant.function == "hand_over" else FOLLOWED, 1.0), (scene.start, scene.goal), jnp.asarray(variant.on),
    )  # fmt: skip


def params_of(variant: Variant) -> Params:
    """The cell's parameters for a variant."""
    weight = KeepDistanceParams().weight if variant.function == "keep_away" else 0.0
    near = variant.function in ("follow", "hand_over") and (variant.distance or 1.0) < 0.3
    policy = InteractPolicyParams(keep=KeepDistanceParams(weight=weight), released=1.0 if near else 0.0)
    plain = Params()
    monitor = MonitorParams(plain.safety, 1.0 if variant.contact else 0.0)
    return eqx.tree_at(lambda p: (p.policy, p.safety), plain, (policy, monitor))


@dataclass(frozen=True)
class Bench:
    """Runs of one length."""

    seconds: float
    """Length of a run [s]."""
    decimation: int = 4
    """Of the 640 x 480 pixels of the cameras every n-th column and row is kept."""

    @cached_property
    def cell(self) -> Cell:
        """The cell of all."""
        cell = make_cell()
        return replace(
            cell, ticks=round(self.seconds / cell.dt), policy=interactive_policy(cell.arm), safety=CONTACT_OR_SEPARATION
        )

    @cached_property
    def scene(self) -> Scene:
        """The scene of all; its start is a waypoint of the task."""
        return scene_named(SCENE, 0)

    @cached_property
    def _set_ups(self) -> dict[tuple[float, ...], Surveyed]:
        return {}

    @cached_property
    def _programs(self) -> dict[str, Any]:
        return {}

    def person(self, name: str, seed: int) -> Person:
        """Everybody in the cell."""
        if name in OWN:
            return OWN[name](self.scene, seed, self.seconds)
        return make_people(name, self.scene, seed, self.seconds, self.cell.people)

    def set_up(self, function: str, person: Person) -> Surveyed:
        """The cell after its set-up with the tool at home, which is made once for a home, with the people who will come."""
        rig, home = cell_rig(self.scene, decimation=self.decimation), HOMES[function]
        if home not in self._set_ups:
            at_home = eqx.tree_at(lambda s: s.start, self.scene, jnp.asarray(home, self.scene.start.dtype))
            self._set_ups[home] = survey_world(self.cell, at_home, person, rig, jax.random.key(1))
        stage = stage_for(rig, self.scene, person, no_faults(rig.count, self.scene.start.dtype))
        return eqx.tree_at(lambda k: k.stage, self._set_ups[home], stage)

    def _program(self, function: str) -> Any:
        if function not in self._programs:
            self._programs[function] = jax.jit(program(function, self.cell), compiler_options=unrolled_options())
        return self._programs[function]

    def play(self, name: str, person: str, seed: int) -> Mapping[str, NDArray]:
        """The arrays of a run: what `Played` holds, and of its record joints, speeds, accelerations, tool, distances and zones."""
        variant = VARIANTS[name]
        known = self.set_up(variant.function, self.person(person, seed))
        params = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), params_of(variant))
        setting = jax.tree.map(lambda leaf: leaf if isinstance(leaf, jax.Array) else jnp.asarray(leaf, jnp.float32), setting_of(variant, self.scene))  # fmt: skip
        found = self._program(variant.function)(params, setting, known, jax.random.key(seed), SenseParams())
        record = found.record
        kept = {k: np.asarray(getattr(record, k)) for k in ("q", "qd", "qdd", "tool", "separation", "approach", "speed_limit", "zone", "status", "reasons")}  # fmt: skip
        return kept | {k: np.asarray(getattr(found, k)) for k in ("goal", "hand", "active", "person")}
