"""Takes the frames of a recording into a map, one after the other, and notes what becomes of them."""

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
    "where the sensor of these clouds stood is not known: all their points count, and none makes free what lies before it; "
    "--origin X Y Z says it"
)


@dataclass(eq=False)
class Played:
    """The frames that were taken, and why the taking ended."""

    frames: list[Taken] = field(default_factory=list)
    reading: list[float] = field(default_factory=list)
    """Time each took to be read [s]."""
    not_read: dict[str, int] = field(default_factory=dict)
    """How often each reason was for which the reader left frames out."""
    warnings: list[str] = field(default_factory=list)
    """What the frames say against the poses, the camera or the robot."""
    interrupted: bool = False
    broken: UsageError | None = None


def sensor_known(config: MapConfig, source: InputSource) -> Callable[[InputFrame], bool]:
    """Whether the place of a frame's sensor is known: PLY and NPZ files that do not say it stand at the origin."""

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
    """Takes frames until there are no more, a file is broken, or it is wished to stop.

    Args:
        source: whose frames they are; it knows which ones were skipped.
        count: of the frames; None: not known.
    """
    played, known = Played(), sensor_known(config, source)
    agreement = Agreement()
    body = BodyCheck(mapper.left_out) if mapper.left_out.joints is not None else None
    warned, heard = False, 0
    with Progress(count, unit="frame") as bar:
        refused, left_out = Notices(bar.say), Notices(bar.say)
        while not wish.stop:
            begin = time.perf_counter()
            try:
                frame = next(frames, None)
            except UsageError as error:
                played.broken, frame = error, None
            for line in source.skipped[heard:]:
                left_out.add_line(line)
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
    played.not_read = dict(left_out.reasons)
    played.warnings = [line for line in (agreement.line(), body.line() if body is not None else "") if line]
    return played
