"""Several runs of an optimiser that asks for one point at a time, side by side: their questions are answered in batches.

Every run is a thread. A round waits until each has asked or ended, so that the batches, and all results, are the same every time.
"""

import queue
import threading
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Answer = tuple[float, NDArray]
"""Value and gradient."""
Ask = Callable[[NDArray], Answer]


class Ended(Exception):
    """No more answers."""


class _Run:
    def __init__(self, work: Callable[[Ask], None]) -> None:
        self.asked: queue.Queue[Any] = queue.Queue()
        self.answers: queue.Queue[Answer | None] = queue.Queue()
        self.error: BaseException | None = None
        self.thread = threading.Thread(target=self._play, args=(work,), daemon=True)
        self.thread.start()

    def _play(self, work: Callable[[Ask], None]) -> None:
        try:
            work(self._ask)
        except Ended:
            pass
        except BaseException as error:  # raised again by who waits
            self.error = error
        finally:
            self.asked.put(None)

    def _ask(self, x: NDArray) -> Answer:
        self.asked.put(np.array(x, float))
        answer = self.answers.get()
        if answer is None:
            raise Ended
        return answer


def in_lockstep(
    works: Sequence[Callable[[Ask], None]],
    answer: Callable[[NDArray], tuple[NDArray, NDArray]],
    affordable: Callable[[], int],
) -> None:
    """Plays all runs until they end or nothing more is affordable; the first ones are answered where not all can be.

    Args:
        works: each asks for points until it returns; `Ended` passes through it.
        answer: values (point,) and gradients (point, parameter) of points.
        affordable: number of points that can still be answered.
    """
    runs = [_Run(work) for work in works]
    try:
        waiting = list(runs)
        while waiting:
            asked = [(run, x) for run in waiting if (x := run.asked.get()) is not None]
            for run in waiting:
                if run.error is not None:
                    raise run.error
            count = min(len(asked), affordable())
            if count:
                values, slopes = answer(np.stack([x for _, x in asked[:count]]))
                for k, (run, _) in enumerate(asked[:count]):
                    run.answers.put((float(values[k]), slopes[k]))
            waiting = [run for run, _ in asked[:count]]
    finally:
        for run in runs:
            run.answers.put(None)
        for run in runs:
            run.thread.join()
