"""Hands that are no gesture: shuffled, scrambled, half hidden, and with other fingers extended."""

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from hrcjax.hand.landmarks import CLOSED, FINGERS, OPEN, PALM

from .data import Hands

FOUR = ("index", "middle", "ring", "little")
OTHERS = tuple(chosen for count in (1, 2, 3) for chosen in combinations(FOUR, count) if chosen != ("index",))
"""Fingers extended that are none of the gestures: neither none of the four, nor all, nor the index alone."""
TRIED = 24
"""Closed hands tried for an open one; that whose palm fits best is taken."""


def size(x: NDArray) -> NDArray:
    """Greatest coordinate about the wrist (row, 1, 1), in units of the image."""
    return np.abs(x - x[:, :1]).max(axis=(1, 2), keepdims=True)


def turned(x: NDArray, angle: NDArray) -> NDArray:
    """Hands turned in the image by an angle each [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return x @ np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2).swapaxes(1, 2)


def disturbed(x: NDArray, random: np.random.Generator, degrees: float = 20.0, noise: float = 0.03) -> NDArray:
    """Turned by up to some degrees, with noise of a share of the hand's size at each landmark."""
    angle = np.deg2rad(random.uniform(-degrees, degrees, len(x)))
    return turned(x, angle) + noise * size(x) * random.normal(size=x.shape)


def shuffled(x: NDArray, random: np.random.Generator) -> NDArray:
    """The landmarks in another order, of each hand another one."""
    order = np.argsort(random.random(x.shape[:2]), axis=1)
    return np.take_along_axis(x, order[:, :, None], axis=1)


def mixed(x: NDArray, random: np.random.Generator) -> NDArray:
    """Every landmark from another hand, each hand turned by chance."""
    some = turned(x / size(x), random.uniform(-np.pi, np.pi, len(x)))
    return some[random.integers(len(x), size=x.shape[:2]), np.arange(x.shape[1])]


def cloud(x: NDArray, random: np.random.Generator) -> NDArray:
    """Points of a normal distribution."""
    return random.normal(size=x.shape)


def torn(x: NDArray, random: np.random.Generator) -> NDArray:
    """Every finger in the place of another one, turned about its base by chance."""
    found = x.copy()
    chains = np.asarray(list(FINGERS.values()))
    for row in range(len(x)):
        order = random.permutation(5)
        while (order == np.arange(5)).any():
            order = random.permutation(5)
        for to, source in zip(chains, chains[order], strict=True):
            part = x[row, source] - x[row, source[0]]
            found[row, to] = x[row, to[0]] + turned(part[None], random.uniform(-np.pi, np.pi, 1))[0]
    return found


SCRAMBLED = {"shuffled": shuffled, "mixed": mixed, "cloud": cloud, "torn": torn}
"""Hands that must be rejected, by name."""


def similarity(source: NDArray, target: NDArray) -> tuple[NDArray, NDArray]:
    """Turn, scale and mirror that bring points (row, point, 2) of zero mean nearest to others: matrices, and residuals."""
    best, least = None, None
    for mirror in (np.eye(2), np.diag([1.0, -1.0])):
        m = source @ mirror
        z, w = m[..., 0] + 1j * m[..., 1], target[..., 0] + 1j * target[..., 1]
        a = (np.conj(z) * w).sum(1) / (np.abs(z) ** 2).sum(1)
        off = (np.abs(a[:, None] * z - w) ** 2).sum(1)
        matrix = mirror @ np.stack([np.stack([a.real, a.imag], -1), np.stack([-a.imag, a.real], -1)], -2)
        if best is None or least is None:
            best, least = matrix, off
        else:
            nearer = off < least
            best, least = np.where(nearer[:, None, None], matrix, best), np.minimum(off, least)
    assert best is not None and least is not None
    return best, least


def other_fingers(hands: Hands, random: np.random.Generator, count: int) -> NDArray:
    """Hands of which other fingers are extended: those of an open hand on the palm of a closed one that fits it (count, 21, 2)."""
    open_, closed = (hands.x[hands.gesture == g] for g in (OPEN, CLOSED))
    palm = np.asarray(PALM)
    found = []
    for k in range(count):
        one, some = open_[random.integers(len(open_))], closed[random.integers(len(closed), size=TRIED)]
        middle = some[:, palm].mean(axis=1, keepdims=True)
        target = some[:, palm] - middle
        source = np.broadcast_to(one[palm] - one[palm].mean(axis=0), target.shape)
        matrix, off = similarity(source, target)
        fits = int(np.argmin(off / (target**2).sum(axis=(1, 2))))
        moved = (one - one[palm].mean(axis=0)) @ matrix[fits] + middle[fits]
        hand = some[fits].copy()
        for name in OTHERS[k % len(OTHERS)]:
            chain = np.asarray(FINGERS[name])
            hand[chain] = hand[chain[0]] + moved[chain] - moved[chain[0]]
        found.append(hand)
    return np.asarray(found, np.float32)
