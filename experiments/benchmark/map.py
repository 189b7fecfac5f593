"""Time from a 640 x 480 image to the updated map, and of queries, in a room of 12 m.

A camera with the noise of a D435i turns in one place until the map holds some 20,000 points; there updates are timed. Then it
moves through the room until the map holds 200,000, returns, and updates are timed again with the same images. Program and
capacity are the same. Rendering is not timed. Queries read the larger map, in a process with one thread.
"""

import time
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.map import (
    FieldMap,
    FrameParams,
    MapLayout,
    StreamState,
    empty_map,
    initial_stream,
    take_frame,
)
from hrcjax.sense import Camera, NoiseParams, d435i
from hrcjax.sense.camera import render_scene
from hrcjax.sense.noise import measure
from hrcjax.world import Scene
from hrcjax.world.scene import BOX
from hrcjax.world.scenes import Obstacle, make_scene

from .map_queries import measure_in_one_thread, measure_queries

LAYOUT = MapLayout(lower=(-6.0, -6.0, -1.0), shape=(120, 120, 40), capacity=16384, levels=4, seen=3072)
PARAMS = FrameParams()
SMALL, LARGE = 20_000, 200_000
WARM, FRAMES, MOST_FRAMES = 120, 100, 3000


def room() -> Scene:
    """Four walls and twelve boxes on the floor."""
    random = np.random.default_rng(0)
    walls = [
        ((x, y, 0.8), (0.1 if x else 6.0, 0.1 if y else 6.0, 1.7))
        for x, y in ((5.8, 0), (-5.8, 0), (0, 5.8), (0, -5.8))
    ]
    places = random.uniform(-5, 5, (12, 2))
    boxes = [((*place, -0.2), tuple(random.uniform(0.2, 0.5, 3))) for place in places]

    def solid(middle: Sequence[float], half: Sequence[float]) -> Obstacle:
        (x, y, z), (a, b, c) = middle, half
        return Obstacle(BOX, (float(x), float(y), float(z)), (float(a), float(b), float(c)), 0.0, 0.1)

    solids = [solid(*one) for one in (*walls, *boxes)]
    return make_scene(solids, (0.0,) * 3, (0.1,) * 3, (-6.0,) * 3, (6.0,) * 3)


def walking(frame: Any) -> Camera:
    """A path through the room with a turning camera, tilted down slightly."""
    a = 0.011 * frame
    eye = jnp.stack([4.3 * jnp.cos(a) * jnp.cos(0.31 * a), 4.3 * jnp.sin(a) * jnp.cos(0.23 * a), 0.9 + 0 * a])
    turn = 2.7 * a
    return d435i(eye, eye + jnp.stack([jnp.cos(turn), jnp.sin(turn), -0.55 + 0.3 * jnp.sin(0.7 * a)]), 1)


def looking(frame: Any) -> Camera:
    """A camera in one place that pans over a corner with boxes."""
    turn = 0.8 + 0.3 * jnp.sin(0.05 * frame)
    eye = jnp.stack([4.3 + 0.1 * jnp.sin(0.03 * frame), 4.3 + 0 * turn, 0.8 + 0 * turn])
    return d435i(eye, eye + jnp.stack([jnp.cos(turn), jnp.sin(turn), -0.4 + 0 * turn]), 1)


def count_points(state: FieldMap) -> int:
    """Points of level 0."""
    return int(jnp.sum(state.levels[0].rows[:, 3] > 0))


def run() -> dict[str, dict[str, Any]]:
    """Rows of {"value", "unit"}."""
    scene = room()

    def images(camera: Any) -> Any:
        """Frame -> camera and measured image."""

        def image(frame: jax.Array) -> tuple[Camera, jax.Array]:
            at = camera(frame)
            return at, measure(render_scene(at, scene), at, jax.random.fold_in(jax.random.key(0), frame), NoiseParams())

        return jax.jit(image)

    walk, stay = images(walking), images(looking)

    def update(state: FieldMap, stream: StreamState, stamp: jax.Array, camera: Camera, depth: jax.Array) -> Any:
        return take_frame(LAYOUT, PARAMS, state, stream, stamp, camera, depth)

    state, stream, clock = empty_map(LAYOUT), initial_stream(), 0
    begin = time.perf_counter()
    step = jax.jit(update, donate_argnums=0).lower(state, stream, jnp.float32(0), *stay(jnp.float32(0))).compile()
    compile_s = time.perf_counter() - begin
    times: dict[int, list[float]] = {SMALL: [], LARGE: []}
    sizes, faults, refusals = {}, 0, 0
    for size in (SMALL, LARGE):
        frame = 0
        while size == LARGE and count_points(state) < size and frame < MOST_FRAMES:
            stream = initial_stream()  # not timed, and its pose jumps
            state, *_ = step(state, stream, jnp.float32(clock / 30), *walk(jnp.float32(frame)))
            frame, clock = frame + 1, clock + 1
        stream = initial_stream()
        for k in range(WARM + FRAMES):
            image = jax.block_until_ready(stay(jnp.float32(k)))
            begin = time.perf_counter()
            state, stream, report, refused = jax.block_until_ready(step(state, stream, jnp.float32(clock / 30), *image))
            seconds = time.perf_counter() - begin
            clock += 1
            if k >= WARM:
                times[size].append(seconds)
                faults += int(report.lost) + int(report.unseen) + int(report.deferred) + int(report.left_out)
                refusals += int(refused) != 0
        sizes[size] = count_points(state)
    p95, median = ({n: 1e3 * float(np.percentile(t, q)) for n, t in times.items()} for q in (95, 50))

    middle = np.asarray(looking(0.0).position) + np.array([0.9, 0.6, -0.8])
    queries = measure_in_one_thread(LAYOUT, PARAMS.map, state, middle)
    spread = measure_queries(LAYOUT, PARAMS.map, state, middle)
    return {
        "p95_ms": {"value": max(p95.values()), "unit": "ms"},
        "p95_20000_ms": {"value": p95[SMALL], "unit": f"ms at {sizes[SMALL]} points"},
        "p95_200000_ms": {"value": p95[LARGE], "unit": f"ms at {sizes[LARGE]} points"},
        "median_20000_ms": {"value": median[SMALL], "unit": "ms"},
        "median_200000_ms": {"value": median[LARGE], "unit": "ms"},
        "growth_ratio": {"value": p95[LARGE] / p95[SMALL], "unit": "1"},
        **queries,
        "query_18_all_threads_ms": {**spread["query_18_ms"], "unit": "ms, in a process with all threads"},
        "query_ratio_all_threads": {**spread["query_ratio_to_exp"], "unit": "1, both sides with all threads"},
        "refused_frames": {"value": refusals, "unit": "1"},
        "left_for_later": {"value": faults, "unit": "blocks and points that the timed frames did not update"},
        "compile_s": {"value": compile_s, "unit": "s"},
    }
