"""One run: fuses the frames of a recording and writes the results."""

import itertools
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrcjax.io.map_file import open_map
from hrcjax.io.recordings.frame import InputFrame
from hrcjax.io.recordings.joints import with_joints
from hrcjax.io.recordings.source import InputSource
from hrcjax.lab.errors import UsageError, one_line
from hrcjax.lab.interrupt import Wish, stop_on_interrupt
from hrcjax.map import FieldMap, MapLayout, MapParams, StreamParams

from .choices import beyond_neighbours, check, check_slices, choose_layout, choose_params, recording
from .config import MapConfig
from .exclusions import Exclusions, check_overlap, exclusions_of
from .first_look import check_first
from .fit_box import fit_layout
from .frame_check import checked
from .map_folder import check_folder, default_folder, prepare_folder
from .mapper import Mapper
from .play import Played, play, sensor_known
from .results import draw_map, write_data
from .select import count_selected, selected
from .statistics import statistics
from .summary_text import mostly_refused, nothing_taken, summary_text

MOSTLY_REFUSED = 3
"""Exit status of a run that is done, but refused most frames."""


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


@dataclass(frozen=True, eq=False)
class Job:
    """What is decided before the first frame is fused."""

    config: MapConfig
    folder: Path
    source: InputSource
    exclusions: Exclusions
    layout: MapLayout
    params: MapParams
    limits: StreamParams
    state: FieldMap | None
    """The map to continue from; None: start with an empty one."""

    def frames(self) -> Iterator[InputFrame]:
        """The selected frames.

        Raises:
            UsageError: a broken file, a frame that cannot be mapped.
        """
        return chosen_frames(self.config, self.source, self.layout.spacing)


def chosen_frames(config: MapConfig, source: InputSource, spacing: float) -> Iterator[InputFrame]:
    """The frames that the options select, checked for a spacing [m]."""
    return checked(selected(source, config.start, config.every, config.frames), spacing)


def run(config: MapConfig) -> int:
    """Maps a recording; returns the exit status: 0; 3 if most frames were refused; after a signal 128 plus its number, such as
    130 for Ctrl-C.

    Raises:
        UsageError: invalid options, an unreadable recording, a folder that is not writable, no data for the map.
        StorageError: results could not be written.
    """
    begin = time.monotonic()
    with stop_on_interrupt() as wish:
        job = prepare(config, wish)
        mapper = Mapper(job.layout, job.params, job.limits, job.state, job.exclusions)
        count = count_selected(job.source.length, config.start, config.every, config.frames)
        played = play(mapper, job.source, config, job.frames(), count, wish)
        if not played.frames:
            return _without_frames(config, played, wish)
        mapper.settle()
        found = _statistics(job, mapper, played)
        nothing = nothing_taken(found)
        if nothing and not wish.stop:
            raise UsageError(f"{config.input}: {nothing}")
        names = _write(job, mapper.state, found)
        _report(config, job.folder, names, found, time.monotonic() - begin)
        return _status(job, played, found, wish)


def prepare(config: MapConfig, wish: Wish) -> Job:
    """Opens the recording, checks the options, reports assumptions, and chooses box and sizes.

    Raises:
        UsageError: as `run`.
    """
    check(config)
    assert config.input is not None
    folder = config.output or default_folder(config.input)
    exclusions = exclusions_of(config)
    source = recording(config)
    if exclusions.joints is not None:
        source = with_joints(source, exclusions.joints)
    check_folder(folder, config.overwrite)
    layout, params, state = None, MapParams(), None
    if config.continue_from is not None:
        layout, params, state = open_map(config.continue_from)
    params, limits = choose_params(config.param, params, continued=state is not None)
    spacing = config.spacing if layout is None else layout.spacing
    _say(f"{source.kind} {source.path} -> {folder}")
    for line in source.notes:
        _say(f"  {line}")
    note = beyond_neighbours(config.param, params, spacing)
    if note:
        _say(f"note: {note}")
    head = next(chosen_frames(config, source, spacing), None)
    if head is not None:
        check_first(config, head, _say)
    if layout is None and config.fit:
        looked_at = itertools.takewhile(lambda _: not wish.stop, chosen_frames(config, source, spacing))
        known = sensor_known(config, source)
        layout, params = fit_layout(config, looked_at, params, known, _say, exclusions.box)
    if layout is None:
        layout = choose_layout(config, clouds=head is not None and head.cloud is not None)
    check_slices(config.slice_at, layout)
    check_overlap(exclusions.box, layout)
    return Job(config, folder, source, exclusions, layout, params, limits, state)


def _without_frames(config: MapConfig, played: Played, wish: Wish) -> int:
    """The exit status of a run without any frame, which writes nothing."""
    if played.broken is not None:
        raise played.broken
    if wish.stop:
        _say("stopped before the first frame; no files are written")
        return wish.status
    reasons = "; ".join(f"{times} x {reason}" for reason, times in played.not_read.items())
    raise UsageError(
        f"{config.input}: no frame was used{f' ({reasons})' if reasons else ''}; select others by --start, --every, --frames"
    )


def _statistics(job: Job, mapper: Mapper, played: Played) -> dict[str, Any]:
    """The statistics of a run, with its options, assumptions and warnings."""
    config = job.config
    about: dict[str, Any] = {
        "input": str(config.input),
        "kind": job.source.kind,
        "notes": list(job.source.notes),
        "warnings": played.warnings,
        "interrupted": played.interrupted,
    }
    if config.crop is not None:
        about["crop"] = list(config.crop)
    if config.joints is not None:
        about |= {"joints": str(config.joints), "arm": config.arm, "arm_base": config.arm_base}
    if config.continue_from is not None:
        about["continued_from"] = str(config.continue_from)
    return statistics(
        played.frames,
        played.reading,
        job.layout,
        job.params,
        job.limits,
        mapper.state,
        mapper.programs.seconds,
        played.not_read,
        about,
    )


def _write(job: Job, state: FieldMap, found: dict[str, Any]) -> list[str]:
    """Writes all results; returns the names of the files."""
    prepare_folder(job.folder)
    names = write_data(job.folder, job.layout, job.params, state, found)
    if job.config.figures:
        _say("drawing figures")
        name = Path(job.source.path).resolve().name
        names += draw_map(job.folder, job.layout, job.params, state, name, job.config.slice_at, job.config.bound)
    return names


def _report(config: MapConfig, folder: Path, names: list[str], found: dict[str, Any], seconds: float) -> None:
    text = summary_text(found, seconds) + f"\nResults in {folder}: {', '.join(names)}"
    if config.json:
        _say(text)
        print(json.dumps(found, indent=1, allow_nan=False))
    else:
        print(text, flush=True)


def _status(job: Job, played: Played, found: dict[str, Any], wish: Wish) -> int:
    """The exit status of a run whose results are written.

    Raises:
        UsageError: the recording ended with a broken file.
    """
    if played.broken is not None:
        raise UsageError(
            f"broken after {len(played.frames)} frames, whose results are written: {one_line(played.broken)}"
        )
    if wish.stop:
        after = job.config.start + len(played.frames) * job.config.every
        _say(f"stopped; continue with --continue-from {job.folder / 'map.npz'} --start {after}")
        return wish.status
    return MOSTLY_REFUSED if mostly_refused(found) else 0
