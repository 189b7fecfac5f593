"""Several runs that ask for one thing at a time, side by side: their questions are answered in batches.

Every run is a thread. A round waits until each has asked or ended, so that the batches, and all results, are the same every time.
"""

import queue
import threading
from collections.abc import Callable, Sequence
from typing import Any

Ask = Callable[[Any], Any]
"""Of a question, its answer."""


class Ended(Exception):
    """No more answers."""


class _Run:
    def __init__(self, work: Callable[[Ask], None]) -> None:
        self.asked: queue.Queue[Any] = queue.Queue()
        self.answers: queue.Queue[Any] = queue.Queue()
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

    def _ask(self, question: Any) -> Any:
        self.asked.put(question)
        answer = self.answers.get()
        if answer is None:
            raise Ended
        return answer


def in_lockstep(
    works: Sequence[Callable[[Ask], None]],
    answer: Callable[[list[Any]], Sequence[Any]],
) -> None:
    """Plays all runs until they end or are not answered.

    Args:
        works: each asks until it returns; `Ended` passes through it.
        answer: the answers of questions, none of them None; if there are fewer, those of the first, and the other runs are ended.
    """
    runs = [_Run(work) for work in works]
    try:
        waiting = list(runs)
        while waiting:
            asked = [(run, question) for run in waiting if (question := run.asked.get()) is not None]
            for run in waiting:
                if run.error is not None:
                    raise run.error
            answers = answer([question for _, question in asked]) if asked else ()
            waiting = [run for (run, _), _ in zip(asked, answers, strict=False)]
            for run, found in zip(waiting, answers, strict=True):
                run.answers.put(found)
    finally:
        for run in runs:
            run.answers.put(None)
        for run in runs:
            run.thread.join()
