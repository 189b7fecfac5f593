"""All problems by processes side by side, one for each core: steps of one program keep a single core busy, and threads that call
compiled programs can wait for each other for ever."""

import multiprocessing
import os
import sys
import tempfile
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from hrcjax.lab.errors import UsageError
from hrcjax.plan.link_model import link_model

from .checker import Checker
from .problems import TIGHT, Problems, thin_arm
from .solve import Solved, Solver


class Pipe(Protocol):
    """One end of a connection between processes."""

    def send(self, obj: Any, /) -> None: ...

    def recv(self) -> Any: ...


ENDED = "a process that solves problems ended without a result; --processes 1 solves them in this one"
FEWEST = 32
"""Problems of a process, at least."""


def process_count(wanted: int, problems: int) -> int:
    """Number of processes for some problems.

    Args:
        wanted: by the user; 0: one for each core that this process may use.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(wanted or cores, problems // FEWEST))


def parts_of(count: int, processes: int) -> list[np.ndarray]:
    """Indices of each process's problems: every so many."""
    return [np.arange(begin, count, processes) for begin in range(processes)]


def together(count: int, parts: Sequence[np.ndarray], found: Sequence[Solved]) -> Solved:
    """What became of all problems. The slowest process tells the time; the first one, which compiles, the time to compile."""
    whole = Solved([None] * count, np.full(count, -1), compile_seconds=found[0].compile_seconds)
    for number, (part, one) in enumerate(zip(parts, found, strict=True)):
        for k, path in zip(part, one.paths, strict=True):
            whole.paths[k] = path
        whole.stage[part] = one.stage
        whole.log += [f"process {number + 1}: {line}" for line in one.log]
    whole.seconds = max(one.seconds for one in found)
    whole.cpu_seconds = sum(one.cpu_seconds for one in found)
    whole.guided_seconds = max(one.guided_seconds for one in found)
    return whole


def solve_side_by_side(problems: Problems, inflation: float, processes: int) -> Solved:
    """All problems of the thin arm, by that many processes; compiled before the clocks begin.

    Raises:
        UsageError: a process ended without a result.
    """
    context = multiprocessing.get_context("spawn")
    parts = parts_of(len(problems), processes)
    running, before = [], os.environ.get("JAX_COMPILATION_CACHE_DIR")
    with tempfile.TemporaryDirectory() as cache:
        os.environ["JAX_COMPILATION_CACHE_DIR"] = cache  # the first process compiles, the others read
        try:
            for number, part in enumerate(parts):
                ours, theirs = context.Pipe()
                asked = (theirs, problems.taken(part), inflation, f"process {number + 1} of {processes}: ")
                process = context.Process(target=_solve_part, args=asked, daemon=True)
                process.start()
                theirs.close()
                running.append((process, ours))
                if not number:
                    _answer(ours)
            for _, ours in running[1:]:
                _answer(ours)
            for _, ours in running:
                _begin(ours)
            found = [_answer(ours) for _, ours in running]
        finally:
            os.environ.pop("JAX_COMPILATION_CACHE_DIR", None)
            if before is not None:
                os.environ["JAX_COMPILATION_CACHE_DIR"] = before
            for process, ours in running:
                ours.close()
                process.terminate()
                process.join()
    return together(len(problems), parts, found)


def _begin(pipe: Pipe) -> None:
    try:
        pipe.send("go")
    except OSError as error:
        raise UsageError(ENDED) from error


def _answer(pipe: Pipe) -> Any:
    try:
        return pipe.recv()
    except (EOFError, OSError) as error:
        raise UsageError(ENDED) from error


def _solve_part(pipe: Pipe, problems: Problems, inflation: float, name: str) -> None:
    parent = multiprocessing.parent_process()

    def say(text: str) -> None:
        if parent is not None and not parent.is_alive():
            raise EOFError  # nobody waits for the result
        print(name + text, file=sys.stderr, flush=True)

    arm = thin_arm()
    solver = Solver(link_model(arm, inflation, floor=0.0, tight=TIGHT), Checker(arm), problems, say)
    try:
        pipe.send("ready")
        pipe.recv()
        pipe.send(solver.run())
    except (EOFError, OSError, KeyboardInterrupt):
        return  # whoever asked is gone, or stops all
