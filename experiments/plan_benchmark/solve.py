"""Rounds of guesses: the straight line for all problems, then more and more guesses for the ones that are left.

Pairs of a problem and a guess are the rows of one program, whichever problems they belong to: solved problems leave no gaps.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.plan.guesses import detours
from hrcjax.plan.joint_spline import control_places, fit_matrix
from hrcjax.plan.link_model import LinkModel
from hrcjax.plan.roadmap import roadmap_lines, subdivided
from hrcjax.plan.rounded_boxes import RoundedBoxes
from hrcjax.plan.shortest import Problem, ShortestParams, configurations, guess_cost, problem, quality, shortened

from .checker import Checker
from .problems import Problems, joint_length

CONTROL, SAMPLES, FINE = 12, 64, 129
"""Control points of a path, configurations at which it is optimised, and by which it is handed to the checker."""
ROWS = 16
"""Pairs of problem and guess optimised at once."""
STEPS = 6
"""Steps of one call of the program."""
FIRST = 0.03
"""Share of the stiffness in the first step."""
SCHEDULE = (((FIRST, 0.17), False), ((0.17, 1.0), True), ((1.0, 1.0), False), ((1.0, 1.0), True))
"""Calls of the program for a guess: shares of the stiffness at begin and end, and whether what it finds is checked."""
TIGHTENED = 2
"""Calls for an accepted path."""
HOPELESS_FIRST, HOPELESS = 0.05, 0.025
"""A path that misses its distances by more after a call is given up [m]: one that is not checked, one that is."""
ROUNDS = ((1, 1), (32, 3), (96, 8), (192, 16), (384, 32), (1024, 64))
"""Guesses drawn for each problem, and those of least cost that are optimised, round by round."""
DRAWN, DRAWN_SAMPLES = 64, 32
"""Guesses whose cost is computed at once, and configurations at which it is."""
WIDTHS = 0.4, 2.5
"""Least and greatest size of random detours, in proportion to the straight line's length."""
AGAIN, AGAIN_ROUNDS = 1.25, 3
"""A path this much longer than the straight line is sought anew, in this many rounds at most."""
TIGHT = ShortestParams(gap=0.006, self_gap=0.003, bending=3e-4)
"""Last steps, from a free path: nearer to the obstacles."""
WIDE = ShortestParams()
ROADMAPS = ((1000, False, 14), (2000, True, 14), (6000, True, 30), (20000, True, 30))
"""Configurations drawn, whether the exact check judges them, and neighbours that each is joined to; until a line is found."""
GUIDED = len(ROUNDS) + 1
"""Round of the guesses by a roadmap."""


@dataclass
class Solved:
    """What became of the problems."""

    paths: list[NDArray | None]
    """(waypoint joint) free path of each, or None."""
    stage: NDArray
    """Round that solved it, 0 the straight line without optimisation, GUIDED a roadmap's guess; -1: unsolved."""
    seconds: float = 0.0
    """Time of optimisation and checks, without compiling, before the guesses by roadmaps."""
    cpu_seconds: float = 0.0
    """The same as time of all cores."""
    guided_seconds: float = 0.0
    """Time with the roadmaps' guesses."""
    compile_seconds: float = 0.0
    """Of the optimiser, which takes longest to."""
    log: list[str] = field(default_factory=list)


def options() -> dict[str, str | bool]:
    """Compiler options: barriers are kept, as they keep shared terms from being computed anew."""
    if jax.default_backend() != "cpu":
        return {}
    return {"xla_disable_hlo_passes": "cse_barrier_expander", "xla_backend_optimization_level": "1"}


class Program:
    """The optimiser of some rows at once, compiled."""

    def __init__(self, model: LinkModel, problems: Problems, rows_at_once: int = ROWS) -> None:
        self.rows_at_once = rows_at_once
        self.arrays: list[NDArray] = []
        self.give(problems)

        def rows(count: int) -> list[NDArray]:
            return [x[np.zeros(count, int)] for x in self.arrays]

        def guesses(count: int) -> jax.Array:
            return jnp.zeros((count, CONTROL - 2, model.arm.chain.size), jnp.float32)

        def ends(start: jax.Array, goal: jax.Array, *solids: jax.Array) -> tuple[jax.Array, jax.Array]:
            return problem(model, start, goal, RoundedBoxes(*solids)).ends

        def cost(inner: jax.Array, start: jax.Array, goal: jax.Array, *solids: jax.Array) -> jax.Array:
            nothing = jnp.zeros((0, 2), jnp.float32)  # the cost of a guess asks for no gaps at the ends
            at = Problem(start, goal, RoundedBoxes(*solids), (nothing, nothing))
            return guess_cost(model, self._numbers(WIDE), at, inner, DRAWN_SAMPLES, jnp.float32(FIRST))

        def one(inner: jax.Array, params: ShortestParams, shares: jax.Array, *arrays: jax.Array):
            start, goal, *solids, near, pairs = arrays
            at = Problem(start, goal, RoundedBoxes(*solids), (near, pairs))
            inner = shortened(model, params, at, inner, SAMPLES, STEPS, shares[0], shares[1])
            found = quality(model, params, at, inner, SAMPLES)
            return inner, configurations(at, inner, FINE), found.length, found.gap, found.missed

        self.ends = jax.jit(jax.vmap(ends), compiler_options=options()).lower(*rows(DRAWN)).compile()
        self.costs = jax.jit(jax.vmap(cost), compiler_options=options()).lower(guesses(DRAWN), *rows(DRAWN)).compile()
        at_ends = [x[:rows_at_once] for x in self.ends(*rows(DRAWN))]
        every = jax.vmap(one, in_axes=(0, None, None, *([0] * (len(self.arrays) + 2))))
        begin = time.perf_counter()
        asked = (guesses(rows_at_once), self._numbers(WIDE), jnp.ones(2, jnp.float32), *rows(rows_at_once), *at_ends)
        self.compiled = jax.jit(every, compiler_options=options()).lower(*asked).compile()
        self.compile_seconds = time.perf_counter() - begin
        self.at_ends: list[NDArray] = []

    def give(self, problems: Problems) -> None:
        """Other problems, of the shapes that the program was compiled for."""
        arrays = problems.start, problems.goal, problems.center, problems.half, problems.radius
        self.arrays = [np.asarray(x, np.float32) for x in arrays]
        self.arrays += [] if problems.rotation is None else [np.asarray(problems.rotation, np.float32)]

    def measure_ends(self) -> None:
        """Computes the gaps at the ends of all problems."""
        found = []
        for begin in range(0, len(self.arrays[0]), DRAWN):
            rows = np.minimum(np.arange(begin, begin + DRAWN), len(self.arrays[0]) - 1)
            found.append(self.ends(*(x[rows] for x in self.arrays)))
        self.at_ends = [np.concatenate([np.asarray(x) for x in part]) for part in zip(*found, strict=True)]

    @staticmethod
    def _numbers(params: ShortestParams) -> ShortestParams:
        return jax.tree.map(jnp.float32, params)

    def best(self, which: NDArray, inner: NDArray, count: int) -> NDArray:
        """The guesses of least cost of every problem: `inner` holds as many for each, one problem after the other."""
        if len(inner) == count * len(which):
            return inner
        each = len(inner) // len(which)
        owner = np.repeat(which, each)

        def some(begin: int) -> NDArray:
            rows = np.resize(np.arange(begin, min(begin + DRAWN, len(inner))), DRAWN)
            return np.asarray(self.costs(np.float32(inner[rows]), *(x[owner[rows]] for x in self.arrays)))

        found = [some(begin) for begin in range(0, len(inner), DRAWN)]
        cost = np.concatenate(found)[: len(inner)].reshape(len(which), each)
        chosen = np.argsort(cost, axis=1)[:, :count] + each * np.arange(len(which))[:, None]
        return inner[chosen.reshape(-1)]

    def __call__(self, which: NDArray, inner: NDArray, params: ShortestParams, shares: tuple[float, float]) -> "Found":
        """What some steps make of every row, with the stiffness going from one share to another."""
        numbers, between = self._numbers(params), np.asarray(shares, np.float32)
        at_once = self.rows_at_once

        def some(begin: int) -> list[NDArray]:
            rows = np.resize(np.arange(begin, min(begin + at_once, len(which))), at_once)
            inputs = (x[which[rows]] for x in (*self.arrays, *self.at_ends))
            return [np.asarray(x) for x in self.compiled(np.float32(inner[rows]), numbers, between, *inputs)]

        results = [some(begin) for begin in range(0, len(which), at_once)]
        parts = [np.concatenate(part)[: len(which)] for part in zip(*results, strict=True)]
        return Found(np.asarray(which), *parts)


class Found(NamedTuple):
    """Rows of problems and paths."""

    which: NDArray
    """(row) problem"""
    inner: NDArray
    """(row inner joint) control points [rad]"""
    paths: NDArray
    """(row configuration joint) [rad]"""
    length: NDArray
    """(row) [rad]"""
    gap: NDArray
    """(row) least of all gaps [m]"""
    missed: NDArray
    """(row) most that a gap misses what is asked for [m]"""

    def of(self, rows: NDArray) -> "Found":
        """Some rows."""
        return Found(*(x[rows] for x in self))


def guesses_for(problems: Problems, k: int, number: int, low: NDArray, high: NDArray) -> NDArray:
    """A round's guesses for one problem, (guess inner joint): the straight line, or that with random detours, each second one
    wider than the one before."""
    start, goal = problems.start[k], problems.goal[k]
    straight = start + control_places(CONTROL)[1:-1, None] * (goal - start)
    if number == 0:
        return straight[None]
    count = ROUNDS[number][0]
    rng = np.random.default_rng(number)
    waves = detours(count, len(start), CONTROL, seed=number)
    extent = max(float(np.linalg.norm(goal - start)), 1.5) / np.sqrt(len(start))
    narrow, widest = np.log(WIDTHS)
    wide = np.exp(rng.uniform(narrow, widest, count))[:, None, None]
    return np.clip(straight + wide * extent * waves, low, high)


class Solver:
    """All problems, round by round."""

    def __init__(
        self,
        model: LinkModel,
        checker: Checker,
        problems: Problems,
        progress: Callable[[str], None],
        program: Program | None = None,
    ) -> None:
        """Args: program: compiled before for problems of these shapes; None: it is compiled, and the checker too."""
        self.model, self.checker, self.problems, self.progress = model, checker, problems, progress
        count = len(problems)
        self.solved = Solved([None] * count, np.full(count, -1))
        self.possible = np.ones(count, bool)
        self.best: dict[int, NDArray] = {}  # control points of the accepted paths
        if program is None:
            checker.warm(problems)
            program = Program(model, problems)
        program.give(problems)
        self.program = program
        self.solved.compile_seconds = self.program.compile_seconds

    def _accept(self, stage: int, found: Found) -> None:
        """Takes the shortest free path of each problem; paths are checked in order of their length, until one is free."""
        left: dict[int, list[int]] = {int(k): [] for k in found.which}
        for row in np.argsort(found.length):
            k = int(found.which[row])
            old = self.solved.paths[k]
            if (
                found.gap[row] > -0.004
                and np.isfinite(found.paths[row]).all()
                and (old is None or found.length[row] < joint_length(old) - 1e-4)
            ):
                left[k].append(int(row))
        while rows := [queue.pop(0) for queue in left.values() if queue]:
            paths = [np.asarray(found.paths[row], float) for row in rows]
            free = self.checker.free(self.problems, found.which[rows], paths)
            for row, path, ok in zip(rows, paths, free, strict=True):
                if ok:
                    k = int(found.which[row])
                    left[k] = []
                    self.solved.paths[k], self.best[k] = path, found.inner[row]
                    if self.solved.stage[k] < 0:
                        self.solved.stage[k] = stage

    def optimise(self, stage: int, which: NDArray, inner: NDArray) -> None:
        """Optimises guesses, and takes what is free; what is far from that is given up on the way."""
        for shares, checked in SCHEDULE:
            found = self.program(which, inner, WIDE, shares)
            if checked:
                self._accept(stage, found)
            going = found.missed < (HOPELESS if checked else HOPELESS_FIRST)
            if checked:
                going &= np.array([self.solved.stage[k] < 0 for k in which], bool)
            which, inner = which[going], found.inner[going]
            if not len(which):
                return

    def tighten(self, stage: int, which: Sequence[int]) -> None:
        """Shortens accepted paths, nearer to the obstacles."""
        rows = np.array([k for k in which if k in self.best], int)
        if len(rows):
            inner = np.stack([self.best[k] for k in rows])
            found = self.program(rows, inner, TIGHT, (1.0, 1.0))
            for _ in range(TIGHTENED - 1):
                found = self.program(rows, found.inner, TIGHT, (1.0, 1.0))
            self._accept(stage, found)

    def _wanted(self, number: int) -> NDArray:
        """Problems that a round is for."""
        wanted = []
        for k, path in enumerate(self.solved.paths):
            straight = float(np.linalg.norm(self.problems.goal[k] - self.problems.start[k]))
            long = path is not None and joint_length(path) > AGAIN * straight and number < AGAIN_ROUNDS
            if self.possible[k] and (path is None or long):
                wanted.append(k)
        return np.array(wanted, int)

    def run(self) -> Solved:
        """Solves them."""
        solved, problems = self.solved, self.problems
        begin, cpu = time.perf_counter(), time.process_time()
        straight = [np.stack([a, b]) for a, b in zip(problems.start, problems.goal, strict=True)]
        for k in np.flatnonzero(self.checker.free(problems, np.arange(len(problems)), straight)):
            solved.paths[k], solved.stage[k] = straight[k], 0
        every = np.arange(len(problems))
        self.program.measure_ends()
        self.possible = self.checker.configurations_free(problems, every, problems.start)
        self.possible &= self.checker.configurations_free(problems, every, problems.goal)
        low, high = self.model.arm.q_min, self.model.arm.q_max
        for number in range(len(ROUNDS)):
            wanted = self._wanted(number)
            if not len(wanted):
                continue
            guesses = [guesses_for(problems, int(k), number, low, high) for k in wanted]
            before = int((solved.stage < 0).sum())
            count = ROUNDS[number][1]
            chosen = self.program.best(wanted, np.concatenate(guesses), count)
            self.optimise(number + 1, np.repeat(wanted, count), chosen)
            solved.log.append(
                f"round {number + 1}: {len(wanted)} problems, {count} of {len(guesses[0])} guesses each; "
                f"{before - int((solved.stage < 0).sum())} of {before} solved, {time.process_time() - cpu:.1f} s of CPU so far"
            )
            self.progress(solved.log[-1])
        self.tighten(0, list(self.best))
        solved.seconds, solved.cpu_seconds = time.perf_counter() - begin, time.process_time() - cpu
        begin = time.perf_counter()
        self.guide()
        solved.guided_seconds = solved.seconds + time.perf_counter() - begin
        return solved

    def guide(self) -> None:
        """Guesses by roadmaps for what is left; the roadmap's own line where none of them leads to a free path."""
        left = [int(k) for k in np.flatnonzero(self.possible & (self.solved.stage < 0))]
        low, high = self.model.arm.q_min, self.model.arm.q_max
        fit = fit_matrix(CONTROL, np.linspace(0, 1, SAMPLES))
        for k in left:
            start, goal = self.problems.start[k], self.problems.goal[k]
            lines: list[NDArray] = []
            for samples, exact, neighbours in ROADMAPS:

                def free(q: NDArray, k: int = k, exact: bool = exact) -> NDArray:
                    return self.checker.configurations_free(self.problems, np.full(len(q), k), q, exact)

                rng = np.random.default_rng(samples)
                if lines := roadmap_lines(start, goal, low, high, free, rng, samples, neighbours):
                    break
            if not lines:
                continue
            even = np.stack([fit @ _evenly(line, SAMPLES) for line in lines])
            self.optimise(GUIDED, np.full(len(lines), k), even)
            self.tighten(GUIDED, [k])
            best = min(lines, key=joint_length)
            old = self.solved.paths[k]
            if (old is None or joint_length(best) < joint_length(old)) and self.checker.free(
                self.problems, [k], [best]
            )[0]:
                self.solved.paths[k], self.solved.stage[k] = best, GUIDED
        if left:
            done = sum(self.solved.stage[k] >= 0 for k in left)
            self.progress(f"roadmaps: {done} of {len(left)} solved")


def _evenly(line: NDArray, count: int) -> NDArray:
    """Points evenly along a broken line, (count joint)."""
    fine = subdivided(line, 0.02)
    ends = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
    return np.stack([np.interp(np.linspace(0, ends[-1], count), ends, x) for x in fine.T], axis=1)


def solve_all(model: LinkModel, checker: Checker, problems: Problems, progress: Callable[[str], None]) -> Solved:
    """All problems, round by round."""
    return Solver(model, checker, problems, progress).run()
