"""What chance decides of an episode: who comes, when, where and how fast; noise, latency, images that are missing."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hrcjax.cells.people import make_person
from hrcjax.world import Person, Scene

RATE = 30.0
"""Poses of a person, and images of both cameras together, a second [Hz]."""
LATENCY = (0.03, 0.05)
"""Time from an exposure to its use, from and to; drawn for each episode [s]."""
NOISE = 0.01
"""Standard deviation of a person's position in an image, along each axis [m]."""
LOST = 0.03
"""Chance that an image is missing or refused [1]."""
FAULT_CHANCE, FAULT_LENGTH, FAULTS = 0.5, (0.05, 1.0), 2
"""Chance of a fault of all cameras at once, up to two an episode; its length [s]. Frozen, blocked, blurred, half-empty, dropped and
skewed images are refused, as `experiments.sensing` shows: here all are images that do not come."""
LATE_CHANCE, LATE = 0.02, 0.2
"""Chance that an image is late, and by how much [s]."""
LEAD = 6
"""Images before the episode."""
SEEDS = 8
"""Seeds of a generated motion among which chance chooses."""
TURN, SHIFT, PACE, WAIT = 0.35, 0.12, (0.75, 1.25), (-1.5, 1.5)
"""The motion is turned about the base by up to [rad], moved by up to [m], played at a pace from and to [1], and shifted in time [s]."""


@dataclass(frozen=True)
class Draw:
    """One episode's chance."""

    person: str
    """Who."""
    a: NDArray
    """Capsules' ends over time (pose capsule 3), at `RATE` [m]."""
    b: NDArray
    radius: NDArray
    """(capsule) [m]."""
    image: NDArray
    """Pose of the image in use at every tick."""
    age: NDArray
    """Its age [s]; infinite: none."""
    guarded: NDArray
    """Whether an image that was due did not come."""
    noise: NDArray
    """Error of the person's position in every image (pose 3) [m]."""
    fastest: float
    """Largest speed of a capsule's end [m/s]."""


def moved(points: NDArray, turn: float, shift: NDArray) -> NDArray:
    """Points (... 3) turned about the base's upright axis [rad] and shifted [m]."""
    c, s = np.cos(turn), np.sin(turn)
    return points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]]) + shift


def played_at(points: NDArray, times: NDArray) -> NDArray:
    """Poses (pose capsule 3) at other times [s], on straight lines; held before the first and after the last."""
    at = np.clip(times * RATE, 0, len(points) - 1)
    low = np.floor(at).astype(int)
    high, part = np.minimum(low + 1, len(points) - 1), (at - low)[:, None, None]
    return (1 - part) * points[low] + part * points[high]


def images_in_use(t: NDArray, exposed: NDArray, arrives: NDArray, due: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Of every tick the image in use, its age [s], and whether a newer image is due that has not come.

    Args:
        t: ticks [s].
        exposed: when images are exposed, increasing [s].
        arrives: when they can be used; infinite: never [s].
        due: when they should be [s].
    """
    there = arrives[None] <= t[:, None]
    image = np.where(there, np.arange(len(exposed)), -1).max(axis=1)
    waited = np.where(due[None] <= t[:, None], np.arange(len(exposed)), -1).max(axis=1)
    return np.maximum(image, 0), np.where(image >= 0, t - exposed[np.maximum(image, 0)], np.inf), waited > image


class Drawer:
    """Draws episodes of a scene."""

    def __init__(self, scene: Scene, people: tuple[str, ...], ticks: int, dt: float) -> None:
        self.scene, self.people = scene, people
        self.t = dt * np.arange(ticks)
        self.poses = int(np.ceil(ticks * dt * RATE)) + 1
        self._made: dict[tuple[str, int], tuple[NDArray, NDArray, NDArray]] = {}

    def __call__(self, seed: int) -> Draw:
        """The episode of a seed."""
        draw = np.random.default_rng([seed, 7])
        name = str(draw.choice(self.people))
        a, b, radius = self._poses(name, int(draw.integers(SEEDS)))
        turn, shift = draw.uniform(-TURN, TURN), draw.uniform(-SHIFT, SHIFT, 3) * [1, 1, 0]
        exposed = (np.arange(self.poses + LEAD) - LEAD) / RATE
        times = exposed * draw.uniform(*PACE) + draw.uniform(*WAIT)
        a, b = (moved(played_at(ends, times), turn, shift) for ends in (a, b))
        due = exposed + draw.uniform(*LATENCY)
        arrives = due + np.where(draw.random(len(due)) < LATE_CHANCE, LATE, 0.0)
        missing = draw.random(len(due)) < LOST
        for _ in range(FAULTS):
            begin, length, some = draw.uniform(0, self.t[-1]), draw.uniform(*FAULT_LENGTH), draw.random()
            missing |= (some < FAULT_CHANCE) & (exposed >= begin) & (exposed < begin + length)
        image, age, guarded = images_in_use(self.t, exposed, np.where(missing, np.inf, arrives), due)
        step = max(np.linalg.norm(np.diff(ends, axis=0), axis=-1).max() for ends in (a, b))
        noise = draw.normal(0, NOISE, (len(due), 3))
        return Draw(name, a, b, radius, image, age, guarded, noise, float(step * RATE))

    def _poses(self, name: str, seed: int) -> tuple[NDArray, NDArray, NDArray]:
        """The poses of a person, made once: both ends of the capsules [m], and their radii [m]."""
        if (name, seed) not in self._made:
            made: Person = make_person(name, self.scene, seed, max(self.t[-1] + 3.0, 8.0))
            radius = np.where(np.asarray(made.present).any(), np.asarray(made.radius, float), -1.0)
            self._made[name, seed] = (np.asarray(made.a, float), np.asarray(made.b, float), radius)
        return self._made[name, seed]
