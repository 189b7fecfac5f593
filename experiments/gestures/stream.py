"""Streams of frames made of recorded hands: what is no command, and hard cases; and commands to be noticed."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hrcjax.hand import CLOSED, OPEN, POINTING

from .data import Hands
from .unlike import cloud, disturbed, mixed, other_fingers, shuffled, similarity, size, torn, turned

RATE = 30.0
"""Frames in a second [Hz]."""
SHORT = 0.35
"""Longest time for which the hard cases show a closed hand [s]; a go needs half a second."""
HANDS = 2
"""Hands that a frame may have."""


@dataclass(frozen=True)
class Stream:
    """Frames one after the other."""

    x: NDArray
    """Landmarks (frame, hand, 21, 2)."""
    seen: NDArray
    """Whether there is such a hand (frame, hand)."""
    kind: tuple[str, ...]
    """What each frame is part of."""
    begins: NDArray
    """Frames at which a part begins."""

    @property
    def dt(self) -> NDArray:
        """Time since the frame before [s]."""
        return np.full(len(self.x), 1 / RATE, np.float32)


Part = tuple[NDArray, NDArray]
"""Landmarks (frame, 21, 2), and whether the hand is seen."""


def run_of(x: NDArray, count: int, random: np.random.Generator) -> NDArray:
    """Consecutive rows of a recording, held or repeated at its end; turned and mirrored as one, with a little noise."""
    begin = random.integers(max(len(x) - count, 1))
    rows = np.minimum(np.arange(begin, begin + count), len(x) - 1)
    found = turned(x[rows] / size(x[rows]), np.full(count, random.uniform(-np.pi, np.pi)))
    found = found * ([-1.0, 1.0] if random.random() < 0.5 else [1.0, 1.0])
    return disturbed(found, random, 3.0, 0.01)


def between(a: NDArray, b: NDArray, count: int, random: np.random.Generator) -> NDArray:
    """From one hand to another in some frames, both brought over each other by their palms' best turn and scale."""
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    matrix, _ = similarity(b[None], a[None])
    share = np.linspace(0, 1, count)[:, None, None]
    return disturbed((1 - share) * a + share * (b @ matrix[0]), random, 3.0, 0.01)


class Maker:
    """Makes parts of a stream from the rows of held-out blocks."""

    def __init__(self, hands: Hands, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.of = [hands.x[hands.gesture == g] for g in (OPEN, CLOSED, POINTING)]
        self.all = hands.x
        self.others = other_fingers(hands, self.random, 300)

    def frames(self, low: float, high: float) -> int:
        """A duration by chance, in frames."""
        return max(int(self.random.uniform(low, high) * RATE), 1)

    def absent(self) -> Part:
        """Nobody's hand."""
        count = self.frames(0.5, 3.0)
        return np.zeros((count, 21, 2)), np.zeros(count, bool)

    def scrambled(self) -> Part:
        """Landmarks in disorder, another one in every frame or the same all the time."""
        count, way = self.frames(0.5, 2.0), (shuffled, mixed, cloud, torn)[self.random.integers(4)]
        source = run_of(self.all, count, self.random)
        if self.random.random() < 0.5:
            return way(source, self.random), np.ones(count, bool)
        one = way(source, self.random)[:1]
        return disturbed(np.repeat(one, count, axis=0), self.random, 5.0, 0.02), np.ones(count, bool)

    def other(self) -> Part:
        """Another gesture, held."""
        count = self.frames(0.5, 2.0)
        one = self.others[self.random.integers(len(self.others))]
        still = turned(np.repeat(one[None], count, axis=0), np.full(count, self.random.uniform(-np.pi, np.pi)))
        return disturbed(still, self.random, 5.0, 0.01), np.ones(count, bool)

    def gesture(self, which: int, low: float, high: float) -> Part:
        """A gesture as recorded."""
        count = self.frames(low, high)
        return run_of(self.of[which], count, self.random), np.ones(count, bool)

    def transition(self) -> Part:
        """Open to pointing or back, through what a hand looks like in between."""
        a, b = (self.of[g][self.random.integers(len(self.of[g]))] for g in (OPEN, POINTING))
        count = self.frames(0.2, 0.8)
        x = between(a, b, count, self.random)
        return (x if self.random.random() < 0.5 else x[::-1]), np.ones(count, bool)

    def flash(self) -> Part:
        """A hand that closes for a moment and is lost, or opens again."""
        closed = run_of(self.of[CLOSED], self.frames(0.1, SHORT), self.random)
        if self.random.random() < 0.5:
            gone = self.frames(0.3, 1.0)
            return np.concatenate([closed, np.zeros((gone, 21, 2))]), np.arange(len(closed) + gone) < len(closed)
        opened = run_of(self.of[OPEN], self.frames(0.2, 1.0), self.random)
        return np.concatenate([opened, closed]), np.ones(len(closed) + len(opened), bool)

    def occluded(self) -> Part:
        """A pointing or open hand of which a part is hidden: those landmarks are guessed, at the palm or scattered about it."""
        x, seen = self.gesture((OPEN, POINTING)[self.random.integers(2)], 0.5, 2.0)
        hidden = self.random.random(21) < self.random.uniform(0.2, 0.6)
        middle = x[:, [0, 5, 17]].mean(axis=1, keepdims=True)
        spread = self.random.uniform(0.0, 0.4) * size(x)
        guess = middle + spread * self.random.normal(size=x.shape)
        return np.where(hidden[None, :, None], guess, x), seen & (self.random.random(len(seen)) < 0.9)


KINDS: dict[str, tuple[Callable[[Maker], Part], float]] = {
    "absent": (Maker.absent, 1.0),
    "scrambled": (Maker.scrambled, 1.5),
    "other gesture": (Maker.other, 1.5),
    "open": (lambda m: m.gesture(OPEN, 0.3, 2.0), 1.0),
    "pointing": (lambda m: m.gesture(POINTING, 0.3, 2.0), 2.0),
    "transition": (Maker.transition, 1.5),
    "closed for a moment": (Maker.flash, 1.5),
    "occluded": (Maker.occluded, 1.5),
}
"""Parts of the stream without a go, and how often each comes beside the others."""


def joined(parts: list[tuple[str, Part]]) -> Stream:
    """Parts one after the other, one hand in each frame."""
    x = np.concatenate([part[0] for _, part in parts]).astype(np.float32)
    seen = np.concatenate([part[1] for _, part in parts])
    kind = tuple(name for name, part in parts for _ in range(len(part[0])))
    begins = np.cumsum([0, *(len(part[0]) for _, part in parts)])[:-1]
    both = np.stack([x, np.zeros_like(x)], axis=1)
    return Stream(both, np.stack([seen, np.zeros_like(seen)], axis=1), kind, begins)


def without_go(hands: Hands, seconds: float, seed: int) -> Stream:
    """A stream in which no hand is closed for long enough: every go in it is a false start.

    Two parts that end and begin closed never follow each other.
    """
    maker, parts, frames = Maker(hands, seed), [], 0
    names, weights = list(KINDS), np.array([weight for _, weight in KINDS.values()])
    while frames < seconds * RATE:
        name = names[maker.random.choice(len(names), p=weights / weights.sum())]
        if name == "closed for a moment" and parts and parts[-1][0] == name:
            continue
        part = KINDS[name][0](maker)
        parts.append((name, part))
        frames += len(part[0])
    return joined(parts)


def flickering(stream: Stream) -> Stream:
    """The same as a detector gives it that misses every second image."""
    place = np.arange(len(stream.x))
    place -= np.maximum.accumulate(np.where(np.isin(place, stream.begins), place, 0))
    return replace(stream, seen=stream.seen & (place % 2 == 0)[:, None])


def with_commands(hands: Hands, count: int, seed: int) -> Stream:
    """Open, then closed, then pointing, 1.5 s each with 0.5 s of nothing between them, `count` times."""
    maker = Maker(hands, seed)
    nothing = (np.zeros((15, 21, 2)), np.zeros(15, bool))
    parts: list[tuple[str, Part]] = []
    for _ in range(count):
        for name, which in (("open", OPEN), ("closed", CLOSED), ("pointing", POINTING)):
            parts += [("absent", nothing), (name, maker.gesture(which, 1.5, 1.5))]
    return joined(parts)
