"""Parser of BVH files: hierarchy, rows of numbers, and errors in one line.

Source of the format: Meredith and Maddock, Motion Capture File Formats Explained, University of Sheffield, CS-01-11.
"""

import re
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import numpy as np

from hrcjax.io.motions.joints import Joint, RecordedJoints
from hrcjax.lab.errors import UsageError

ACCEPTED = "a BVH text file: HIERARCHY, then MOTION with 'Frames:', 'Frame Time:' and one row of numbers per frame"
CHANNEL = re.compile(r"([XYZ])(position|rotation)", re.IGNORECASE)


class BvhError(UsageError):
    """A motion file that is missing or broken."""


class BvhText:
    """The non-blank lines of a file with their numbers."""

    def __init__(self, path: Path, lines: list[tuple[int, str]]) -> None:
        self.path, self.lines = path, lines

    def refuse(self, what: str, number: int | None = None) -> NoReturn:
        place = "" if number is None else f"line {number}: "
        raise BvhError(f"broken motion file {self.path}: {place}{what}; accepted is {ACCEPTED}")

    def recorded(self) -> RecordedJoints:
        if not self.lines or self.lines[0][1].upper() != "HIERARCHY":
            self.refuse("it does not begin with HIERARCHY")
        motion = next((k for k, (_, line) in enumerate(self.lines) if line.upper() == "MOTION"), None)
        if motion is None:
            self.refuse("it has no MOTION section")
        joints = self.hierarchy(self.lines[1:motion])
        frames, step = self.head(self.lines[motion + 1 : motion + 3])
        channels = sum(len(joint.channels) for joint in joints)
        return RecordedJoints(tuple(joints), self.rows(self.lines[motion + 3 :], frames, channels), 1 / step)

    def hierarchy(self, lines: list[tuple[int, str]]) -> list[Joint]:
        joints: list[Joint] = []
        opened: list[int | None] = []  # indices of joints with an open bracket; None: an end site
        coming: int | None = -1  # joint of the next bracket; -1: none
        parts = [(n, part.strip()) for n, line in lines for part in re.split("([{}])", line) if part.strip()]
        for number, part in parts:
            word, *rest = part.split(maxsplit=1)
            kind, rest = word.upper(), "".join(rest)
            if kind == "{":
                if coming == -1:
                    self.refuse("an opening bracket without a joint", number)
                opened.append(coming)
                coming = -1
            elif kind == "}":
                if not opened:
                    self.refuse("a closing bracket without an opening one", number)
                opened.pop()
            elif kind == "END" and opened:
                coming = None
            elif kind in ("ROOT", "JOINT"):
                above = opened[-1] if opened else -1
                if above is None or (kind == "ROOT") != (above == -1):
                    self.refuse(f"{kind} at the wrong place", number)
                if kind == "ROOT" and joints:
                    self.refuse("a second ROOT; accepted is one person per file", number)
                coming = len(joints)
                joints.append(Joint(rest, above, np.zeros(3), ()))
            elif kind == "OFFSET" and opened:
                offset = self.numbers(rest.split(), number)
                if len(offset) != 3:
                    self.refuse("OFFSET needs three numbers", number)
                if opened[-1] is not None:
                    joints[opened[-1]] = replace(joints[opened[-1]], offset=offset)
            elif kind == "CHANNELS" and opened and opened[-1] is not None:
                count, *names = rest.split() or [""]
                found = [CHANNEL.fullmatch(name) for name in names]
                if not count.isdigit() or len(names) != int(count):
                    self.refuse("CHANNELS needs a count and that many names", number)
                if not all(found):
                    self.refuse("CHANNELS are Xposition ... Zrotation", number)
                channels = tuple((m[1].upper(), m[2].lower()) for m in found if m)
                joints[opened[-1]] = replace(joints[opened[-1]], channels=channels)
            else:
                self.refuse(f"{word} is not known here", number)
        if opened or coming != -1:
            self.refuse("brackets of the hierarchy do not match")
        if not joints:
            self.refuse("it has no ROOT")
        return joints

    def head(self, lines: list[tuple[int, str]]) -> tuple[int, float]:
        """Number of frames, and frame time [s]."""
        text = [*(line for _, line in lines), "", ""]
        frames = re.fullmatch(r"Frames\s*:\s*(\S+)", text[0], re.IGNORECASE)
        step = re.fullmatch(r"Frame\s*Time\s*:\s*(\S+)", text[1], re.IGNORECASE)
        if not (frames and step):
            self.refuse("MOTION needs 'Frames: N' and 'Frame Time: seconds'")
        try:
            count, seconds = int(frames[1]), float(step[1])
        except ValueError:
            self.refuse("MOTION is not followed by 'Frames: N' and 'Frame Time: seconds'")
        if count < 1 or not (np.isfinite(seconds) and seconds > 0):
            self.refuse("MOTION needs 'Frames:' of at least 1 and a positive 'Frame Time:'")
        return count, seconds

    def numbers(self, words: list[str], number: int) -> np.ndarray:
        try:
            return np.array(words, float)
        except ValueError:
            self.refuse("not a row of numbers", number)

    def rows(self, lines: list[tuple[int, str]], frames: int, channels: int) -> np.ndarray:
        if len(lines) != frames:
            self.refuse(f"{frames} frames are declared, but there are {len(lines)} rows")
        words = [line.split() for _, line in lines]
        try:
            values = np.array([word for row in words for word in row], float)
        except ValueError:
            values = np.array([np.nan])
        if all(len(row) == channels for row in words) and np.isfinite(values).all():
            return values.reshape(frames, channels)
        for (number, _), row in zip(lines, words, strict=True):
            values = self.numbers(row, number)
            if values.size != channels or not np.isfinite(values).all():
                self.refuse(f"{values.size} values, {channels} finite ones are needed", number)
        raise AssertionError
