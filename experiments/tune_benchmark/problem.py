"""The problem that all methods share: parameters, worlds, the smooth loss, and the true score with its terms."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import jax.numpy as jnp

from hrcjax.cells.named_cell import NamedCell
from hrcjax.lab.errors import UsageError
from hrcjax.metrics.episode import METRICS
from hrcjax.sim import Params, World, episode, outcome
from hrcjax.typing import Array

from ..tune.config import TuneConfig
from ..tune.problem import Problem, closed_loop
from .config import TuneBenchmarkConfig

SCORE = "score_sound"
"""What decides."""
TERMS = ("sound_clearance", "sound_separation", "sound_time", "sound_jerk", "sound_energy")
"""What it is made of."""
REPORTED = (SCORE, "success", "time_to_goal", "clearance", "separation")
"""Metrics of the table."""
YARDSTICK = ("motion.speed", "motion.clock.acceleration")
"""Parameters that the score is measured by, beside all of `safety`: changing them changes the measure."""
Build = Callable[[TuneConfig, NamedCell], Problem]


def tune_config(config: TuneBenchmarkConfig, training: int) -> TuneConfig:
    """The options of the parts shared with `experiments.tune`: every step in all training worlds."""
    return TuneConfig(
        cell=config.cell, params=config.params, frozen=config.frozen, loss=config.loss, scenes=config.scenes, people=config.people,
        seeds=config.seeds, held_out_scenes=config.held_out_scenes, held_out_people=config.held_out_people,
        held_out_seeds=config.held_out_seeds, batch=max(training, 1), rate=config.rate, clip=config.clip, starts=config.starts,
        quick=config.quick,
    )  # fmt: skip


def refuse_yardsticks(names: Sequence[str]) -> None:
    """Refuses parameters that the score is measured by.

    Raises:
        UsageError: one of them is among the names.
    """
    for name in names:
        if name in YARDSTICK or name.startswith("safety."):
            raise UsageError(
                f"--params {name}: the score is measured by it; accepted are all but {', '.join(YARDSTICK)} and safety.*"
            )


def race_problem(config: TuneConfig, named: NamedCell) -> Problem:
    """Whole episodes of a cell, measured by the true score and its terms beside the smooth loss."""
    problem, cell = closed_loop(config, named), named.cell

    def measure(params: Params, world: World) -> Mapping[str, Array]:
        run = episode(params, cell, world, cell.field.fit(params.field, world.frames))
        metrics = outcome(params, cell, world, run).metrics
        each = [jnp.asarray(one.of(params, cell, world, run)) for one in problem.losses]
        total = sum(w * value for w, value in zip(problem.weights, each, strict=True))
        return {name: getattr(metrics, name) for name in (*REPORTED, *TERMS)} | {"loss": jnp.asarray(total)}

    units = {name: METRICS[name][:2] for name in (*REPORTED, *TERMS)} | {"loss": ("1", "low")}
    return replace(problem, measure=measure, units=units)
