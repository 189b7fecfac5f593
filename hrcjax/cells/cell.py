"""The cell as a sweep sees it: defaults, worlds, one function from settings to results, and what the results mean."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from itertools import product
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.io.motions.motion import Motion, read_motion
from hrcjax.io.motions.spec import FORMS, motion_spec
from hrcjax.lab.parameters import leaf_names
from hrcjax.metrics import METRICS
from hrcjax.robot import load_arm, with_tool
from hrcjax.sense import cell_camera
from hrcjax.sim import Cell, Params, World, episode, fit_fields, make_world, outcome
from hrcjax.sim.tick import NOT_FINITE_COMMAND, NOT_FINITE_TORQUE
from hrcjax.sweeps.sweepable import NOT_FINITE, Metric, Sweepable, Trace
from hrcjax.world import MOTIONS, Person, Scene, motion_named, person_from_joints, scene_named

ALIASES = {
    "K_att": "plan.potential.k_att",
    "K_rep": "plan.potential.k_rep",
    "zeta": "plan.potential.zeta",
    "omega1": "plan.path.omega1",
    "omega2": "plan.path.omega2",
    "length_scale": "field.length_scale",
}
DOMAINS = {
    "plan.potential.k_att": (1e-4, 1.0),
    "plan.potential.k_rep": (0.0, 1.0),
    "plan.potential.zeta": (1.0, 10.0),
    "plan.path.omega1": (1e-6, 1e3),
    "plan.path.omega2": (0.0, 1e3),
    "field.length_scale": (0.01, 0.2),
    "field.noise": (0.0, 1.0),
    "motion.speed": (0.01, 1.5),
}
"""Values outside are refused: they mean nothing, or the numbers do not carry them. All others are not negative."""

STATUSES = {
    0: "ok",
    1: "goal not reached in time",
    2: "the arm touched an obstacle",
    3: "the arm touched the person while it moved",
}

TRACES = {
    "plan": Trace(("waypoint", "xyz"), "m", "planned path"),
    "tool": Trace(("time", "xyz"), "m", "way of the tool"),
    "separation_t": Trace(("time",), "m", "true distance of the arm to the person"),
    "clearance_t": Trace(("time",), "m", "true distance of the arm to the obstacles"),
    "speed": Trace(("time",), "m/s", "speed of the tool"),
    "speed_limit": Trace(("time",), "m/s", "speed towards the person that the safety monitor allowed"),
    "zone": Trace(("time",), "1", "0 green, 1 yellow, 2 red, 3 stop"),
    "path_status": Trace((), "1", "bits: 1 descent reached the goal, 2 required distances kept, 4 within the bounds"),
}

ABOUT = {
    "obstacle_kind": Trace(("obstacle",), "", "0 sphere, 1 column, 2 box"),
    "obstacle_center": Trace(("obstacle", "xyz"), "m", "middle of the obstacle"),
    "obstacle_size": Trace(("obstacle", "xyz"), "m", "half extents; radius first"),
    "obstacle_yaw": Trace(("obstacle",), "rad", "turn about the vertical"),
    "obstacle_mask": Trace(("obstacle",), "", "1 where an obstacle exists"),
    "start": Trace(("xyz",), "m", "start of the path"),
    "goal": Trace(("xyz",), "m", "goal of the path"),
    "person_a": Trace(("frame", "capsule", "xyz"), "m", "one end of the person's capsules"),
    "person_b": Trace(("frame", "capsule", "xyz"), "m", "other end"),
    "person_radius": Trace(("capsule",), "m", "radius"),
}
"""What is stored of a world, once, for figures."""


def about(world: World) -> dict[str, Any]:
    """The arrays named in `ABOUT`."""
    scene, person = world.scene, world.person
    return {
        "obstacle_kind": scene.kind,
        "obstacle_center": scene.center,
        "obstacle_size": scene.size,
        "obstacle_yaw": scene.yaw,
        "obstacle_mask": scene.mask.astype(jnp.int8),
        "start": scene.start,
        "goal": scene.goal,
        "person_a": person.a,
        "person_b": person.b,
        "person_radius": person.radius,
    }


TOOL = (0.12, 0.03)
"""Length and radius of the tool: with the bare flange at the paper's goal, 5 cm over the table, the forearm would lie in
the 20 cm column beside it [m]."""
EPISODE = 10.0
"""Length of an episode [s]."""
FASTEST = 8.0
"""Speed of a joint beyond which a recording jumps: faster than hands are at work [m/s]."""
PERSON_RATE = 30.0
"""Poses a second of a person's record [Hz]."""
BROKEN = NOT_FINITE_COMMAND | NOT_FINITE_TORQUE
"""Bits of the ticks' status that make a result worthless."""
BYTES_PER_TICK = 1700
"""Memory that one tick of one setting takes while it runs, measured [bytes]."""


def make_cell(backend: str = "folded", variant: str = "ur5") -> Cell:
    """The UR5 cell of the sweep."""
    return Cell(
        arm=with_tool(load_arm(variant), *TOOL),
        ticks=round(EPISODE / Cell.dt),
        backend=backend,
    )


def make_person(name: str, scene: Scene, seed: int, duration: float) -> Person:
    """A motion by name, or a recorded one: see `hrcjax.io.motions.spec`.

    Raises:
        ValueError: no such motion, or a file that is missing or broken.
    """
    if name in MOTIONS:
        return motion_named(name, scene, seed, duration, PERSON_RATE)
    motion = _recording(name)
    return person_from_joints(motion.positions, motion.names, motion.rate, scene, duration, PERSON_RATE)


@cache
def _recording(name: str) -> Motion:
    """What an episode plays of a motion file, read once."""
    spec = motion_spec(name)
    if spec is None:
        raise ValueError(f"unknown person {name!r}: accepted are {', '.join(MOTIONS)}, or {FORMS}")
    return read_motion(spec, EPISODE)


def recording_notes(name: str) -> list[str]:
    """What to know of a recorded person: how much of it an episode takes, and where it jumps."""
    motion = _recording(name)
    rate, length, notes = motion.rate, motion.length, list(motion.notes)
    if length > EPISODE:
        notes.append(f"{name}: the first {EPISODE:g} s of {length:.1f} s are played")
    elif length < EPISODE:
        notes.append(f"{name}: {length:.1f} s long; the last pose is held to {EPISODE:g} s")
    speed = np.linalg.norm(np.diff(motion.positions, axis=0), axis=-1).max(axis=1, initial=0.0) * rate
    if (speed > FASTEST).any():
        first = float(np.argmax(speed > FASTEST)) / rate
        notes.append(
            f"{name}: a joint moves at up to {speed.max():.0f} m/s, first over {FASTEST:g} m/s at {first:.1f} s: the recording jumps"
        )
    return notes


def build_world(cell: Cell, scene_name: str, person_name: str, seed: int) -> World:
    """One scene with one person, sensed."""
    scene = scene_named(scene_name, seed)
    person = make_person(person_name, scene, seed, cell.ticks * cell.dt)
    return make_world(cell, scene, person, cell_camera(scene), jax.random.key(seed))


def evaluate(cell: Cell, params: Params, world: World) -> dict[str, Any]:
    """Results of a batch of settings in one world.

    Args:
        params: leaves that are swept have a leading axis; the others are scalars and shared by all settings.
    """
    axes = jax.tree.map(lambda leaf: 0 if jnp.ndim(leaf) else None, params)
    field_axes = jax.tree.leaves(axes.field)
    share = all(axis is None for axis in field_axes)
    shared = fit_fields(params.field, world.frames) if share else None

    def one(setting: Params) -> dict[str, Any]:
        fields = fit_fields(setting.field, world.frames) if shared is None else shared
        run = episode(setting, cell, world, fields)
        kept = outcome(setting, cell, world, run)
        metrics = {name: getattr(kept.metrics, name) for name in METRICS}
        metrics["clearance"] = jnp.where(jnp.any(world.scene.mask), metrics["clearance"], jnp.nan)
        metrics["separation"] = jnp.where(jnp.any(world.person.radius >= 0), metrics["separation"], jnp.nan)
        traces = {
            "plan": kept.traces.plan,
            "tool": kept.traces.tool,
            "separation_t": kept.traces.separation,
            "clearance_t": kept.traces.clearance,
            "speed": kept.traces.speed,
            "speed_limit": kept.traces.speed_limit,
            "zone": kept.traces.zone.astype(jnp.int8),
            "path_status": kept.path_status,
        }
        touched = kept.metrics.clearance < 0
        status = jnp.where(kept.metrics.success > 0, 0, 1)
        status = jnp.where(touched, 2, status)
        status = jnp.where(kept.hit, 3, status)
        status = jnp.where(kept.run_status & BROKEN != 0, NOT_FINITE, status)
        return {**metrics, **traces, "status": status.astype(jnp.int32)}

    return jax.vmap(one, in_axes=(axes,))(params)


def build_cell(
    scenes: Sequence[str], people: Sequence[str], seeds: Sequence[int], backend: str = "folded"
) -> Sweepable:
    """Everything that the sweep needs.

    Raises:
        ValueError: an unknown scene or person.
    """
    cell = make_cell(backend)
    frames = round(cell.ticks * cell.dt * PERSON_RATE) + 1
    for scene in scenes:
        scene_named(scene, 0)
    for person in people:
        make_person(person, scene_named(scenes[0], 0), 0, 1.0)
    worlds: list[tuple[Mapping[str, Any], Callable[[], Any]]] = [
        ({"scene": scene, "person": person, "seed": seed}, partial(build_world, cell, scene, person, seed))
        for scene, person, seed in product(scenes, people, seeds)
    ]
    defaults = eqx.filter(Params(), lambda leaf: not isinstance(leaf, bool))
    return Sweepable(
        params=defaults,
        evaluate=partial(evaluate, cell),
        worlds=worlds,
        metrics={name: Metric(*about) for name, about in METRICS.items()},  # type: ignore[arg-type]
        traces=TRACES,
        bytes_per_setting=cell.ticks * BYTES_PER_TICK,
        aliases=ALIASES,
        domains={**{name: (0.0, math.inf) for name in leaf_names(defaults)}, **DOMAINS},
        notes=[note for name in people if name not in MOTIONS for note in recording_notes(name)],
        rank="score_overall",
        trade_off=("tool_length", "tool_bending_energy", "clearance"),
        statuses=STATUSES,
        identity=f"cell {cell.arm.variant} {TOOL} {cell.backend} {cell.ticks} x {cell.dt}",
        open_ended=frozenset({"clearance", "separation"}),
        describe=about,
        described=ABOUT,
        coords={
            "frame": (np.arange(frames) / PERSON_RATE, "s", "time of the person's pose"),
            "time": (np.asarray(cell.times[:: cell.metric_stride]), "s", "time since the start"),
            "xyz": (np.array(["x", "y", "z"]), "", "axis of the world"),
        },
    )
