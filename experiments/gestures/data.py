"""Landmarks of recorded hands, divided into blocks of the recording."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hrcjax.hand.landmarks import GESTURES, LANDMARKS
from hrcjax.lab.errors import UsageError

BLOCKS = 10
"""Into which the rows of each class are divided, in the order of the recording."""
HELD = (2, 7)
"""Blocks that no training sees."""
FOLDS = ((0, 5), (1, 6), (3, 8), (4, 9))
"""Inner folds of the others, by which hyperparameters are chosen."""
EDGE = 5
"""Rows next to a border of blocks that training leaves out: neighbours in time are nearly the same hand."""


@dataclass(frozen=True)
class Hands:
    """Rows of a recording."""

    x: NDArray
    """Landmarks (row, 21, 2), in units of the image."""
    gesture: NDArray
    """Class of each row."""
    block: NDArray
    """Block of each row, within its class."""
    edge: NDArray
    """Whether a row is next to a border of blocks."""

    def some(self, rows: NDArray) -> "Hands":
        """Some of the rows."""
        return Hands(self.x[rows], self.gesture[rows], self.block[rows], self.edge[rows])

    def outside(self, *blocks: int) -> "Hands":
        """Rows of all blocks but these and `HELD`, without those at their borders."""
        return self.some(~np.isin(self.block, (*blocks, *HELD)) & ~self.edge)

    def of(self, *blocks: int) -> "Hands":
        """Rows of these blocks."""
        return self.some(np.isin(self.block, blocks))


def in_blocks(x: NDArray, gesture: NDArray) -> Hands:
    """Rows in the order of the recording, each class divided into `BLOCKS` of equal size."""
    block, edge = np.zeros(len(x), int), np.zeros(len(x), bool)
    for one in np.unique(gesture):
        rows = np.flatnonzero(gesture == one)
        mine = np.arange(len(rows)) * BLOCKS // len(rows)
        block[rows] = mine
        for border in np.flatnonzero(np.diff(mine)) + 1:
            edge[rows[max(border - EDGE, 0) : border + EDGE]] = True
    return Hands(np.asarray(x, np.float32), gesture.astype(int), block, edge)


def read_hands(file: Path) -> Hands:
    """A file of rows: class, then x and y of 21 landmarks.

    Raises:
        UsageError: no such file, or another format.
    """
    try:
        rows = np.loadtxt(file, delimiter=",", ndmin=2)
    except (OSError, ValueError) as error:
        text = "no such file" if isinstance(error, FileNotFoundError) else "no table of numbers"
        raise UsageError(f"--data {file}: {text}; accepted: rows of a class and x, y of 21 landmarks") from error
    if rows.shape[1] != 1 + 2 * LANDMARKS or not np.isin(rows[:, 0], range(len(GESTURES) - 1)).all():
        raise UsageError(f"--data {file}: accepted are rows of a class, 0, 1 or 2, and x, y of 21 landmarks")
    hands = in_blocks(rows[:, 1:].reshape(-1, LANDMARKS, 2), rows[:, 0].astype(int))
    if np.bincount(hands.gesture, minlength=3).min() < 10 * BLOCKS:
        raise UsageError(f"--data {file}: accepted are at least {10 * BLOCKS} rows of each class")
    return hands
