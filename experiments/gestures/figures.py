"""Figures of an evaluation: confusion, reliability, and part of a stream."""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcjax.hand import COMMANDS, GESTURES, NO_COMMAND
from hrcjax.viz.style import BEST, COLOUR_MAP, GRID, TEXT, WORST, heading, new_figure, tidy

from .measure import Looked, Told
from .stream import RATE, Stream

COLOURS = {"open": "#d9534f", "closed": "#2a9d5c", "pointing": "#1f5fa8", "none": "#8a8f98"}


def confusion_figure(seen: dict[str, Looked]) -> Figure:
    """What the rows of each class are taken for, by each way."""
    figure = new_figure(3.6 * len(seen), 3.4)
    heading(figure, "Held-out rows: true class and what it is taken for")
    for k, (name, one) in enumerate(seen.items()):
        axes = figure.add_subplot(1, len(seen), k + 1)
        counts = one.confusion[:, : one.probability.shape[1]]
        share = counts / counts.sum(axis=1, keepdims=True)
        axes.imshow(share, cmap=COLOUR_MAP, vmin=0, vmax=1)
        for i, j in np.ndindex(*counts.shape):
            axes.text(
                j, i, str(counts[i, j]), ha="center", va="center", color="white" if share[i, j] < 0.6 else "black"
            )
        axes.set_xticks(range(counts.shape[1]), GESTURES[: counts.shape[1]])
        axes.set_yticks(range(3), GESTURES[:3])
        axes.set_xlabel("taken for")
        axes.set_ylabel("true class" if k == 0 else "")
        axes.set_title(f"{name}: {one.accuracy:.3f} right", fontsize=9)
        tidy(axes)
    return figure


def bins_of(probability: NDArray, gesture: NDArray, bins: int = 15) -> tuple[NDArray, NDArray, NDArray]:
    """Mean confidence, share right and number of rows of each bin that is not empty."""
    confidence, right = probability.max(axis=1), probability.argmax(axis=1) == gesture
    place = np.minimum((confidence * bins).astype(int), bins - 1)
    kept = [k for k in range(bins) if (place == k).any()]
    means = [[confidence[place == k].mean(), right[place == k].mean(), (place == k).sum()] for k in kept]
    return tuple(np.asarray(means).T)  # pyright: ignore[reportReturnType]  # three


def reliability_figure(seen: dict[str, Looked]) -> Figure:
    """Share right over confidence."""
    figure = new_figure(4.6, 4.2)
    heading(figure, "Is a probability what it says?")
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color=GRID)
    for (name, one), colour in zip(seen.items(), (BEST, WORST), strict=False):
        confidence, right, count = bins_of(one.probability, one.gesture)
        axes.plot(confidence, right, color=colour, linewidth=1)
        axes.scatter(confidence, right, s=6 + 200 * count / count.sum(), color=colour, label=name)
    axes.set(xlabel="probability of the likeliest gesture [1]", ylabel="share of rows that are right [1]")
    axes.legend(frameon=False, fontsize=8)
    tidy(axes)
    return figure


def stream_figure(stream: Stream, read: Told, begin: int, frames: int, title: str) -> Figure:
    """Probabilities, what is shown, and commands, over time."""
    figure = new_figure(11.0, 3.8)
    heading(figure, title)
    axes, below = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
    rows = slice(begin, begin + frames)
    t = np.arange(begin, begin + frames) / RATE
    for g, name in enumerate(GESTURES):
        axes.plot(t, read.probability[rows, g], color=COLOURS[name], linewidth=1, label=name)
    axes.set_ylabel("probability [1]")
    axes.legend(frameon=False, fontsize=8, ncols=4, loc="lower left", bbox_to_anchor=(0, 1))
    for k in np.flatnonzero(read.command[rows] != NO_COMMAND):
        name = COMMANDS[read.command[begin + k]]
        axes.axvline(t[k], color=TEXT, linewidth=0.8, linestyle=":")
        axes.text(t[k], 1.02, name, fontsize=7, ha="center", va="bottom", color=TEXT)
    below.fill_between(t, 0, read.stopped[rows], step="post", color="#3b3b46", alpha=0.8, linewidth=0)
    for k in stream.begins[(stream.begins >= begin) & (stream.begins < begin + frames)]:
        below.axvline(k / RATE, color=GRID, linewidth=0.6)
        below.text(k / RATE, 1.08, stream.kind[k], fontsize=6, rotation=25, ha="left", va="bottom", color=TEXT)
    below.set(ylim=(0, 1), yticks=[], xlabel="time [s]", ylabel="stands")
    tidy(axes)
    tidy(below)
    return figure
