"""Time of one image in the loop: judged, tracked, made a cloud, and a field fitted to it; not its rendering."""

import time
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.presence import update_track
from hrcjax.robot import arm_capsules
from hrcjax.sense import judge_image, no_faults
from hrcjax.sense.camera import render_capsules
from hrcjax.sense.noise import measure
from hrcjax.sim import Frames
from hrcjax.sim.prepare import frame_stamps, nominal_motion, stage_for
from hrcjax.sim.sensing import frame_of
from hrcjax.sim.survey import crop_box
from hrcjax.sim.watch import Watch, initial_watch, periods
from hrcjax.typing import Array
from hrcjax.world.person import person_at

from .worlds import MOTION_SHARE, Bench, SetUp

WARM = 5
"""Images before the clock counts."""


def images_case(bench: Bench, made: SetUp, count: int) -> dict[str, Any]:
    """The images of an episode beside somebody who reaches in, one by one as they come."""
    cell, params, dtype = bench.cell, bench.sense, bench.dtype
    person = bench.person(made, "reach_in")
    stage = stage_for(made.rig, made.scene, person, no_faults(made.rig.count, dtype))
    capacity, period = cell.moving_points * cell.people, periods(made.rig, dtype)

    @jax.jit
    def shown(stage: Any, camera: Array, at: Array, q: Array, key: Array) -> tuple[Array, Array]:
        eye = jax.tree.map(lambda a: a[camera], stage.rig.cameras)
        nothing = jnp.full((eye.height, eye.width), jnp.inf, dtype)
        robot = render_capsules(eye, arm_capsules(cell.arm, q), nothing)
        everything = render_capsules(eye, person_at(stage.person, at), jnp.minimum(stage.scene_depth[camera], robot))
        return measure(everything, eye, key, params.noise), robot

    @jax.jit
    def one(
        survey: Any,
        stage: Any,
        field: Any,
        state: Watch,
        camera: Array,
        at: Array,
        q: Array,
        depth: Array,
        robot: Array,
        fit: Any,
    ):
        own = jax.tree.map(lambda a: a[camera], state.health)
        own, reasons = judge_image(params.health, own, depth, at, at + cell.latency, jnp.asarray(False))
        track = update_track(
            cell.voxels, params.presence, survey.empty, state.track, camera, stage.rig.cameras, period, at, reasons == 0,
            depth, robot, crop_box(params, dtype),
        )  # fmt: skip
        health = jax.tree.map(lambda all_, one: all_.at[camera].set(one), state.health, own)
        state = Watch(track, health, state.reasons.at[camera].set(reasons))
        made_of = frame_of(cell.voxels, params, survey, stage, state, arm_capsules(cell.arm, q), capacity)
        cloud, beyond, why, guarded = jax.tree.map(lambda a: a[None], made_of)
        frames = Frames(
            field, cloud, beyond, at[None], camera[None], (reasons == 0)[None], why, guarded, survey.overflow
        )
        return state, cell.field.fit(fit, frames).moving

    stamps, cameras = frame_stamps(cell, made.rig)
    first = max(int(0.3 * len(stamps)), 0)
    chosen = np.arange(first, min(first + count + WARM, len(stamps)))
    motion = nominal_motion(made.q_start, made.q_goal, jnp.asarray(stamps, dtype), MOTION_SHARE * cell.ticks * cell.dt)
    state = initial_watch(cell.voxels, made.survey, jnp.asarray(stamps[first], dtype))
    times = []
    for k in chosen:
        camera, at = jnp.asarray(cameras[k]), jnp.asarray(stamps[k], dtype)
        depth, robot = jax.block_until_ready(shown(stage, camera, at, motion[k], jax.random.fold_in(made.key, int(k))))
        begin = time.perf_counter()
        state, fields = one(
            made.survey, stage, made.field, state, camera, at, motion[k], depth, robot, bench.params.field
        )
        jax.block_until_ready((state, fields))
        times.append(time.perf_counter() - begin)
    return {"seconds": times[WARM:]}
