"""How far a run is: a bar with the time left on a terminal, a line now and then elsewhere."""

import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self, TextIO

from tqdm import tqdm


def duration(seconds: float) -> str:
    """Seconds in words: "40 s", "3 min 20 s", "2 h 5 min"."""
    whole = round(seconds)
    if whole < 60:
        return f"{seconds:.1f} s" if seconds < 10 else f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


class Progress:
    """Counts settings. The time left follows from the settings computed by this process."""

    def __init__(
        self,
        total: int,
        done: int = 0,
        stream: TextIO | None = None,
        every: float = 10.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.stream = stream if stream is not None else sys.stderr
        self.total, self.done, self.every, self.clock = total, done, every, clock
        self.computed = 0
        self.busy = 0.0
        """Time spent on computing settings, without building worlds and compiling [s]."""
        self.last = clock()
        self.bar: tqdm | None = None
        if self.stream.isatty():
            self.bar = tqdm(total=total, initial=done, unit="setting", file=self.stream, dynamic_ncols=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.bar is not None:
            self.bar.close()

    def say(self, text: str) -> None:
        """One line beside the bar."""
        if self.bar is not None:
            self.bar.write(text, file=self.stream)
        else:
            print(text, file=self.stream, flush=True)

    def left(self) -> float:
        """Time left [s]; infinite before the first chunk."""
        return self.busy / self.computed * (self.total - self.done) if self.computed else float("inf")

    def advance(self, settings: int, seconds: float) -> None:
        """Notes that so many settings took so long."""
        self.done += settings
        self.computed += settings
        self.busy += seconds
        if self.bar is not None:
            self.bar.set_postfix_str(f"{duration(self.left())} left", refresh=False)
            self.bar.update(settings)
        elif self.clock() - self.last >= self.every or self.done == self.total:
            self.last = self.clock()
            rate = self.computed / self.busy if self.busy > 0 else 0.0
            share = 100 * self.done // self.total
            text = f"{self.done}/{self.total} settings ({share} %), {rate:.3g} settings/s, {duration(self.left())} left"
            print(text, file=self.stream, flush=True)
