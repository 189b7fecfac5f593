"""A cell with everything that a sweep needs, and the lookup of cells by name."""

import importlib
import math
import sys
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from hrcjax.lab.errors import UsageError, one_line
from hrcjax.lab.parameters import leaf_names
from hrcjax.sim import Cell, Episode, Params, World
from hrcjax.sweeps.sweepable import Metric
from hrcjax.typing import Array

ALIASES = {
    "K_att": "potential.k_att",
    "K_rep": "potential.k_rep",
    "zeta": "potential.zeta",
    "omega1": "plan.omega1",
    "omega2": "plan.omega2",
    "length_scale": "field.length_scale",
}
DOMAINS = {
    "potential.k_att": (1e-4, 1.0),
    "potential.k_rep": (0.0, 1.0),
    "potential.zeta": (1.0, 10.0),
    "plan.omega1": (1e-6, 1e3),
    "plan.omega2": (0.0, 1e3),
    "field.length_scale": (0.01, 0.2),
    "field.noise": (0.0, 1.0),
    "motion.speed": (0.01, 1.5),
}
"""Accepted ranges of parameters: values outside are meaningless or numerically unstable. All other parameters of the built-in
parts must not be negative; those of user-defined parts may be any number."""


MetricFn = Callable[[Params, Cell, World, Episode], Array]
"""(params, cell, world, episode) -> scalar."""


@dataclass(frozen=True)
class NamedCell:
    """A cell with the defaults, domains and metrics that a sweep needs: the value of `--cell`."""

    cell: Cell
    params: Params = field(default_factory=Params)
    """Defaults. A user-defined part has its own parameters, such as `Params(policy=...)`: any pytree of floats."""
    aliases: Mapping[str, str] = field(default_factory=dict)
    """Short names of parameters, in addition to K_att, K_rep, zeta and others: {"gain": "policy.gain"}."""
    domains: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Smallest and largest accepted value of parameters by dotted name."""
    metrics: Mapping[str, tuple[Metric, MetricFn]] = field(default_factory=dict)
    """Metrics in addition to the built-in ones."""
    files: tuple[str, ...] = ()
    """Files other than code that affect results, such as an arm's MJCF; a run resumes only if they are unchanged."""
    identity: str | None = None
    """Identifies a built-in cell, so that the traced program can be cached between runs; None: no cache."""
    code: str = ""
    """Module of a cell that is not built in; a sweep puts the digest of what decides its results in its place."""

    def known_aliases(self) -> dict[str, str]:
        """All short names of parameters of this cell."""
        names = leaf_names(self.params)
        return {alias: name for alias, name in {**ALIASES, **self.aliases}.items() if name in names}

    def known_domains(self) -> dict[str, tuple[float, float]]:
        """The domain of every parameter."""
        built_in, names = leaf_names(Params()), leaf_names(self.params)
        least = {name: (0.0 if name in built_in else -math.inf, math.inf) for name in names}
        return least | {name: DOMAINS[name] for name in names if name in DOMAINS} | dict(self.domains)


def find_cell(name: str, built_in: Mapping[str, Callable[[], NamedCell]]) -> NamedCell:
    """A built-in cell by name, or the result of `module:function`; modules in the current folder are found.

    Raises:
        UsageError: no such cell, module or function, or the function fails or returns another type.
    """
    if name in built_in:
        return built_in[name]()
    place, colon, function = name.partition(":")
    if not (colon and place and function):
        raise UsageError(f"no cell {name!r}; accepted: {', '.join(built_in)}, or MODULE:FUNCTION")
    if place.endswith(".py"):
        raise UsageError(f"--cell {name}: accepted is {place[:-3]}:{function}, without .py")
    if str(Path.cwd()) not in sys.path and "" not in sys.path:
        sys.path.insert(0, str(Path.cwd()))
    try:
        module = importlib.import_module(place)
        build = getattr(module, function)
        made = build()
    except Exception as error:  # user code may raise anything
        frames = traceback.extract_tb(error.__traceback__)
        last = next((f for f in reversed(frames) if Path(f.filename).is_relative_to(Path.cwd())), None)
        where = f" ({Path(last.filename).name}, line {last.lineno})" if last else f"; looked in {Path.cwd()} first"
        raise UsageError(f"--cell {name}: {type(error).__name__}: {one_line(error)}{where}") from error
    made = NamedCell(made) if isinstance(made, Cell) else made
    if not isinstance(made, NamedCell):
        raise UsageError(f"--cell {name}: returns {type(made).__name__}; accepted: a Cell or a NamedCell")
    return NamedCell(**{**vars(made), "identity": None, "code": place})
