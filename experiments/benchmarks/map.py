"""Time from a 640 x 480 image to the updated map, and of queries, in a room of 12 m.

A camera goes through the room with the noise of a D435i. The same program, with the same capacity, is measured when the
map holds 20,000 and 200,000 points. Rendering is not part of the time. Queries read the larger map.
"""

import time
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.map import FieldMap, MapLayout, MapParams, empty_map, fuse, make_view, map_distance_and_gradient
from hrcjax.map.layout import VOXELS
from hrcjax.map.query import NEAREST
from hrcjax.sense import Camera, NoiseParams, d435i
from hrcjax.sense.camera import render_scene
from hrcjax.sense.noise import measure
from hrcjax.world import Scene
from hrcjax.world.scene import BOX
from hrcjax.world.scenes import Obstacle, make_scene

LAYOUT = MapLayout(lower=(-6.0, -6.0, -1.0), shape=(120, 120, 40), capacity=16384, levels=4)
PARAMS = MapParams()
SMALL, LARGE = 20_000, 200_000
FRAMES, MOST_FRAMES = 100, 3000
CONTROL_POINTS, QUERIES, BATCH = 18, 100_000, 64


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


def camera_at(frame: Any) -> Camera:
    """A walk through the room, turning about, looking down a little."""
    a = 0.011 * frame
    eye = jnp.stack([4.3 * jnp.cos(a) * jnp.cos(0.31 * a), 4.3 * jnp.sin(a) * jnp.cos(0.23 * a), 0.9 + 0 * a])
    turn = 2.7 * a
    return d435i(eye, eye + jnp.stack([jnp.cos(turn), jnp.sin(turn), -0.55 + 0.3 * jnp.sin(0.7 * a)]), 1)


def count_points(state: FieldMap) -> int:
    """Points of level 0."""
    return int(jnp.sum(state.levels[0].rows[:, 3] > 0))


def _times(f: Any, *args: Any, repeat: int) -> np.ndarray:
    jax.block_until_ready(f(*args))
    times = []
    for _ in range(repeat):
        begin = time.perf_counter()
        jax.block_until_ready(f(*args))
        times.append(time.perf_counter() - begin)
    return np.asarray(times)


def run() -> dict[str, dict[str, Any]]:
    """Rows of {"value", "unit"}."""
    scene = room()
    look = jax.jit(
        lambda frame: (
            camera_at(frame),
            measure(render_scene(camera_at(frame), scene), camera_at(frame), jax.random.key(0), NoiseParams()),
        )
    )

    def update(state: FieldMap, camera: Camera, depth: jax.Array) -> Any:
        return fuse(LAYOUT, PARAMS, state, camera, make_view(camera, depth, PARAMS.pixel_noise))

    state = empty_map(LAYOUT)
    begin = time.perf_counter()
    step = jax.jit(update, donate_argnums=0).lower(state, *look(jnp.float32(0))).compile()
    compile_s = time.perf_counter() - begin
    p95, median, sizes, frame, faults = {}, {}, {}, 0, 0
    for size in (SMALL, LARGE):
        while count_points(state) < size:
            state, _ = step(state, *look(jnp.float32(frame)))
            frame += 1
            if frame > MOST_FRAMES:
                break
        times = []
        for _ in range(FRAMES):
            image = jax.block_until_ready(look(jnp.float32(frame)))
            begin = time.perf_counter()
            state, report = jax.block_until_ready(step(state, *image))
            times.append(time.perf_counter() - begin)
            faults += int(report.lost) + int(report.unseen)
            frame += 1
        sizes[size] = count_points(state)
        p95[size], median[size] = (1e3 * float(np.percentile(times, q)) for q in (95, 50))

    levels, ratio = state.levels, PARAMS.ratio
    rows = np.asarray(levels[0].rows)
    points = np.moveaxis(rows[:, :3], 1, 2)[rows[:, 3] > 0]
    random = np.random.default_rng(1)

    def near(count: int) -> jax.Array:
        """Queries within some 30 cm of surfaces."""
        at = points[random.integers(0, len(points), count)]
        return jnp.asarray(at + random.uniform(-0.2, 0.2, at.shape), jnp.float32)

    body = jax.jit(lambda levels, x: jax.vmap(lambda p: map_distance_and_gradient(LAYOUT, levels, ratio, p))(x))
    many = jax.jit(
        lambda levels, x: jax.lax.map(
            lambda p: map_distance_and_gradient(LAYOUT, levels, ratio, p), x, batch_size=BATCH
        )
    )
    arm = near(CONTROL_POINTS)
    query_18 = _times(body, levels, arm, repeat=300)
    bulk = near(QUERIES)
    query_all = float(np.min(_times(many, levels, bulk, repeat=2)))
    pairs = QUERIES * VOXELS * (NEAREST * (LAYOUT.levels - 1) + levels[-1].place.shape[0])
    ready = jax.random.uniform(jax.random.key(2), (16_384, 1_000), jnp.float32, -20.0, 0.0)
    exp = float(np.min(_times(jax.jit(lambda a: jnp.sum(jnp.exp(a), axis=1)), ready, repeat=5))) / ready.size
    return {
        "p95_ms": {"value": max(p95.values()), "unit": "ms"},
        "p95_20000_ms": {"value": p95[SMALL], "unit": f"ms at {sizes[SMALL]} points"},
        "p95_200000_ms": {"value": p95[LARGE], "unit": f"ms at {sizes[LARGE]} points"},
        "median_ms": {"value": median[LARGE], "unit": "ms"},
        "growth_ratio": {"value": p95[LARGE] / p95[SMALL], "unit": "1"},
        "query_18_ms": {"value": 1e3 * float(np.median(query_18)), "unit": "ms"},
        "query_ratio_to_exp": {"value": query_all / pairs / exp, "unit": "1"},
        "query_us": {"value": 1e6 * query_all / QUERIES, "unit": "us a query"},
        "incomplete_blocks": {"value": faults, "unit": "1"},
        "compile_s": {"value": compile_s, "unit": "s"},
    }
