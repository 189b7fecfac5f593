"""A recording that is read while it is used."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from hrcjax.io.recordings.frame import InputFrame

Skip = Callable[[str], None]  # takes the reason why something could not be used


@dataclass(eq=False)
class InputSource:
    """Frames of a recording, read one by one. Each iteration starts at the first frame again.

    Attributes:
        path: what was opened.
        kind: what it is, in words.
        length: number of frames, an upper bound if some turn out to be unusable; None if not known without reading all.
        skipped: one line for each frame (or group of poses) that could not be used, as far as the iteration got.
        notes: one line for each thing that was read from a file beside the frames, inferred, or assumed.
    """

    path: Path
    kind: str
    length: int | None
    read: Callable[[Skip], Iterator[InputFrame]]
    skipped: list[str] = field(default_factory=list)
    notes: tuple[str, ...] = ()

    def __iter__(self) -> Iterator[InputFrame]:
        """The frames.

        Raises:
            UsageError: a file that is broken; one line says which and what is accepted.
        """
        self.skipped.clear()
        return self.read(self.skipped.append)
