"""Progress of a run: a bar with the time left on a terminal, otherwise a line every few seconds."""

import math
import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self, TextIO

from tqdm import tqdm


def duration(seconds: float) -> str:
    """Duration as text: "40 s", "3 min 20 s", "2 h 5 min"."""
    whole = round(seconds)
    if whole < 60:
        return f"{seconds:.1f} s" if seconds < 10 else f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


class Progress:
    """Counts settings, frames or other units. The time left is estimated from those that this process computed."""

    def __init__(
        self,
        total: int | None,
        done: int = 0,
        stream: TextIO | None = None,
        every: float = 10.0,
        clock: Callable[[], float] = time.monotonic,
        unit: str = "setting",
    ) -> None:
        """Args: total: None if not known. done: already finished. every: time between two lines [s]."""
        self.stream = stream if stream is not None else sys.stderr
        self.total, self.done, self.every, self.clock, self.unit = total, done, every, clock, unit
        self.computed = 0
        self.busy = 0.0
        """Compute time, without building worlds and compilation [s]."""
        self.told = done
        self.note = ""
        self.last = clock()
        self.before: float | None = None
        self.bar: tqdm | None = None
        if self.stream.isatty():
            self.bar = tqdm(total=total, initial=done, unit=unit, file=self.stream, dynamic_ncols=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.bar is not None:
            self.bar.close()
        elif self.told < self.done:
            self._tell()

    def say(self, text: str, stream: TextIO | None = None) -> None:
        """Prints one line above the bar.

        Args:
            stream: None: that of the bar.
        """
        place = self.stream if stream is None else stream
        if self.bar is not None:
            self.bar.write(text, file=place)
        else:
            print(text, file=place)
        place.flush()

    def left(self) -> float:
        """Time left [s]; infinite before the first chunk and if the total is not known."""
        if self.total is None or not self.computed:
            return float("inf")
        return self.busy / self.computed * (self.total - self.done)

    def advance(self, count: int = 1, seconds: float | None = None, note: str = "") -> None:
        """Counts `count` more units.

        Args:
            seconds: their compute time; None: time since the last call, without the first one, which includes compilation [s].
            note: text shown beside the bar.
        """
        now = self.clock()
        if seconds is None and self.before is not None:
            seconds = now - self.before
        self.before, self.note = now, note
        self.done += count
        if seconds is not None:
            self.computed += count
            self.busy += seconds
        if self.bar is not None:
            self.bar.set_postfix_str(", ".join(self._remaining()), refresh=False)
            self.bar.update(count)
        elif now - self.last >= self.every or self.done == self.total:
            self._tell()

    def _remaining(self) -> list[str]:
        left = [f"{duration(self.left())} left"] if math.isfinite(self.left()) else []
        return left + ([self.note] if self.note else [])

    def _tell(self) -> None:
        self.last, self.told = self.clock(), self.done
        share = "" if self.total is None else f"/{self.total}"
        percent = f" ({100 * self.done // self.total} %)" if self.total else ""
        rate = [f"{self.computed / self.busy:.3g} {self.unit}s/s"] if self.computed and self.busy > 0 else []
        text = ", ".join([f"{self.done}{share} {self.unit}s{percent}", *rate, *self._remaining()])
        print(text, file=self.stream, flush=True)
