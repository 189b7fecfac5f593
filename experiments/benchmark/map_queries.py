"""Queries of the larger map and bare exponentials, both in a process with one thread (`PJRT_NPROC=1`, no asynchronous
dispatch).

A single query is some thirty small operations. With several threads XLA distributes each of them, and the synchronisation
costs more than it saves: 18 queries then take two to three times as long, and the ratio doubles, as the exponential alone
does gain from the second core. So a control loop best queries its map in a process with one thread. The median of 18
queries varies with the load of the machine, from 0.20 to 0.34 ms in six runs; the best is the same in each. The ratio to a
bare exponential counts empty voxels too. A fifth of the groups of queries need more blocks than a group reads, and are
evaluated one by one. `python -m experiments.benchmark.map_queries FILE X Y Z` prints the rows for the map in a file as
JSON, asked within an arm's reach of a place.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.io.map_file import open_map, save_map
from hrcjax.map import FieldMap, MapLayout, MapParams, map_distances_and_gradients
from hrcjax.map.batch import GROUP_BLOCKS
from hrcjax.map.layout import VOXELS

CONTROL_POINTS, QUERIES, WORKSPACE = 18, 100_000, 0.8
ONE_THREAD = {"PJRT_NPROC": "1"}
"""Environment of a process in which XLA has one thread."""

Rows = dict[str, dict[str, Any]]


def _times(f: Any, *args: Any, repeat: int) -> np.ndarray:
    jax.block_until_ready(f(*args))
    times = []
    for _ in range(repeat):
        begin = time.perf_counter()
        jax.block_until_ready(f(*args))
        times.append(time.perf_counter() - begin)
    return np.asarray(times)


def measure_queries(layout: MapLayout, params: MapParams, state: FieldMap, middle: np.ndarray) -> Rows:
    """Rows of {"value", "unit"}, measured in this process.

    Args:
        middle: centre of the cube of the queries (3,) [m].
    """
    rows = np.asarray(state.levels[0].rows)
    points = np.moveaxis(rows[:, :3], 1, 2)[rows[:, 3] > 0]
    random = np.random.default_rng(1)
    within_reach = points[np.abs(points - middle).max(axis=1) < WORKSPACE]

    def near(places: np.ndarray, count: int) -> jax.Array:
        """Queries within some 30 cm of surfaces."""
        at = places[random.integers(0, len(places), count)]
        return jnp.asarray(at + random.uniform(-0.2, 0.2, at.shape), jnp.float32)

    read = jax.jit(lambda levels, x: map_distances_and_gradients(layout, levels, params.ratio, x, corrected=False))
    few = _times(read, state.levels, near(within_reach, CONTROL_POINTS), repeat=2000)
    reach = float(np.min(_times(read, state.levels, near(within_reach, QUERIES), repeat=3)))
    room = float(np.min(_times(read, state.levels, near(points, QUERIES), repeat=2)))
    pairs = QUERIES * VOXELS * GROUP_BLOCKS
    ready = jax.random.uniform(jax.random.key(2), (16_384, 1_000), jnp.float32, -20.0, 0.0)
    exp = float(np.min(_times(jax.jit(lambda a: jnp.sum(jnp.exp(a), axis=1)), ready, repeat=5))) / ready.size
    return {
        "query_18_ms": {"value": 1e3 * float(np.median(few)), "unit": "ms"},
        "query_18_best_ms": {"value": 1e3 * float(np.min(few)), "unit": "ms"},
        "query_ratio_to_exp": {"value": reach / pairs / exp, "unit": "1, in a cube of 1.6 m"},
        "query_us": {"value": 1e6 * reach / QUERIES, "unit": "us per query, in a cube of 1.6 m"},
        "query_room_us": {"value": 1e6 * room / QUERIES, "unit": "us per query, in the whole room"},
        "exp_ns": {"value": 1e9 * exp, "unit": "ns per exponential"},
    }


def measure_in_one_thread(layout: MapLayout, params: MapParams, state: FieldMap, middle: np.ndarray) -> Rows:
    """The same in a separate process with one thread."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "map.npz"
        save_map(file, layout, params, state)
        command = [sys.executable, "-m", __name__, str(file), *(f"{v:.9g}" for v in middle)]
        found = subprocess.run(command, env={**os.environ, **ONE_THREAD}, capture_output=True, text=True, check=False)
    if found.returncode:
        raise RuntimeError(f"queries in one thread: {found.stderr.strip()[-2000:]}")
    return json.loads(found.stdout)


def main(arguments: list[str]) -> None:
    """The program."""
    jax.config.update("jax_cpu_enable_async_dispatch", False)  # run on the calling thread
    layout, params, state = open_map(arguments[0])
    middle = np.asarray([float(v) for v in arguments[1:4]])
    print(json.dumps(measure_queries(layout, params, state, middle)))


if __name__ == "__main__":
    main(sys.argv[1:])
