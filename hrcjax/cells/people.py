"""The people of a cell by name: generated or recorded motions, several at once."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from hrcjax.io.motions.motion import Motion, read_motion
from hrcjax.io.motions.spec import FORMS, motion_spec, people_of
from hrcjax.lab.errors import UsageError, one_line
from hrcjax.lab.provenance import file_digest
from hrcjax.lab.run_folder import folder_name
from hrcjax.world import MOTIONS, Person, Scene, motion_named, person_from_joints, scene_named, together

FASTEST = 8.0
"""Largest plausible speed of a joint in a recording; faster is a jump [m/s]."""
ONCE = 6.0
"""Time in which a motion that comes and goes is played; then its last pose is held [s]."""
COME_AND_GO = ("reach_in", "pass_by")
"""These motions; the others go on for as long as the episode."""
PERSON_RATE = 30.0
"""Rate of the poses of a person [Hz]."""


def make_people(name: str, scene: Scene, seed: int, duration: float, places: int) -> Person:
    """All people in the cell as one `Person`, with capsules for `places` people; unused ones are masked.

    Raises:
        ValueError: no such motion, a missing or broken file, too many people.
    """
    names = people_of(name)
    if len(names) > places:
        raise ValueError(
            f"{name}: {len(names)} people, the cell has capacity for {places}; accepted: a cell with people={len(names)}"
        )
    names += ["nobody"] * (places - len(names))
    return together([make_person(one, scene, seed + 1000 * k, duration) for k, one in enumerate(names)])


def _held(person: Person, frames: int) -> Person:
    """The same person, in the last pose up to the last frame."""
    at = np.minimum(np.arange(frames), person.a.shape[0] - 1)
    return replace(person, a=person.a[at], b=person.b[at], present=person.present[at])


def make_person(name: str, scene: Scene, seed: int, duration: float) -> Person:
    """A motion by name, or a recorded one: see `hrcjax.io.motions.spec`.

    Raises:
        ValueError: no such motion, or a missing or broken file.
    """
    if name in MOTIONS:
        lasting = min(duration, ONCE) if name in COME_AND_GO else duration
        return _held(motion_named(name, scene, seed, lasting, PERSON_RATE), round(duration * PERSON_RATE) + 1)
    motion = _recording(name, duration)
    return person_from_joints(motion.positions, motion.names, motion.rate, scene, duration, PERSON_RATE)


@cache
def _recording(name: str, duration: float) -> Motion:
    """The part of a motion file that is played, cached."""
    spec = motion_spec(name)
    if spec is None:
        raise ValueError(f"unknown person {name!r}: accepted are {', '.join(MOTIONS)}, or {FORMS}")
    return read_motion(spec, duration)


def with_recordings(names: Sequence[str], folder: Path | None) -> tuple[str, ...]:
    """Names of people, and after them the BVH files of a folder, sorted.

    Raises:
        UsageError: there is no such folder.
    """
    if folder is None:
        return tuple(names)
    if not folder.is_dir():
        raise UsageError(f"--recordings {folder}: no such folder")
    return (*names, *map(str, sorted(folder.glob("*.bvh"))))


def check_worlds(scenes: Sequence[str], names: Sequence[str]) -> None:
    """Refuses scenes and people that cannot be made.

    Raises:
        UsageError: no such scene or motion, or a missing or broken file.
    """
    try:
        for scene in scenes:
            scene_named(scene, 0)
        for name in names:
            for one in people_of(name):
                make_person(one, scene_named(scenes[0], 0), 0, 1.0)
    except (ValueError, OSError) as error:
        raise UsageError(one_line(error)) from error


def person_key(name: str) -> str:
    """A person's name as part of a file's name; that of a recording with the digest of its files."""
    spec = motion_spec(name)
    if spec is None:
        return folder_name(name)
    return "-".join([folder_name(spec.path.stem), *(file_digest(path)[:8] for path in spec.files)])


def recording_notes(name: str, duration: float) -> list[str]:
    """Notes on a recorded person: the part that an episode plays, and jumps."""
    motion = _recording(name, duration)
    rate, length, notes = motion.rate, motion.length, list(motion.notes)
    if length > duration:
        notes.append(f"{name}: the first {duration:g} s of {length:.1f} s are played")
    elif length < duration:
        notes.append(f"{name}: {length:.1f} s long; the last pose is held to {duration:g} s")
    speed = np.linalg.norm(np.diff(motion.positions, axis=0), axis=-1).max(axis=1, initial=0.0) * rate
    if (speed > FASTEST).any():
        first = float(np.argmax(speed > FASTEST)) / rate
        notes.append(
            f"{name}: a joint moves at up to {speed.max():.0f} m/s, first over {FASTEST:g} m/s at {first:.1f} s: the recording jumps"
        )
    return notes
