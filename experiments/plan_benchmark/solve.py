"""Stages of guesses: the straight line for all problems, then batches of more guesses for the ones that are left."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.geom.segment import FAR
from hrcjax.geom.shape import box_distance
from hrcjax.numerics import unrolled_options
from hrcjax.plan import ArmPathParams, ArmPlanSizes, PlanBody, PotentialParams
from hrcjax.plan.arm_optimise import polished, ramped, samples_of
from hrcjax.plan.arm_task import ArmTask, arm_task
from hrcjax.plan.guesses import arches, control_places, descent_guess, detour_guesses, detours, straight_guess

from .checker import Checker
from .problems import Problems, joint_length

GAP = 0.02
"""Distance that the optimiser keeps from boxes, where it can [m]."""
PATH = ArmPathParams(omega2=1e-3, omega3=0.0, tool_weight=0.0, joint_weight=1.0, self_gap=0.005)
"""Length is that in the joints, as of the reference paths."""
POTENTIAL = PotentialParams(k_rep=0.0, zeta=2.0)
"""Nothing repels; the required distance is (zeta - 1) GAP."""
SIZES = ArmPlanSizes(control=12, samples=64, iterations=20, polish=4)
FINE = 129
"""Configurations by which a path is handed to the checker."""
STAGES = ((1, 16), (12, 4), (32, 2))
"""Guesses for each problem, and problems at once."""


@dataclass
class Solved:
    """What became of the problems."""

    paths: list[NDArray | None]
    """(waypoint joint) free path of each, or None."""
    stage: NDArray
    """Stage that solved it, 0 the straight line without optimisation; -1: unsolved."""
    seconds: float = 0.0
    """Time of optimisation and checks, without compiling."""
    compile_seconds: float = 0.0
    log: list[str] = field(default_factory=list)


def task_of(
    body: PlanBody, start: jax.Array, goal: jax.Array, center: jax.Array, half: jax.Array, boxes: jax.Array
) -> ArmTask:
    """A problem for the optimiser."""

    def distances(x: jax.Array) -> jax.Array:
        found = jax.vmap(box_distance, in_axes=(None, 0, 0))(x, center, half)
        return jnp.where(jnp.arange(center.shape[0]) < boxes, found, FAR)

    wide = jnp.full(3, jnp.inf, start.dtype)
    radius = jnp.full(center.shape[0], GAP, start.dtype)
    path, potential = jax.tree.map(lambda x: jnp.asarray(x, start.dtype), (PATH, POTENTIAL))
    return arm_task(path, potential, body, start, goal, distances, radius, -wide, wide)


def optimised(body: PlanBody, stage: int) -> Callable[..., jax.Array]:
    """The paths of a stage's guesses for one problem, (guess configuration joint)."""
    count = STAGES[stage][0]

    def solve(start: jax.Array, goal: jax.Array, center: jax.Array, half: jax.Array, boxes: jax.Array) -> jax.Array:
        task = task_of(body, start, goal, center, half, boxes)
        straight = straight_guess(task, SIZES)
        if stage == 0:
            found = straight[None]
        else:
            known = []
            if stage == 1:
                hump = jnp.asarray(np.sin(np.pi * control_places(SIZES.control)[1:-1]), start.dtype)[:, None]
                known = [descent_guess(task, SIZES)[0][None], straight + hump * arches(task)[:, None, :]]
            random = jnp.asarray(
                detours(count - 4 if stage == 1 else count, body.size, SIZES.control, stage), start.dtype
            )
            found = jnp.concatenate([*known, detour_guesses(task, SIZES, random)])

        def finish(inner: jax.Array) -> jax.Array:
            inner = polished(task, ramped(task, inner, SIZES), SIZES)
            return samples_of(task, inner, FINE)

        return jax.vmap(finish)(found)

    return solve


def solve_all(body: PlanBody, checker: Checker, problems: Problems, progress: Callable[[str], None]) -> Solved:
    """All problems, stage by stage."""
    count = len(problems)
    solved = Solved([None] * count, np.full(count, -1))
    begin = time.perf_counter()
    straight = [np.stack([a, b]) for a, b in zip(problems.start, problems.goal, strict=True)]
    checker.free(problems, [0], straight[:1])
    solved.compile_seconds += time.perf_counter() - begin
    begin = time.perf_counter()
    for k in np.flatnonzero(checker.free(problems, range(count), straight)):
        solved.paths[k], solved.stage[k] = straight[k], 0
    solved.seconds += time.perf_counter() - begin
    for stage, (guesses, batch) in enumerate(STAGES):
        left = np.flatnonzero(solved.stage < 0)
        if not len(left):
            break
        progress(f"{len(left)} of {count} left for stage {stage + 1}, {guesses} guesses each")
        arguments = [
            jnp.asarray(np.float32(x)) for x in (problems.start, problems.goal, problems.center, problems.half)
        ]
        arguments.append(jnp.asarray(problems.boxes))
        begin = time.perf_counter()
        program = jax.jit(jax.vmap(optimised(body, stage)), compiler_options=unrolled_options())
        program = program.lower(*(x[np.resize(left, batch)] for x in arguments)).compile()
        solved.compile_seconds += time.perf_counter() - begin
        begin = time.perf_counter()
        for first in range(0, len(left), batch):
            rows = left[first : first + batch]
            paths = np.asarray(program(*(x[np.resize(rows, batch)] for x in arguments)), float)[: len(rows)]
            _accept(checker, problems, solved, stage, rows, paths)
        solved.seconds += time.perf_counter() - begin
        solved.log.append(f"stage {stage + 1}: {int((solved.stage == stage + 1).sum())} of {len(left)}")
        progress(solved.log[-1])
    return solved


def _accept(
    checker: Checker, problems: Problems, solved: Solved, stage: int, rows: Sequence[int] | NDArray, paths: NDArray
) -> None:
    """Takes the shortest free path of each problem."""
    finite = np.asarray(np.isfinite(paths).all(axis=(2, 3)))
    flat = [(k, g) for k in range(len(rows)) for g in range(paths.shape[1]) if bool(finite[k, g])]
    free = checker.free(problems, [rows[k] for k, _ in flat], [paths[k, g] for k, g in flat])
    for (k, g), ok in zip(flat, free, strict=True):
        old = solved.paths[rows[k]]
        if ok and (old is None or joint_length(paths[k, g]) < joint_length(old)):
            solved.paths[rows[k]], solved.stage[rows[k]] = paths[k, g], stage + 1
