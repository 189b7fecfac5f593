"""A recording that is read frame by frame."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from hrcjax.io.recordings.frame import InputFrame

Skip = Callable[[str], None]  # called with the reason why a frame or pose is skipped


@dataclass(eq=False)
class InputSource:
    """Frames of a recording, read one by one. Each iteration starts at the first frame again.

    Attributes:
        path: what was opened.
        kind: its format, as text.
        length: number of frames, an upper bound if some are skipped; None if not known without reading all.
        skipped: one line for each frame (or group of poses) skipped so far.
        notes: one line for each setting that was read from a camera file, inferred, or assumed.
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
