"""Selection of the frames of a recording."""

from collections.abc import Iterable, Iterator

from hrcjax.io.recordings.frame import InputFrame


def selected(frames: Iterable[InputFrame], start: int, every: int, most: int | None) -> Iterator[InputFrame]:
    """Every n-th frame from `start`, at most `most`."""
    taken = 0
    for number, frame in enumerate(frames):
        if most is not None and taken >= most:
            return
        if number >= start and (number - start) % every == 0:
            taken += 1
            yield frame


def count_selected(length: int | None, start: int, every: int, most: int | None) -> int | None:
    """Number of selected frames; None if not known."""
    if length is None:
        return most
    count = max(0, -(-(length - start) // every))
    return count if most is None else min(count, most)
