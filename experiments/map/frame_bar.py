"""How far a recording is: a bar with the rate of frames on a terminal, a line now and then elsewhere."""

import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self, TextIO

from tqdm import tqdm


class FrameBar:
    """Counts frames, of which the total may not be known."""

    def __init__(
        self,
        total: int | None,
        stream: TextIO | None = None,
        every: float = 10.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.stream = stream if stream is not None else sys.stderr
        self.total, self.every, self.clock = total, every, clock
        self.done = self.told = 0
        self.note = ""
        self.begin = self.last = clock()
        self.bar: tqdm | None = None
        if self.stream.isatty():
            self.bar = tqdm(total=total, unit="frame", file=self.stream, dynamic_ncols=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.bar is not None:
            self.bar.close()
        elif self.told < self.done:
            self._tell()

    def say(self, text: str) -> None:
        """One line beside the bar."""
        if self.bar is not None:
            self.bar.write(text, file=self.stream)
        else:
            print(text, file=self.stream, flush=True)

    def advance(self, note: str) -> None:
        """Notes that one more frame has been taken, with what to show beside it."""
        self.done += 1
        self.note = note
        if self.done == 1:  # the first one is compiled for
            self.begin = self.clock()
        if self.bar is not None:
            self.bar.set_postfix_str(note, refresh=False)
            self.bar.update(1)
        elif self.clock() - self.last >= self.every or self.done == self.total:
            self._tell()

    def _tell(self) -> None:
        self.last, self.told = self.clock(), self.done
        rate = (self.done - 1) / max(self.last - self.begin, 1e-9)
        speed = f"{rate:.3g} frames/s, " if self.done > 1 else ""
        of = "" if self.total is None else f"/{self.total}"
        print(f"{self.done}{of} frames, {speed}{self.note}", file=self.stream, flush=True)
