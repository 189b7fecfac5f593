"""The gradient of whole episodes over their length, against central differences, in double precision: a check, not a speed.

K_att, K_rep and zeta of the default cell, logarithms of all three, loss `progress`, in four worlds: scenes robotica and hri, people
who reach in and pass by. `error` is the largest difference between derivative and central difference, relative to the difference, of
any knob in any world; `norm` is that of the gradient of the mean loss, which would explode or vanish with the horizon if the
loop amplified or forgot small changes. Where a switch of the closed loop lies between the two points of a difference, the derivative is that of
one side: `within` is the share of derivatives that agree within 1e-3. Of two steps, 1e-5 and 1e-6 of a logarithm, the difference counts
that is nearer to the derivative: a switch that lies within the larger step seldom lies within the smaller, and rounding spoils the smaller where
a derivative is tiny; a wrong derivative agrees with neither. Beside a person who reaches in, the loss of ten seconds has a switch
within 1e-5 of the default settings, and its slope changes sign within 1e-3.
"""

from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.cells import build_world, make_cell
from hrcjax.lab.parameters import leaf_names, set_leaves
from hrcjax.sim import Params
from hrcjax.tune import parse_losses
from hrcjax.tune.staged import StagedGradient
from hrcjax.tune.stages import Stages

from .grad import KNOBS

SECONDS = (1, 10, 30)
WORLDS = (("robotica", "reach_in"), ("robotica", "pass_by"), ("hri", "reach_in"), ("hri", "pass_by"))
STEPS = (1e-5, 1e-6)
"""Of a logarithm, to either side [1]."""
AGREE = 1e-3
SMALL = 1e-9
"""Differences smaller than this count as so large [1]."""


def doubled(tree: Any) -> Any:
    """A tree with its floating arrays in double precision."""
    return jax.tree.map(
        lambda a: jnp.asarray(a, jnp.float64) if jnp.issubdtype(jnp.result_type(a), jnp.inexact) else jnp.asarray(a), tree
    )  # fmt: skip


def slopes(seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives (world, knob) and central differences (step, world, knob) of episodes of a length [s]."""
    cell = make_cell()
    cell = replace(cell, ticks=round(seconds / cell.dt))
    worlds = [build_world(cell, *names, 0) for names in WORLDS]
    cell = replace(cell, obstacles=max(int(np.sum(world.scene.mask)) for world in worlds))
    start = {name: leaf_names(Params())[name] for name in KNOBS}
    losses, weights = parse_losses(["progress"])
    with jax.enable_x64(True):
        params = doubled(Params())
        stacked = doubled(jax.tree.map(lambda *rows: np.stack(rows), *worlds))
        stages = Stages(
            cell, losses, weights, lambda v: set_leaves(params, dict(zip(start, jnp.exp(v), strict=True))), tuple(start)
        )
        moves = np.concatenate([side * step * np.eye(len(start)) for step in STEPS for side in (1, -1)])
        at = np.log(np.array(list(start.values())))
        points = jnp.asarray(np.concatenate([at[None], at + moves]), jnp.float64)
        derivatives, differences = [], []
        program = None
        for k in range(len(worlds)):
            one = jax.tree.map(lambda a, k=k: a[k : k + 1], stacked)
            program = program or StagedGradient(stages, points, one)
            found = program(points, one)
            loss = np.asarray(found.loss)
            derivatives.append(np.asarray(found.gradient)[0])
            ahead, behind = np.moveaxis(loss[1:].reshape(len(STEPS), 2, len(at)), 1, 0)
            differences.append((ahead - behind) / (2 * np.array(STEPS)[:, None]))
    return np.stack(derivatives), np.stack(differences, axis=1)


def compared(seconds: float, by_chain: np.ndarray, by_difference: np.ndarray) -> dict[str, dict[str, Any]]:
    """Rows of one horizon, of derivatives (world, knob) and central differences (step, world, knob)."""
    error = np.abs(by_chain - by_difference) / np.maximum(np.abs(by_difference), SMALL)
    error = np.where(np.isfinite(error), error, np.inf).min(axis=0)
    found = {
        "error": (error.max(), "low"),
        "within": ((error <= AGREE).mean(), "high"),
        "norm": (np.linalg.norm(by_chain.mean(axis=0)), ""),
        "not_finite": ((~np.isfinite(by_chain)).sum(), "low"),
    }
    return {
        f"{name}_{seconds:g}_s": {"value": float(value), "unit": "1", "better": better}
        for name, (value, better) in found.items()
    }


def run(horizons: tuple[float, ...] = SECONDS) -> dict[str, dict[str, Any]]:
    """Rows of the section."""
    rows: dict[str, dict[str, Any]] = {}
    for seconds in horizons:
        rows |= compared(seconds, *slopes(seconds))
    return rows
