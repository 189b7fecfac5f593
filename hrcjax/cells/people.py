"""The people of a cell by name: made motions, recorded ones, several at once."""

from functools import cache
from pathlib import Path

import numpy as np

from hrcjax.world import MOTIONS, Person, Scene, motion_named, person_from_joints, together

FASTEST = 8.0
"""Speed of a joint beyond which a recording jumps: faster than hands are at work [m/s]."""
PERSON_RATE = 30.0
"""Poses a second of a person's record [Hz]."""


def people_of(name: str) -> list[str]:
    """The people that a name stands for: "reach_in+pass_by" are two; a file may have a plus in its name."""
    return [name] if "+" not in name or Path(name).is_file() else name.split("+")


def make_people(name: str, scene: Scene, seed: int, duration: float, places: int) -> Person:
    """Everybody in the cell as one record, with capsules for `places` people; those that are not there are absent.

    Raises:
        ValueError: no such motion, a file that is missing or broken, more people than places.
    """
    names = people_of(name)
    if len(names) > places:
        raise ValueError(
            f"{name}: {len(names)} people in a cell for {places}; accepted: a cell with people={len(names)}"
        )
    names += ["nobody"] * (places - len(names))
    return together([make_person(one, scene, seed + 1000 * k, duration) for k, one in enumerate(names)])


def make_person(name: str, scene: Scene, seed: int, duration: float) -> Person:
    """A motion by name, or a recorded one from a BVH file.

    Raises:
        ValueError: no such motion, or a file that is missing or broken.
    """
    if name in MOTIONS:
        return motion_named(name, scene, seed, duration, PERSON_RATE)
    if not name.lower().endswith(".bvh"):
        raise ValueError(f"unknown person {name!r}: accepted are {', '.join(MOTIONS)}, or a file that ends in .bvh")
    positions, names, rate = _recording(name)
    return person_from_joints(positions, names, rate, scene, duration, PERSON_RATE)


@cache
def _recording(name: str) -> tuple[np.ndarray, tuple[str, ...], float]:
    """A BVH file, read once."""
    from hrcjax.io.bvh import read_bvh  # here: its library is slow to import

    return read_bvh(Path(name))


def recording_notes(name: str, duration: float) -> list[str]:
    """What to know of a recorded person: how much of it an episode takes, and where it jumps."""
    positions, _, rate = _recording(name)
    length, notes = len(positions) / rate, []
    used = positions[: round(duration * rate) + 1]
    if length > duration:
        notes.append(f"{name}: the first {duration:g} s of {length:.1f} s are played")
    elif length < duration:
        notes.append(f"{name}: {length:.1f} s long; the last pose is held to {duration:g} s")
    speed = np.linalg.norm(np.diff(used, axis=0), axis=-1).max(axis=1, initial=0.0) * rate
    if (speed > FASTEST).any():
        first = float(np.argmax(speed > FASTEST)) / rate
        notes.append(
            f"{name}: a joint moves at up to {speed.max():.0f} m/s, first over {FASTEST:g} m/s at {first:.1f} s: the recording jumps"
        )
    return notes
