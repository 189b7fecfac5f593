"""The grid of a sweep over some of the parameters, all others at their defaults."""

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.cells.named_cell import NamedCell
from hrcjax.lab.errors import UsageError
from hrcjax.sweeps.settings import Settings, make_settings
from hrcjax.tune import Chosen

from .account import Account
from .config import TuneBenchmarkConfig

FAR = 30.0
"""Largest coordinate; a value at a bound has an infinite one [1]."""


def grid_settings(config: TuneBenchmarkConfig, named: NamedCell, chosen: Chosen) -> Settings:
    """The grid.

    Raises:
        UsageError: a swept parameter is not among those tuned, or a value is out of its bounds.
    """
    settings = make_settings(
        config.grid, named.params, aliases=named.known_aliases(), domains=named.known_domains(), quick=config.quick
    )
    for name, values in settings.values.items():
        if name not in chosen.names:
            raise UsageError(f"--grid {name}: accepted are parameters of --params, so that all methods may change them")
        bounds = chosen.bounds[chosen.names.index(name)]
        if not (bounds.low <= values.min() and values.max() <= bounds.high):
            raise UsageError(
                f"--grid {name}: accepted are values within {bounds.low:g}:{bounds.high:g}, as in --params"
            )
    return settings


def grid_vectors(settings: Settings, chosen: Chosen) -> NDArray[np.float64]:
    """Coordinates (setting, parameter)."""
    vectors = np.repeat(chosen.start()[None], settings.count, axis=0)
    with jax.enable_x64(True):
        for name, values in settings.values.items():
            k = chosen.names.index(name)
            different, places = np.unique(values, return_inverse=True)
            free = [float(chosen.bounds[k].to_free(jnp.asarray(x, jnp.float64))) for x in different]
            vectors[:, k] = np.clip(free, -FAR, FAR)[places]
    return vectors


def grid_sweep(account: Account, config: TuneBenchmarkConfig, vectors: NDArray) -> None:
    """All settings in order."""
    for k in range(0, len(vectors), config.at_once):
        account.evaluate(vectors[k : k + config.at_once])
