"""What is measured of a classifier and of its commands, as arrays."""

from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.hand import (
    GESTURES,
    GO,
    HOME,
    NO_COMMAND,
    NONE,
    POINT,
    STOP,
    Classifier,
    CommandParams,
    initial_commands,
    rule_gesture,
    update_commands,
)

from .data import Hands
from .stream import RATE, Stream
from .unlike import SCRAMBLED, disturbed, other_fingers

Probable = Callable[[NDArray], NDArray]
"""Landmarks (row, 21, 2) -> probabilities (row, gesture)."""
MOMENT = 5
"""Frames after the begin of an open hand within which a stop counts as seen at once."""


def by_classifier(model: Classifier) -> Probable:
    """Probabilities of a classifier."""
    run = jax.jit(jax.vmap(model.probabilities))
    return lambda x: np.asarray(run(jnp.asarray(x, jnp.float32)))


def by_rule() -> Probable:
    """The rule of extended fingers, as probabilities of 0 and 1."""
    run = jax.jit(jax.vmap(rule_gesture))
    return lambda x: np.eye(len(GESTURES))[np.asarray(run(jnp.asarray(x, jnp.float32)))]


@dataclass(frozen=True)
class Looked:
    """A classifier on held-out blocks."""

    probability: NDArray
    """Of the rows as recorded (row, gesture)."""
    gesture: NDArray
    """Their classes."""
    turned: float
    """Share right with up to 20 degrees of turn and 3 % of noise."""
    rejected: dict[str, float]
    """Share rejected, by the kind of disorder."""
    other: float
    """Share rejected of hands with other fingers extended."""

    @property
    def accuracy(self) -> float:
        """Share right [1]."""
        return float((self.probability.argmax(axis=1) == self.gesture).mean())

    @property
    def confusion(self) -> NDArray:
        """Rows by class and by what they were taken for (gesture, gesture)."""
        found = np.zeros((3, len(GESTURES)), int)
        np.add.at(found, (self.gesture, self.probability.argmax(axis=1)), 1)
        return found


def looked(probable: Probable, hands: Hands, seed: int) -> Looked:
    """Looks at held-out rows, as they are and changed; the changes are drawn by the seed, alike for every classifier."""
    random = np.random.default_rng([seed, 1])
    shifted = [disturbed(hands.x, random) for _ in range(5)]
    turned = float(np.mean([(probable(x).argmax(axis=1) == hands.gesture).mean() for x in shifted]))
    rejected = {}
    for name, scramble in SCRAMBLED.items():
        shown = probable(scramble(hands.x, random))
        rejected[name] = float((shown.argmax(axis=1) == NONE).mean()) if shown.shape[1] > NONE else 0.0
    shown = probable(other_fingers(hands, random, 1000))
    other = float((shown.argmax(axis=1) == NONE).mean()) if shown.shape[1] > NONE else 0.0
    return Looked(probable(hands.x), hands.gesture, turned, rejected, other)


@dataclass(frozen=True)
class Told:
    """Commands read from a stream."""

    command: NDArray
    """Given in each frame."""
    stopped: NDArray
    """Whether the arm must stand after it."""
    probability: NDArray
    """Of the first hand (frame, gesture); NaN where there is none."""


def told(probable: Probable, params: CommandParams, stream: Stream) -> Told:
    """The commands of a stream, frame by frame, from an arm that stands."""
    hands = stream.x.shape[1]
    probability = np.stack([probable(stream.x[:, k]) for k in range(hands)], axis=1)
    probability = np.where(stream.seen[:, :, None], probability, np.nan).astype(np.float32)

    def frame(state, now):
        state, command = update_commands(params, state, *now)
        return state, (command, state.stopped)

    steps = (jnp.asarray(probability), jnp.asarray(stream.seen), jnp.asarray(stream.dt))
    _, (command, stopped) = jax.jit(lambda s: jax.lax.scan(frame, initial_commands(jnp.dtype("float32"), True), s))(
        steps
    )
    return Told(np.asarray(command), np.asarray(stopped), probability[:, 0])


def false_starts(stream: Stream, read: Told) -> dict[str, int]:
    """Of a stream without a go: every go, and every goal chosen while nobody pointed or had two open hands."""
    go = int((read.command == GO).sum())
    home = int((read.command == HOME).sum())
    kind = np.asarray(stream.kind)
    pointed = np.isin(kind, ("pointing", "transition", "occluded"))
    return {"go": go, "home": home, "point": int(((read.command == POINT) & ~pointed).sum())}


def false_stops(stream: Stream, read: Told) -> int:
    """Of a stream without a go: parts with a stop where no hand was open, nor a moment before."""
    opened = np.isin(stream.kind, ("open", "transition", "occluded", "closed for a moment"))
    lately = np.convolve(opened, np.ones(MOMENT + 1), "full")[: len(opened)] > 0
    stops = np.flatnonzero((read.command == STOP) & ~lately)
    return len(np.unique(np.searchsorted(stream.begins, stops, side="right")))


def delays(stream: Stream, read: Told) -> dict[str, NDArray]:
    """Time from the begin of each shown gesture to its command, infinite where it was not given [s]."""
    ends = np.append(stream.begins[1:], len(stream.x))
    found: dict[str, list[float]] = {"open": [], "closed": [], "pointing": []}
    wanted = {"open": STOP, "closed": GO, "pointing": POINT}
    for begin, end in zip(stream.begins, ends, strict=True):
        name = stream.kind[begin]
        if name in wanted:
            given = np.flatnonzero(read.command[begin:end] == wanted[name])
            found[name].append((given[0] + 1) / RATE if len(given) else np.inf)
    return {name: np.asarray(values) for name, values in found.items()}


def no_commands(read: Told) -> int:
    """Commands given at all."""
    return int((read.command != NO_COMMAND).sum())
