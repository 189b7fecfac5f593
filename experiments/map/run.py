"""One run: the recording, frame by frame, into a map, and everything that is written of it."""

import json
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hrcjax.io.map_file import open_map
from hrcjax.io.recordings.frame import InputFrame
from hrcjax.io.recordings.joints import with_joints
from hrcjax.io.recordings.source import InputSource
from hrcjax.lab.errors import UsageError, one_line
from hrcjax.lab.interrupt import stop_on_interrupt
from hrcjax.lab.progress import Progress
from hrcjax.map import MapParams

from .choices import beyond_neighbours, check, check_slices, choose_layout, choose_params, recording
from .config import MapConfig
from .fit_box import fit_layout
from .frame_check import checked
from .left_out import check_overlap, left_out_of
from .map_folder import check_folder, default_folder, prepare_folder
from .mapper import Mapper, Taken
from .notices import Notices
from .results import draw_map, write_data
from .select import count_selected, selected
from .statistics import statistics
from .summary_text import summary_text

INTERRUPTED = 130


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def sensor_known(config: MapConfig, source: InputSource) -> Callable[[InputFrame], bool]:
    """Whether the place of a frame's sensor is known: PLY and NPZ files that do not say it stand at the origin."""

    def known(frame: InputFrame) -> bool:
        if frame.depth is not None or source.kind != "point clouds" or config.see_through == "always":
            return True
        at_origin = not frame.position.any() and np.array_equal(frame.rotation, np.eye(3))
        return not at_origin or config.origin is not None

    return known


class Run:
    """The frames that were taken, and why the taking ended."""

    def __init__(self, mapper: Mapper, source: InputSource, config: MapConfig) -> None:
        self.mapper, self.source, self.config = mapper, source, config
        self.frames: list[Taken] = []
        self.reading: list[float] = []
        self.not_read: dict[str, int] = {}
        self.interrupted = False
        self.broken: UsageError | None = None

    def play(self, frames: Iterator[InputFrame], count: int | None) -> None:
        """Takes frames until there are no more, a file is broken, or the user interrupts."""
        known = sensor_known(self.config, self.source)
        warned = False
        with Progress(count, unit="frame") as bar, stop_on_interrupt() as wish:
            refused, left_out = Notices(bar.say), Notices(bar.say)
            heard = 0
            while not wish.stop:
                begin = time.perf_counter()
                try:
                    frame = next(frames, None)
                except UsageError as error:
                    self.broken, frame = error, None
                for line in self.source.skipped[heard:]:
                    left_out.add_line(line)
                heard = len(self.source.skipped)
                if frame is None:
                    break
                self.reading.append(time.perf_counter() - begin)
                if not known(frame) and not warned:
                    warned = True
                    bar.say(
                        "where the sensor of these clouds stood is not known: all their points count, and none makes free "
                        "what lies before it; --origin X Y Z says it"
                    )
                taken = self.mapper.take(frame, known(frame), self.config.see_through != "never")
                self.frames.append(taken)
                if taken.refused:
                    of = f" of {taken.camera}" if taken.camera else ""
                    refused.add(f"frame {len(self.frames) - 1}{of} at {taken.stamp:.3f} s", taken.refused)
                bar.advance(note=f"{taken.counts['blocks']} blocks, {1e3 * taken.seconds:.0f} ms")
            self.interrupted = wish.stop
            self.not_read = dict(left_out.reasons)


def run(config: MapConfig) -> int:
    """Maps a recording; returns the exit status: 0, or 130 if it was interrupted.

    Raises:
        UsageError: wrong options, a recording that cannot be read, a folder that must not be written to, no frame.
        StorageError: results could not be written.
    """
    begin = time.monotonic()
    check(config)
    assert config.input is not None
    folder = config.output or default_folder(config.input)
    left_out = left_out_of(config)
    source = recording(config)
    if left_out.joints is not None:
        source = with_joints(source, left_out.joints)
    check_folder(folder, config.overwrite)
    state = None
    if config.continue_from is not None:
        layout, params, state = open_map(config.continue_from)
        params, limits = choose_params(config.param, params, continued=True)
    else:
        params, limits = choose_params(config.param, MapParams(), continued=False)
        layout = None
    count = count_selected(source.length, config.start, config.every, config.frames)

    spacing = config.spacing if layout is None else layout.spacing

    def frames() -> Iterator[InputFrame]:
        return checked(selected(source, config.start, config.every, config.frames), spacing)

    _say(f"{source.kind} {source.path} -> {folder}")
    note = beyond_neighbours(config.param, params, spacing)
    if note:
        _say(f"note: {note}")
    if layout is None and config.fit:
        layout = fit_layout(config, frames(), params, sensor_known(config, source), _say, left_out.box)
    if layout is None:
        head = next(frames(), None)
        layout = choose_layout(config, clouds=head is not None and head.cloud is not None)
    check_slices(config.slice_at, layout)
    check_overlap(left_out.box, layout)
    mapper = Mapper(layout, params, limits, state, left_out)
    done = Run(mapper, source, config)
    done.play(frames(), count)
    if not done.frames and done.broken is not None:
        raise done.broken
    if not done.frames:
        raise UsageError(f"{config.input}: no frame was taken; {'stopped before the first one' if done.interrupted else 'choose others by --start, --every, --frames'}")  # fmt: skip
    mapper.settle()
    about: dict[str, Any] = {"input": str(config.input), "kind": source.kind, "interrupted": done.interrupted}
    if config.crop is not None:
        about["crop"] = list(config.crop)
    if config.joints is not None:
        about |= {"joints": str(config.joints), "arm": config.arm}
    if config.continue_from is not None:
        about["continued_from"] = str(config.continue_from)
    found = statistics(
        done.frames,
        done.reading,
        layout,
        params,
        limits,
        mapper.state,
        mapper.programs.seconds,
        done.not_read,
        about,
    )
    prepare_folder(folder)
    names = write_data(folder, layout, params, mapper.state, found)
    if config.figures:
        _say("drawing figures")
        names += draw_map(
            folder, layout, params, mapper.state, Path(source.path).resolve().name, config.slice_at, config.bound
        )
    _report(config, folder, names, found, time.monotonic() - begin)
    if done.broken is not None:
        raise UsageError(f"after {len(done.frames)} frames, which are kept: {one_line(done.broken)}")
    if done.interrupted:
        after = config.start + len(done.frames) * config.every
        _say(f"stopped; go on with --continue-from {folder / names[0]} --start {after}")
        return INTERRUPTED
    return 0


def _report(config: MapConfig, folder: Path, names: list[str], found: dict[str, Any], seconds: float) -> None:
    text = summary_text(found, seconds) + f"\nResults in {folder}: {', '.join(names)}"
    if config.json:
        _say(text)
        print(json.dumps(found, indent=1, allow_nan=False))
    else:
        print(text, flush=True)
