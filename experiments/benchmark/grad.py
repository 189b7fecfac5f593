"""Value and gradient of a batch of complete episodes compared with the value alone, in float32 on all cores.

K_att, K_rep and zeta of the default cell are differentiated, in reverse mode through plan and all ticks, by the programs of
`hrcjax.tune.staged`; the loss is `progress`. `compile_s` is the time until all of them are compiled in a process that has nothing on
disk, `second_process_s` the same in a new process that finds them there. `new_loss_s` is the time for another loss in the first one, the
terms `time` and `jerk`; `new_sound_loss_s` for `sound`, which computes exact distances to people and obstacles with their derivatives;
`new_weights_s` then for `sound`, `time` and `jerk` together with other weights: every term is a program, and its weight an argument.
`share_of_ticks` is that of forward and reverse ticks in the time of value and gradient; the rest is plan, fields and loss.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.experimental.compilation_cache import compilation_cache

from hrcjax.cells import build_world, make_cell
from hrcjax.lab.parameters import leaf_names, set_leaves
from hrcjax.numerics import unrolled_options
from hrcjax.sim import Params, World
from hrcjax.tune import parse_losses
from hrcjax.tune.staged import StagedGradient
from hrcjax.tune.stages import Stages

BATCH = 64
KNOBS = ("potential.k_att", "potential.k_rep", "potential.zeta")
SPREAD = 0.1
"""Largest change of the parameters in the batch [1]."""


def best_time(f: Callable[..., Any], *args: Any, repeat: int) -> float:
    """Best time of a few calls [s]."""
    times = []
    for _ in range(repeat):
        begin = time.perf_counter()
        jax.block_until_ready(f(*args))
        times.append(time.perf_counter() - begin)
    return min(times)


def problem(batch: int = BATCH) -> tuple[Stages, jax.Array, World]:
    """The stages of episodes with a person who reaches in, parameters of the batch, and the world."""
    cell = make_cell()
    world = build_world(cell, "robotica", "reach_in", 0)
    cell = replace(cell, obstacles=int(np.sum(world.scene.mask)))  # as the programs do
    names = {name: leaf_names(Params())[name] for name in KNOBS}
    losses, weights = parse_losses(["progress"])
    stages = Stages(
        cell, losses, weights, lambda v: set_leaves(Params(), dict(zip(names, v, strict=True))), tuple(names)
    )
    spread = jnp.linspace(1 - SPREAD, 1 + SPREAD, batch)[:, None]
    vectors = (spread * jnp.asarray(list(names.values()))).astype(jnp.float32)
    return stages, vectors, jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], world)


SECOND = """
import importlib
import sys
import jax
jax.config.update("jax_compilation_cache_dir", sys.argv[1])
problem = importlib.import_module(sys.argv[3]).problem
from hrcjax.tune.staged import StagedGradient
print("seconds", StagedGradient(*problem(int(sys.argv[2])), "benchmark").compile_s)
"""


def run(repeat: int = 2, batch: int = BATCH) -> dict[str, dict[str, Any]]:
    """Rows of the section."""
    stages, vectors, worlds = problem(batch)
    before = jax.config.jax_compilation_cache_dir  # pyright: ignore[reportAttributeAccessIssue]  # set at run time
    with tempfile.TemporaryDirectory() as cache:
        jax.config.update("jax_compilation_cache_dir", cache)
        try:
            gradient = StagedGradient(stages, vectors, worlds, "benchmark")
        finally:
            jax.config.update("jax_compilation_cache_dir", before)
            compilation_cache.reset_cache()  # it would go on writing into the folder that is removed
        done = subprocess.run(
            [sys.executable, "-c", SECOND, cache, str(batch), __name__], capture_output=True, text=True, check=True
        )
        second_s = float(done.stdout.split("seconds")[1])
    compile_s = gradient.compile_s

    def values(vectors: jax.Array, worlds: World) -> jax.Array:
        paths = stages.plan(vectors, worlds)
        runs = stages.ticks(vectors, worlds, paths[1], stages.fit(vectors, worlds))
        return stages.loss(vectors, worlds, paths[0], runs)[0]

    value = jax.jit(values).lower(vectors, worlds).compile(compiler_options=unrolled_options())
    jax.block_until_ready((value(vectors, worlds), gradient(vectors, worlds)))
    forward, both = (best_time(f, vectors, worlds, repeat=repeat) for f in (value, gradient))
    seconds = gradient.timed(vectors, worlds)
    gradient.identity = None  # not from the disk
    new_s = {}
    for row, words in (
        ("new_loss_s", ["time", "jerk=0.1"]), ("new_sound_loss_s", ["sound"]), ("new_weights_s", ["sound=2", "time=0.1", "jerk=0.2"]),
    ):  # fmt: skip
        losses, weights = parse_losses(words)
        gradient.new_loss(replace(stages, losses=losses, weights=weights))
        new_s[row] = {"value": gradient.compile_s, "unit": "s"}
    low = {"better": "low"}
    return {
        "ratio_to_forward": {"value": both / forward, "unit": "1", **low},
        "compile_s": {"value": compile_s, "unit": "s"},
        **new_s,
        "second_process_s": {"value": second_s, "unit": "s"},
        "forward_s": {"value": forward, "unit": "s"},
        "gradient_s": {"value": both, "unit": "s"},
        "share_of_ticks": {
            "value": (seconds["ticks"] + seconds["ticks back"]) / sum(seconds.values()),
            "unit": "1",
            "better": "",
        },
        "ticks_per_s": {"value": batch * stages.cell.ticks / both, "unit": "1/s"},
        "not_finite": {"value": float(np.sum(~np.isfinite(gradient(vectors, worlds).gradient))), "unit": "1", **low},
        "clipped_calls": {"value": gradient.clipped, "unit": "1", **low},
    }
