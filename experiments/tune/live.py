"""The table of a running tuning: a header once, then a row every few steps, aligned."""

from collections.abc import Sequence

import numpy as np

from hrcjax.sweeps.settings import short_labels

from .optimiser import History

WIDTH = 9
"""Least width of a column [characters]."""


class LiveTable:
    """Rows of the start whose loss was the least in the newest step."""

    def __init__(self, names: Sequence[str], terms: Sequence[str], starts: int) -> None:
        """Args: names: dotted, of the parameters. terms: of the loss. starts: side by side."""
        values = short_labels(names, taken=("step", "start", "loss", *terms))
        self.heads = ["step", *(["start"] if starts > 1 else []), "loss", *terms, "|gradient|", *values]
        self.widths = [5 if head in ("step", "start") else max(len(head), WIDTH) for head in self.heads]
        self.starts = starts

    def _line(self, cells: Sequence[str]) -> str:
        return "  ".join(f"{cell:>{width}}" for cell, width in zip(cells, self.widths, strict=True))

    @property
    def header(self) -> str:
        """The names."""
        return self._line(self.heads)

    def row(self, step: int, history: History, stood: int) -> str:
        """The newest step.

        Args:
            step: number of steps done.
            stood: gradients that were not finite so far.
        """
        newest = {name: array[-1] for name, array in history.items()}
        k = int(np.argmin(np.where(np.isfinite(newest["loss"]), newest["loss"], np.inf)))
        numbers = [newest["loss"][k], *newest["terms"][k], np.linalg.norm(newest["gradient"][k]), *newest["values"][k]]
        cells = [str(step), *([str(k)] if self.starts > 1 else []), *(f"{x:.4g}" for x in numbers)]
        return self._line(cells) + (f"  {stood} not finite" if stood else "")
