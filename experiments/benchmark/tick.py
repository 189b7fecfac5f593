"""One control tick by itself, as a controller calls it, and the way from an image to a command: a core for ticks, another for images.

The default cell beside a person who reaches in, with places for 1,024 points of people in an image; `points` is how many there are in the mean. All is
measured in a process of its own that may use one core, so that ticks and images do not disturb each other. For every tick Python calls one
compiled program with the joint readings, the images kept and the time, and waits for the commanded joint acceleration: `p50_ms` and
`p99_ms` are of that whole call. Ticks go on from each other.

An image takes a second program, `image_p50_ms` and `image_p99_ms`: the camera's health, where people are, their points, and the fit of their field, from
the depth image in the host's memory; it is rendered before. The command that uses an image first is computed in the control period that begins next:
`wait_p99_ms`. `command_p50_ms` and `command_p99_ms` are image, wait and tick together, image by image, from the arrival of an image.
The camera's own time, from the exposure to that arrival, can't be measured without a camera: `left_for_camera_ms` is what remains of 45 ms.

Python's garbage collection is off while the clock runs. `deadline_share` is the share of ticks that take longer than the control period.
"""

import gc
import json
import os
import subprocess
import sys
import time
from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.cells import make_cell
from hrcjax.cells.people import make_people
from hrcjax.lab.compiled import keep_compiled
from hrcjax.numerics import unrolled_options
from hrcjax.robot import ArmState, arm_capsules
from hrcjax.sense import Delivered
from hrcjax.sense.rig import cell_rig
from hrcjax.sim import Params, Task
from hrcjax.sim.episode import plan_route
from hrcjax.sim.own_sensing import Kept, TickImage, first_looks, images_in_use, keep, ticks_of
from hrcjax.sim.prepare import survey_world
from hrcjax.sim.survey import SenseParams
from hrcjax.sim.tick import Record, TickState, initial_state, tick
from hrcjax.sim.watch import Watch, shown, taken
from hrcjax.world import scene_named

TICKS, ROUNDS = 250, 4
"""Ticks of an episode, and how often it is played."""
POINTS = 1024
"""Places for points of people."""
MOST = 45.0
"""From exposure to command [ms]: less than the latency that the cell counts on, 50 ms."""
ALONE = """
import os, sys
os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
import importlib
importlib.import_module(sys.argv[1]).alone(int(sys.argv[2]), int(sys.argv[3]))
"""
"""A process that chooses its core before JAX starts its threads."""


def alone(ticks: int, rounds: int) -> None:
    """Writes the times to the standard output."""
    keep_compiled()
    print("measured" + json.dumps(measured(ticks, rounds)))


def measured(ticks: int, rounds: int) -> dict[str, Any]:
    """Times of ticks, of images, and from the arrival of an image to the end of the tick that uses it [ms]; points of the images."""
    sense = SenseParams()
    cell = replace(make_cell(), ticks=ticks, moving_points=POINTS)
    scene = scene_named("robotica", 0)
    person = make_people("reach_in", scene, 0, cell.ticks * cell.dt, cell.people)
    known = survey_world(cell, scene, person, cell_rig(scene), jax.random.key(0))
    sense = eqx.tree_at(lambda p: p.delay, sense, cell.latency)
    params = jax.tree.map(jnp.float32, Params())
    route = jax.jit(lambda p: plan_route(p, cell, Task(known.scene, known.q_start, p.potential, cell.arm))[1])(params)

    def step(params: Params, kept: Kept, t: jax.Array, state: TickState) -> tuple[TickState, Record]:
        return tick(params, cell, route, images_in_use(cell, known, kept, t), state)

    def image(
        params: Params, state: Watch, kept: Kept, got: Delivered, item: TickImage, q: jax.Array
    ) -> tuple[Watch, Kept]:
        arm, camera = arm_capsules(cell.arm, q), jnp.maximum(item.camera, 0)
        state, good = taken(
            cell.voxels, sense, known.survey, known.stage.rig, state, camera, item.exposed, got, arm, cell.latency
        )
        return state, keep(params, cell, known, sense, state, kept, arm, item.exposed, camera, good)

    depth = jax.jit(
        lambda item, q: shown(
            sense, known.stage, jnp.maximum(item.camera, 0), item.exposed, arm_capsules(cell.arm, q), item.key
        )[0]
    )
    key = jax.random.key(1)
    images = ticks_of(cell, known, key)
    first = jax.jit(lambda params: first_looks(params, cell, known, sense, key))(params)
    compiled_tick = jax.jit(step, compiler_options=unrolled_options())
    compiled_image = jax.jit(image, compiler_options=unrolled_options())
    times: dict[str, list[float]] = {"tick": [], "image": [], "wait": [], "command": []}
    points: list[float] = []
    refused = 0
    for number in range(rounds + 1):  # the first compiles
        arm = initial_state(cell, known.q_start)
        watch, kept = first
        arrived: list[float] = []
        gc.collect()
        gc.disable()
        for k in range(ticks):
            item = jax.tree.map(lambda a, k=k: a[k], images)
            if int(item.camera) >= 0:
                seen = depth(item, arm.arm.q)
                nothing, yes = jnp.zeros((), seen.dtype), jnp.asarray(True)
                as_sent: Any = np.asarray(seen)
                got = Delivered(depth=as_sent, stamp=item.exposed, delay=nothing, arrives=yes)
                jax.block_until_ready((got, kept, watch))
                begin = time.perf_counter()
                watch, kept = jax.block_until_ready(compiled_image(params, watch, kept, got, item, arm.arm.q))
                taken_s = time.perf_counter() - begin
                ready = float(item.exposed) + taken_s
                due = np.ceil(ready / cell.dt - 1e-6) * cell.dt
                arrived.append(taken_s)
                if number:
                    times["image"].append(1e3 * taken_s)
                    times["wait"].append(1e3 * (due - ready))
                    newest = int(jnp.argmax(kept.stamp))
                    points.append(float(jnp.sum(kept.moving.field.mask[newest])))
                    refused += int(watch.reasons[item.camera] != 0)
            measured_arm = ArmState(np.asarray(arm.arm.q), np.asarray(arm.arm.qd))  # pyright: ignore[reportArgumentType]  # as from encoders
            arm = TickState(measured_arm, arm.clock, arm.safety)
            jax.block_until_ready((kept, item.t))
            begin = time.perf_counter()
            arm, record = compiled_tick(params, kept, item.t, arm)
            np.asarray(record.qdd)
            spent = time.perf_counter() - begin
            if number:
                times["tick"].append(1e3 * spent)
                for one in arrived:
                    times["command"].append(times["wait"][-1] + 1e3 * (one + spent))
            arrived = []
        gc.enable()
    return {**times, "points": points, "refused": refused}


def run(ticks: int = TICKS, rounds: int = ROUNDS) -> dict[str, dict[str, Any]]:
    """The rows.

    Raises:
        RuntimeError: the process failed.
    """
    if not hasattr(os, "sched_setaffinity"):
        raise RuntimeError("this system can't bind a process to one core; section tick is measured on Linux")
    done = subprocess.run(
        [sys.executable, "-c", ALONE, __name__, str(ticks), str(rounds)], capture_output=True, text=True
    )
    if done.returncode:
        last = (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1]
        raise RuntimeError(f"the process of one core failed: {last}")
    return rows_of(json.loads(done.stdout.split("measured")[-1]))


def rows_of(found: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Rows of what `measured` gives."""

    def at(name: str, percent: float) -> dict[str, Any]:
        return {"value": float(np.percentile(found[name], percent)), "unit": "ms"}

    period = 1e3 * make_cell().dt
    last = at("command", 99)["value"]
    return {
        "p50_ms": at("tick", 50),
        "p99_ms": at("tick", 99),
        "worst_ms": at("tick", 100),
        "deadline_share": {"value": float(np.mean(np.array(found["tick"]) > period)), "unit": "1", "better": "low"},
        "image_p50_ms": at("image", 50),
        "image_p99_ms": at("image", 99),
        "wait_p99_ms": at("wait", 99),
        "command_p50_ms": at("command", 50),
        "command_p99_ms": at("command", 99),
        "left_for_camera_ms": {"value": MOST - last, "unit": "ms", "better": "high"},
        "refused": {"value": found["refused"], "unit": "images", "better": ""},
        "points": {"value": float(np.mean(found["points"])), "unit": "points", "better": ""},
        "ticks": {"value": len(found["tick"]), "unit": "ticks", "better": ""},
    }
