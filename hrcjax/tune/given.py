"""Parameters from a file in place of a cell's defaults: what `--params FILE` of a program does."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hrcjax.lab.errors import UsageError
from hrcjax.lab.parameters import leaf_names, set_leaves
from hrcjax.tune.tuned import read_tuned


@dataclass(frozen=True)
class Given:
    """Parameters, and how they differ from the defaults."""

    params: Any
    """All of them."""
    place: str
    """As given; empty: the defaults."""
    changed: Mapping[str, tuple[float, float]]
    """Default and value by name, where they differ in single precision."""

    def line(self, swept: Collection[str] = ()) -> str:
        """What is said at the start.

        Args:
            swept: names of parameters that take other values.
        """
        if not self.changed:
            return f"parameters of {self.place}: none differs from the defaults"
        each = [
            f"{name} {old:g} -> {new:g}" + (" (swept)" if name in swept else "")
            for name, (old, new) in self.changed.items()
        ]
        verb = "differs from its default" if len(each) == 1 else "differ from the defaults"
        return f"parameters of {self.place}: {len(each)} {verb}: {', '.join(each)}"


def given_params(
    defaults: Any, place: str | Path | None, option: str, domains: Mapping[str, tuple[float, float]] | None = None
) -> Given:
    """The defaults, with the values of a file.

    Args:
        place: a file of tuned parameters, the folder of a tuning, or the name of a shipped file; None or empty: the defaults.
        option: for the message.
        domains: accepted range of parameters by name.

    Raises:
        UsageError: no such file, a name that the cell lacks, or a value that is not accepted.
    """
    if not place:
        return Given(defaults, "", {})
    values, old = read_tuned(place, option), leaf_names(defaults)
    for name, x in values.items():
        if name not in old:
            raise UsageError(f"{option} {place}: the cell has no parameter {name!r}; --list of a sweep shows all")
        low, high = (domains or {}).get(name, (-np.inf, np.inf))
        if not (low <= x <= high and np.isfinite(x)):
            raise UsageError(f"{option} {place}: {name} = {x:g} is outside of its domain [{low:g}, {high:g}]")
    changed = {name: (old[name], x) for name, x in values.items() if np.float32(x) != np.float32(old[name])}
    return Given(set_leaves(defaults, values), str(place), changed)
