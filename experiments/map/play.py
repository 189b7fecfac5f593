"""Fuses the frames of a recording one after the other and collects their results."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from hrcjax.io.recordings.frame import InputFrame
from hrcjax.io.recordings.source import InputSource
from hrcjax.lab.errors import UsageError
from hrcjax.lab.interrupt import Wish
from hrcjax.lab.progress import Progress

from .agreement import Agreement
from .body_check import BodyCheck
from .config import MapConfig
from .mapper import Mapper, Taken
from .notices import Notices

UNKNOWN_SENSOR = (
    "the sensor position of these clouds is unknown: points at any distance are used, and no free space is carved; "
    "give it by --origin X Y Z"
)


@dataclass(eq=False)
class Played:
    """The frames that were used, and how the loop ended."""

    frames: list[Taken] = field(default_factory=list)
    reading: list[float] = field(default_factory=list)
    """Time to read each frame [s]."""
    not_read: dict[str, int] = field(default_factory=dict)
    """Reason -> number of frames that the reader skipped."""
    warnings: list[str] = field(default_factory=list)
    """Inconsistencies between the frames and the poses, camera or robot."""
    interrupted: bool = False
    broken: UsageError | None = None


def sensor_known(config: MapConfig, source: InputSource) -> Callable[[InputFrame], bool]:
    """Whether the sensor position of a frame is known: PLY and NPZ files without one have the identity pose."""

    def known(frame: InputFrame) -> bool:
        if frame.depth is not None or source.kind != "point clouds" or config.see_through == "always":
            return True
        at_origin = not frame.position.any() and np.array_equal(frame.rotation, np.eye(3))
        return not at_origin or config.origin is not None

    return known


def play(
    mapper: Mapper,
    source: InputSource,
    config: MapConfig,
    frames: Iterator[InputFrame],
    count: int | None,
    wish: Wish,
) -> Played:
    """Fuses frames until the recording ends, a file is broken, or a stop is requested.

    Args:
        source: of the frames; it lists those that were skipped.
        count: number of frames; None: not known.
    """
    played, known = Played(), sensor_known(config, source)
    agreement = Agreement()
    body = BodyCheck(mapper.exclusions) if mapper.exclusions.joints is not None else None
    warned, heard = False, 0
    with Progress(count, unit="frame") as bar:
        refused, not_read = Notices(bar.say), Notices(bar.say)
        while not wish.stop:
            begin = time.perf_counter()
            try:
                frame = next(frames, None)
            except UsageError as error:
                played.broken, frame = error, None
            for line in source.skipped[heard:]:
                not_read.add_line(line)
            heard = len(source.skipped)
            if frame is None:
                break
            played.reading.append(time.perf_counter() - begin)
            if not known(frame) and not warned:
                warned = True
                bar.say(UNKNOWN_SENSOR)
            taken = mapper.take(frame, known(frame), config.see_through != "never")
            played.frames.append(taken)
            if taken.refused:
                of = f" of {taken.camera}" if taken.camera else ""
                refused.add(f"frame {len(played.frames) - 1}{of} at {taken.stamp:.3f} s", taken.refused)
            agreement.add(frame)
            if body is not None and (frame.depth is not None or known(frame)):
                body.add(frame)
            bar.advance(note=f"{taken.counts['blocks']} blocks, {1e3 * taken.seconds:.0f} ms")
    played.interrupted = wish.stop
    played.not_read = dict(not_read.reasons)
    played.warnings = [line for line in (agreement.line(), body.line() if body is not None else "") if line]
    return played
