"""Rates of a camera's health over people who walk, reach and work in front of a moving robot: false alarms, and faults named.

python tests/helpers/watched_cell.py --images 30000
"""

import argparse
import time
from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.segment import point_segment_distance
from hrcjax.robot import Arm, arm_capsules, load_arm, with_tool
from hrcjax.sense import Camera, HealthParams, NoiseParams, d435i, faults, health
from hrcjax.sense.camera import render_capsules, render_scene
from hrcjax.sense.look import look, same_share
from hrcjax.sense.noise import measure
from hrcjax.sense.rig import cell_rig
from hrcjax.world import Person, Scene, motion_named, scene_named
from hrcjax.world.person import person_at
from hrcjax.world.place import path_middle, standing_place

PERIOD = 1 / 30
SETUP = 30
"""Images of the empty cell, from which the health learns."""
USUAL_DELAY, JITTER = 0.03, 0.008
"""Between exposure and arrival; the jitter is uniform to both sides [s]."""
NEAREST = 0.8
"""Least distance of people from the camera for which the rates are stated [m]; nearer people are counted apart."""
ROBOT_NEAREST = 0.4
"""The robot keeps this far from the camera, which measures nothing nearer than 0.28 m [m]."""
MOTIONS = ("reach_in", "pass_by", "stand_and_work")

KINDS = {
    "frozen": (faults.FROZEN, 0.0, health.IDENTICAL),
    "blocked, nothing measured": (faults.BLOCKED, 0.0, health.BLOCKED_VIEW),
    "blocked at 15 cm": (faults.BLOCKED, 0.15, health.BLOCKED_VIEW),
    "blurred by 9": (faults.BLURRED, 9.0, health.BLURRED_VIEW),
    "left half empty": (faults.HALF_EMPTY, 1.0, health.PART_EMPTY),
    "right half empty": (faults.HALF_EMPTY, -1.0, health.PART_EMPTY),
    "late": (faults.LATE, 0.2, health.LATE_ARRIVAL),
    "stamp 0.3 s back": (faults.SKEWED, -0.3, health.SKEWED_STAMP),
    "stamp 0.3 s ahead": (faults.SKEWED, 0.3, health.SKEWED_STAMP),
    "person lost": (faults.PERSON_LOST, 1.0, health.PART_EMPTY),
    "blurred by 5": (faults.BLURRED, 5.0, health.BLURRED_VIEW),
    "blurred by 15": (faults.BLURRED, 15.0, health.BLURRED_VIEW),
}
"""Faults: kind, amount, the bit that names them. From the tenth on they are for information."""


def drawn_camera(scene: Scene, draw: np.random.Generator, decimation: int) -> Camera:
    """The cell's first camera, one opposite, or one near the person: 0.8 to 2 m from where people are."""
    which = int(draw.integers(3))
    if which == 0:
        return jax.tree.map(lambda a: a[0], cell_rig(scene, decimation=decimation).cameras)
    middle = np.asarray(path_middle(scene), float)
    if which == 1:
        eye = np.array([draw.choice([-1.0, 1.0]) * draw.uniform(0.8, 1.2), -0.35, 0.0]) + middle
        eye[2] = draw.uniform(1.0, 1.6)
        return d435i(jnp.asarray(eye, jnp.float32), jnp.asarray(middle, jnp.float32), decimation)
    place = np.asarray(standing_place(scene), float)
    turn, away = draw.uniform(-1.2, 1.2), draw.uniform(0.8, 1.4)
    eye = [place[0] + away * np.sin(turn), place[1] - away * np.cos(turn), draw.uniform(0.7, 1.5)]
    aim = [place[0], place[1] - 0.2, 0.2]
    return d435i(jnp.asarray(eye, jnp.float32), jnp.asarray(aim, jnp.float32), decimation)


@cache
def _arm() -> Arm:
    return with_tool(load_arm("ur5"), 0.12, 0.03)


@jax.jit
def _bodies(q: jax.Array) -> Capsules:
    return jax.vmap(lambda one: arm_capsules(_arm(), one))(q)


@jax.jit
def _gap(camera: Camera, bodies: Capsules) -> jax.Array:
    """Least distance of capsules from a camera, over all times [m]."""
    to_axes = jax.vmap(jax.vmap(point_segment_distance, (None, 0, 0)), (None, 0, 0))
    return jnp.min(to_axes(camera.position, bodies.a, bodies.b) - bodies.radius)


def camera_and_arm(
    scene: Scene, times: np.ndarray, draw: np.random.Generator, decimation: int
) -> tuple[Camera, Capsules]:
    """A camera and an arm that does not come near it: every joint swings about a pose near home."""
    while True:
        camera = drawn_camera(scene, draw, decimation)
        home = np.asarray(_arm().home, float) + draw.uniform(-0.4, 0.4, 6)
        swing, pace, phase = draw.uniform(0.1, 0.5, 6), draw.uniform(0.1, 0.4, 6), draw.uniform(0, 2 * np.pi, 6)
        q = home + swing * np.sin(2 * np.pi * pace * times[:, None] + phase)
        robot = _bodies(jnp.asarray(q, jnp.float32))
        if _gap(camera, robot) >= ROBOT_NEAREST:
            return camera, robot


@partial(jax.jit, static_argnums=0)
def watch(kinds: int, params: HealthParams, camera: Camera, scene: Scene, person: Person, robot: Capsules, times, key):
    """Reasons of every clean image and, for the first `kinds` faults, of the image if the fault began with it."""
    background = render_scene(camera, scene)
    schedule = [
        faults.one_fault(kind, 0, -np.inf, np.inf, 1, amount, times.dtype)
        for kind, amount, _ in list(KINDS.values())[:kinds]
    ]
    schedule = jax.tree.map(lambda *leaves: jnp.stack(leaves), *schedule) if kinds else None

    def frame(state, item):
        exposed, arm, key = item
        key_noise, key_fault, key_delay = jax.random.split(key, 3)
        body = person_at(person, exposed)
        there = exposed >= 0
        body = Capsules(body.a, body.b, jnp.where(there, body.radius, -1.0))
        behind = render_capsules(camera, body, background)
        exact = render_capsules(camera, arm, behind)
        depth = measure(exact, camera, key_noise, NoiseParams())
        shows = (exact == behind) & (behind < background)
        delay = USUAL_DELAY + JITTER * jax.random.uniform(key_delay, (), times.dtype, -1.0, 1.0)

        def if_faulty(one):
            given = faults.deliver(one, jnp.zeros((), jnp.int32), exposed, depth, shows, state.last, key_fault)
            arrived = exposed + delay + given.delay
            return health.judge_image(params, state, given.depth, given.stamp, arrived, ~there)[1]

        found = jax.lax.map(if_faulty, schedule) if kinds else None
        arrived = exposed + delay
        seen = look(depth, params.nearest, params.edge, params.slope)
        same = same_share(depth, state.last)
        margin = jnp.stack(
            [
                jnp.where(
                    seen.edges >= params.least_edges, seen.sharpness / jnp.maximum(state.sharpness, 1e-9), jnp.nan
                ),
                jnp.mean(seen.measured) / jnp.maximum(jnp.mean(state.measured), 1e-9),
                jnp.min(jnp.where(state.measured > params.least_part, seen.measured / state.measured, jnp.inf)),
                same,
                jnp.mean(shows, dtype=times.dtype),
                jnp.min(jax.vmap(point_segment_distance, (None, 0, 0))(camera.position, body.a, body.b) - body.radius),
                seen.edges,
            ]
        )
        quiet = health.silent(params, state, arrived, PERIOD)
        missed = health.silent(params, state, arrived + 0.99 * PERIOD, PERIOD)
        state, reasons = health.judge_image(params, state, depth, exposed, arrived, ~there)
        return state, (reasons | jnp.where(exposed > times[0], quiet, 0), found, missed, margin)

    start = health.initial_health(camera.height, camera.width, times.dtype)
    return jax.lax.scan(frame, start, (times, robot, jax.random.split(key, times.shape[0])))


def play(sequence: int, kinds: int, params: HealthParams, duration: float = 8.0, decimation: int = 4):
    """One sequence: scene, motion, camera and robot drawn from its number."""
    draw = np.random.default_rng(sequence)
    name, seed = [("robotica", 0), ("hri", 0), ("clutter", sequence)][int(draw.integers(3))]
    scene = scene_named(name, seed)
    person = _person(MOTIONS[sequence % len(MOTIONS)], scene, sequence, duration)
    times = (np.arange(SETUP + round(duration / PERIOD)) - SETUP) * PERIOD
    camera, robot = camera_and_arm(scene, times, draw, decimation)
    state, out = watch(
        kinds, params, camera, scene, person, robot, jnp.asarray(times, jnp.float32), jax.random.key(sequence)
    )
    return state, jax.tree.map(np.asarray, out)


def _person(motion: str, scene: Scene, seed: int, duration: float) -> Person:
    return jax.jit(lambda scene: motion_named(motion, scene, seed, duration, 1 / PERIOD))(scene)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--images", type=int, default=30000)
    parser.add_argument("--first", type=int, default=0, help="number of the first sequence")
    parser.add_argument("--every", type=int, default=1, help="faults are tried in every n-th sequence")
    options = parser.parse_args()
    params, began = HealthParams(), time.time()
    clean, found, missed, margins, count, k = [], [], [], [], 0, options.first
    while count < options.images:
        try:
            _, (reasons, each, gone, margin) = play(k, len(KINDS) if k % options.every == 0 else 0, params)
        except ValueError as error:  # a scene that a motion does not fit
            print(k, error)
            k += 1
            continue
        wrong = np.nonzero(reasons)[0]
        if wrong.size:
            print(
                f"sequence {k}: {wrong.size} alarms, people at {margin[wrong, 5].min():.2f} to {margin[wrong, 5].max():.2f} m: "
                f"{health.describe_health(np.bitwise_or.reduce(reasons))}",
                flush=True,
            )
        clean.append(reasons[SETUP:])
        missed.append(gone[SETUP:])
        margins.append(margin[SETUP:])
        if k % options.every == 0:
            found.append(each[SETUP:])
        count += len(reasons) - SETUP
        k += 1
        if k % 10 == 0:
            print(f"{count} images, {time.time() - began:.0f} s", flush=True)
    clean, margins = np.concatenate(clean), np.concatenate(margins)
    print(f"{count} images of {k - options.first} sequences in {time.time() - began:.0f} s")
    far = margins[:, 5] >= NEAREST
    for name, some in ((f"people from {NEAREST} m on, or nobody in view", far), ("people nearer", ~far)):
        alarms = clean[some]
        bits = {words: int(np.count_nonzero(alarms & bit)) for bit, words in health.HEALTH_REASONS.items()}
        bits = {words: count for words, count in bits.items() if count}
        print(f"{name}: {np.count_nonzero(alarms)} false alarms in {len(alarms)} images {bits or ''}")
    for name, column, quantiles in zip(
        (
            "sharpness / learnt",
            "measured / learnt",
            "least quadrant / learnt",
            "share identical",
            "share of person",
            "nearest of person [m]",
            "edges",
        ),
        margins.T,
        (
            (0, 0.01, 0.5),
            (0, 0.01, 0.5),
            (0, 0.01, 0.5),
            (0.5, 0.99, 1),
            (0.5, 0.99, 1),
            (0, 0.01, 0.5),
            (0, 0.01, 0.5),
        ),
        strict=True,
    ):
        column = column[np.isfinite(column)]
        print(f"{name}: " + ", ".join(f"{np.quantile(column, q):.3f} ({q:g})" for q in quantiles))
    print(f"dropped: named {np.mean(np.concatenate(missed) == health.NO_IMAGE):.5f}")
    if found:
        found = np.concatenate(found)
        for j, (name, (_, _, bit)) in enumerate(KINDS.items()):
            others = {w: float(np.mean((found[:, j] & b) != 0)) for b, w in health.HEALTH_REASONS.items() if b != bit}
            others = {w: round(v, 4) for w, v in others.items() if v}
            print(
                f"{name}: named {np.mean((found[:, j] & bit) != 0):.5f} of {len(found)}; any {np.mean(found[:, j] != 0):.5f}; also {others}"
            )


if __name__ == "__main__":
    main()
