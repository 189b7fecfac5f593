"""Whole episodes beside people who are sensed in images, with and without what the body says, side by side in one program."""

from dataclasses import replace
from functools import cached_property
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.body import BodyParams
from hrcjax.cells.people import FASTEST, make_people, recording_notes
from hrcjax.cells.ur5 import make_cell
from hrcjax.geom.segment import FAR
from hrcjax.numerics import unrolled_options
from hrcjax.safety import SafetyDecision, SafetyParams, ZoneState, initial_zone
from hrcjax.sense.rig import cell_rig
from hrcjax.sim import Params, SafetyPart, Separation, World, episode, make_world, outcome, separation_monitor
from hrcjax.sim.outcome import counted
from hrcjax.typing import Array, Float
from hrcjax.world import MOTIONS, person_at, scene_named

from .real_speed import real_exposure

SCENE = "robotica"
EXPLAINED = {
    "off": "the body is not used: assumed speeds, the most sensitive region, the head is not watched",
    "alike": "the body is not used, and zones are relaxed as near to their thresholds as measured ones are",
    "speed": "measured speeds and regions alone",
    "head": "the stop near the head alone",
    "body": "all of it",
    "still": "measured speeds and regions, as if every part stood still and would: not safe, the most that measuring could bring",
}
"""Variant -> what it is."""
VARIANTS = tuple(EXPLAINED)


class Uses(eqx.Module):
    """Parameters of the monitor below; the switches are 0 or 1."""

    safety: SafetyParams
    """Of the cell's monitor."""
    measured: Float[Array, ""] | float
    """1: measured speeds, distances and regions count [1]."""
    head: Float[Array, ""] | float
    """1: the head is watched [1]."""
    still: Float[Array, ""] | float
    """1: nobody moves [1]."""


def decide(params: Uses, memory: ZoneState, seen: Separation) -> tuple[ZoneState, SafetyDecision]:
    """The cell's monitor, told of the body as the switches say."""
    body = seen.body
    if body is None:
        raise ValueError("the variants are for a cell that follows the body (Cell.body)")
    measured, watched, still = params.measured > 0.5, params.head > 0.5, params.still > 0.5
    told = replace(
        body,
        v_h=jnp.where(still, 0.0, body.v_h),
        gain=jnp.where(still, 0.0, jnp.asarray(body.gain, body.v_h.dtype)),
        counts=body.counts & measured,
        distance=jnp.where(measured, body.distance, FAR),
        head_distance=jnp.where(watched, body.head_distance, FAR),
    )
    return separation_monitor(params.safety, memory, replace(seen, body=told))


PART = SafetyPart(initial_zone, decide, lambda params: params.safety.ssm)


class LoopBench:
    """The cell of the papers, its people sensed by two stationary cameras, and its compiled program."""

    def __init__(self, seconds: float) -> None:
        cell = make_cell(body=BodyParams())
        self.cell = replace(cell, ticks=round(seconds / cell.dt), safety=PART)

    @cached_property
    def settings(self) -> Params:
        """The parameters of all variants, along the leading axis of `safety`."""
        params = Params()
        nearer = eqx.tree_at(lambda s: s.zone.hysteresis, params.safety, params.safety.zone.measured_hysteresis)
        each = [
            Uses(
                nearer if name == "alike" else params.safety,
                name in ("speed", "body", "still"),
                name in ("head", "body"),
                name == "still",
            )
            for name in VARIANTS
        ]
        stacked = jax.tree.map(lambda *leaves: jnp.asarray(leaves, jnp.float32), *each)
        rest = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), params)
        return eqx.tree_at(lambda p: p.safety, rest, stacked)

    @cached_property
    def _program(self) -> Any:
        cell, ssm = self.cell, Params().safety.ssm

        def one(params: Params, world: World, fields: Any) -> dict[str, Array]:
            run = episode(params, cell, world, fields)
            record, found = run.record, outcome(params, cell, world, run)
            person = jax.vmap(lambda t: person_at(world.person, t))(jnp.asarray(cell.times, record.q.dtype))
            seen = real_exposure(cell.arm, ssm, cell.dt, record.q, record.qd, person)
            return {
                "zone": record.zone, "reasons": record.reasons, "status": record.status, "counts": counted(cell, world, record.tool),
                "separation": seen.separation, "excess": seen.excess, "excess_assumed": seen.excess_assumed, "short": seen.short,
                "arrived": found.metrics.success, "time_to_goal": found.metrics.time_to_goal, "hit": found.hit,
                "run_into": found.run_into,
            }  # fmt: skip

        def run(params: Params, world: World) -> dict[str, Array]:
            fields = cell.field.fit(params.field, world.frames)
            axes = jax.tree.map(lambda _: None, params)
            by_safety = jax.tree.map(lambda _: 0, params.safety)
            axes = eqx.tree_at(lambda p: p.safety, axes, by_safety, is_leaf=lambda x: x is None)
            return jax.vmap(one, in_axes=(axes, None, None))(params, world, fields)

        return jax.jit(run, compiler_options=unrolled_options())

    def case(self, name: str, seed: int) -> dict[str, np.ndarray]:
        """What is stored of a person with a seed of noise and motions, the variants along the leading axis."""
        duration, scene = self.cell.ticks * self.cell.dt, scene_named(SCENE, seed)
        person = make_people(name, scene, seed, duration, 1)
        world = make_world(self.cell, scene, person, cell_rig(scene), jax.random.key(seed))
        played = {key: np.asarray(value) for key, value in self._program(self.settings, world).items()}
        fit = world.frames.body
        assert fit is not None  # the cell follows the body
        clean = name in MOTIONS or not any(f"over {FASTEST:g} m/s" in note for note in recording_notes(name, duration))
        return played | {
            "dt": np.asarray(self.cell.dt), "clean": np.asarray(clean), "tracked": np.asarray(fit.tracked),
            "age": np.asarray(fit.age), "explained": np.asarray(fit.explained),
        }  # fmt: skip
