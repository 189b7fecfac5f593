"""Memory of a sweep of 100,000 settings: computed, joined into results.nc, drawn.

The outputs have the names, shapes and types of the real sweep's (150 samples of every trace) and the chunks its size, but they
are computed in microseconds, so that memory and storage alone are measured. A process of its own runs it; each row of memory is
the largest resident set of this process until the end of a phase. The import of the program and of its compiler takes the
first row. `stored_mb` is the size of results.nc; the chunks take as much again.
"""

import json
import math
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp

from hrcjax.cells.problem import build_problem
from hrcjax.lab.errors import UsageError
from hrcjax.sweeps.dataset import taken_names
from hrcjax.sweeps.engine import chunk_size, run_sweep
from hrcjax.sweeps.merge import merge_results
from hrcjax.sweeps.settings import make_settings
from hrcjax.sweeps.store import RESULTS, open_store
from hrcjax.sweeps.sweepable import Sweepable

GRID = ("K_att=log:0.03:0.2:50", "K_rep=log:1e-6:1e-3:50", "zeta=lin:1.5:5:40")
WAYPOINTS = 48
WHOLE = {"zone": jnp.int8, "plan_status": jnp.int32}
"""Traces of whole numbers."""


def cheap_problem() -> Sweepable:
    """The problem of the sweep with outputs that cost nothing."""
    real = build_problem(("robotica",), ("reach_in",), (0,))
    sizes = {"time": len(real.coords["time"][0]), "waypoint": WAYPOINTS, "xyz": 3}

    def evaluate(params: Any, world: Any) -> dict[str, jax.Array]:
        number = jnp.log(params.potential.k_att) + params.potential.zeta + world
        worth = {"low": 1.0, "high": -1.0, "": 1.0}  # mostly good or bad together: fronts of few settings, as real ones
        out = {
            name: worth[metric.better] * number + 0.1 * jnp.sin(100 * number + i)
            for i, (name, metric) in enumerate(real.metrics.items())
        }
        for name, trace in real.traces.items():
            shape = tuple(sizes[dim] for dim in trace.dims)
            steps = jnp.arange(math.prod(shape), dtype=jnp.float32).reshape(shape)
            wide = number.reshape(-1, *(1 for _ in shape)) + steps
            out[name] = wide.astype(WHOLE.get(name, jnp.float32))
        return {**out, "status": jnp.zeros(number.shape, jnp.int32)}

    world = {"scene": "robotica", "person": "reach_in", "seed": 0}, lambda: jnp.zeros((), jnp.float32)
    return replace(real, evaluate=evaluate, worlds=[world], describe=None, described={}, identity=None, notes=())


def peak() -> float:
    """The largest resident set of this process until now [MB]."""
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most / 1e6 if sys.platform == "darwin" else most * 1024 / 1e6


def measure(folder: Path, grid: tuple[str, ...] = GRID) -> dict[str, dict[str, Any]]:
    """The rows, measured in this process."""
    from hrcjax.sweeps.figures import draw_run  # here: other sections do without drawing

    problem = cheap_problem()
    settings = make_settings(grid, problem.params, aliases=problem.aliases, taken=taken_names(problem))
    chunk = chunk_size(settings.count, 1000.0, problem.bytes_per_setting)
    rows: dict[str, dict[str, Any]] = {"import_peak_mb": {"value": peak(), "unit": "MB"}}
    attrs = {"title": "sweep", "rank": problem.rank, "trade_off": list(problem.trade_off), "fingerprint": "scale"}
    with open_store(folder, "scale", {"identity": {}}) as store:

        def compute() -> None:
            run_sweep(problem, settings, store, chunk)

        def join() -> None:
            merge_results(problem, settings, store, chunk, attrs)

        phases = {"sweep": compute, "results": join, "figures": lambda: draw_run(folder, problem.rank)}
        for name, phase in phases.items():
            begin = time.perf_counter()
            phase()
            rows[f"{name}_s"] = {"value": time.perf_counter() - begin, "unit": "s"}
            rows[f"{name}_peak_mb"] = {"value": peak(), "unit": "MB"}
    rows["stored_mb"] = {"value": (folder / RESULTS).stat().st_size / 1e6, "unit": "MB"}
    rows["settings"] = {"value": settings.count, "unit": "1"}
    return rows


def run() -> dict[str, dict[str, Any]]:
    """Memory and seconds, by row."""
    with tempfile.TemporaryDirectory(prefix="hrcjax-scale-") as folder:
        words = [sys.executable, "-m", __name__, folder]
        done = subprocess.run(words, stdout=subprocess.PIPE, text=True)
        if done.returncode:
            raise UsageError(f"section scale: its process ended with status {done.returncode}; its messages are above")
        return json.loads(done.stdout.splitlines()[-1])


if __name__ == "__main__":
    print(json.dumps(measure(Path(sys.argv[1]) / "run")))
