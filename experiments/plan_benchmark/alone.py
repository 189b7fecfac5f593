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
    """Time from a problem to its accepted path, roadmaps included, of some problems [s], and the rounds that solved them.

    The optimiser is compiled for one guess at a time: with few guesses a larger batch is mostly empty.
    """
    chosen = drawn_evenly(len(problems), min(count, len(problems)))
    ones = [problems.taken(np.array([k])) for k in chosen]
    checker.warm(ones[0])
    program = Program(model, ones[0], rows_at_once=1)
    seconds, stages = [], []
    for number, one in enumerate([ones[0], *ones]):  # the first is played twice
        begin = time.perf_counter()
        solved = Solver(model, checker, one, lambda _: None, program).run()
        if number:
            seconds.append(time.perf_counter() - begin)
            stages.append(solved.stage[0])
    return np.array(seconds), np.array(stages)
