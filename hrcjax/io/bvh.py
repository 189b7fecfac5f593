"""Motion capture files: BVH to joint positions, read by the library `bvhio`."""

from pathlib import Path

import bvhio
import numpy as np

from hrcjax.lab.errors import UsageError


class BvhError(UsageError):
    """A motion file that is missing or broken."""


ACCEPTED = "a BVH text file: HIERARCHY, then MOTION with 'Frames:', 'Frame Time:' and one row of numbers a frame"


def _check(path: Path) -> None:
    """Refuse, with one line, what the library would wait on for ever, or read as something else."""
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise BvhError(f"no motion file at {path}: accepted is {ACCEPTED}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise BvhError(f"motion file {path} cannot be read ({type(error).__name__}): accepted is {ACCEPTED}") from None

    def refuse(what: str) -> BvhError:
        return BvhError(f"broken motion file {path}: {what}; accepted is {ACCEPTED}")

    lines = [line.strip() for line in text.splitlines()]
    numbered = [(i + 1, line) for i, line in enumerate(lines) if line]
    if not numbered or numbered[0][1] != "HIERARCHY":
        raise refuse("it does not begin with HIERARCHY")
    motion = next((k for k, (_, line) in enumerate(numbered) if line == "MOTION"), None)
    if motion is None:
        raise refuse("it has no MOTION section")
    channels = 0
    depth = 0
    for number, line in numbered[:motion]:
        words = line.split()
        depth += words.count("{") - words.count("}")
        if depth < 0:
            raise refuse(f"line {number}: a bracket closes that was not open")
        if words[0] == "CHANNELS":
            if len(words) < 2 or not words[1].isdigit() or len(words) != 2 + int(words[1]):
                raise refuse(f"line {number}: CHANNELS needs a count and as many names")
            channels += int(words[1])
    if depth != 0:
        raise refuse("brackets of the hierarchy do not match")
    head = numbered[motion + 1 : motion + 3]
    try:
        (_, frames_line), (_, time_line) = head
        frames_words, time_words = frames_line.split(), time_line.split()
        frames, step = int(frames_words[1]), float(time_words[2])
        good = frames_words[0] == "Frames:" and time_words[:2] == ["Frame", "Time:"]
    except (ValueError, IndexError):
        raise refuse("MOTION is not followed by 'Frames: N' and 'Frame Time: seconds'") from None
    if not good or frames < 1 or not (np.isfinite(step) and step > 0):
        raise refuse("MOTION needs 'Frames:' of at least 1 and a positive 'Frame Time:'")
    rows = numbered[motion + 3 :]
    if len(rows) != frames:
        raise refuse(f"{frames} frames are announced, {len(rows)} rows are there")
    for number, line in rows:
        try:
            row = np.array(line.split(), float)
        except ValueError:
            raise refuse(f"line {number}: not a row of numbers") from None
        if row.size != channels or not np.isfinite(row).all():
            raise refuse(f"line {number}: {row.size} values, {channels} finite ones are needed")


def read_bvh(path: str | Path, unit: float = 0.001) -> tuple[np.ndarray, tuple[str, ...], float]:
    """Joint positions in the file's own axes (y up), joint names, and the rate.

    Args:
        path: the file.
        unit: length of the file's unit in metres; BVH does not say it. Millimetres unless told otherwise.

    Returns:
        Positions (frame, joint, 3) [m], names, frames a second [Hz].

    Raises:
        BvhError: a missing or broken file; one line says what, where, and what is accepted.
    """
    path = Path(path)
    _check(path)
    try:
        container = bvhio.readAsBvh(str(path))
        root = bvhio.convertBvhToHierarchy(container.Root).loadRestPose(recursive=True)
    except Exception as error:  # the library raises bare tuples, index and attribute errors alike
        first = error.args[0] if error.args else type(error).__name__
        raise BvhError(f"broken motion file {path}: {first}; accepted is {ACCEPTED}") from error
    joints = [joint for joint, _, _ in root.layout()]
    positions = np.empty((container.FrameCount, len(joints), 3))
    for frame in range(container.FrameCount):
        root.loadPose(frame)
        positions[frame] = [tuple(joint.PositionWorld) for joint in joints]
    return positions * unit, tuple(joint.Name for joint in joints), 1.0 / container.FrameTime
