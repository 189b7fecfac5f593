"""Problems one by one: how long a single one takes, when everything is compiled."""

import time

import numpy as np
from numpy.typing import NDArray

from hrcjax.plan.link_model import LinkModel

from .checker import Checker
from .problems import Problems, drawn_evenly
from .solve import Program, Solver

COUNT = 100
"""Problems, drawn evenly."""


def seconds_alone(
    model: LinkModel, checker: Checker, problems: Problems, count: int = COUNT
) -> tuple[NDArray, NDArray]:
    """Time of some problems, each by itself, until its path is accepted or it is given up, roadmaps included [s]; and the rounds that
    solved them, -1: none. Problems whose start or goal is not free are left out.

    The optimiser is compiled for one guess at a time: with few guesses a larger batch is mostly empty.
    """
    every = np.arange(len(problems))
    free = checker.configurations_free(problems, every, problems.start)
    possible = problems.taken(np.flatnonzero(free & checker.configurations_free(problems, every, problems.goal)))
    ones = [possible.taken(np.array([k])) for k in drawn_evenly(len(possible), min(count, len(possible)))]
    program = Program(model, ones[0], rows_at_once=1)
    seconds, stages = np.zeros((2, len(ones))), np.zeros(len(ones), int)
    for again in range(2):  # the first time some parts are still compiled
        for k, one in enumerate(ones):
            begin = time.perf_counter()
            stages[k] = Solver(model, checker, one, lambda _: None, program).run().stage[0]
            seconds[again, k] = time.perf_counter() - begin
    return seconds[1], stages
