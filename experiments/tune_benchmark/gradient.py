"""Adam on the smooth loss, several starts side by side: the steps of `experiments.tune`, each in all training worlds."""

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.tune import Values, initial_tuning, tune_step

from ..tune.optimiser import make_optimiser
from .account import Account
from .config import TuneBenchmarkConfig
from .starts import starting


def gradient(account: Account, config: TuneBenchmarkConfig, seed: int) -> None:
    """Steps until the budget is used; in the last one perhaps of the first starts alone."""
    slopes, optimiser = account.race.slopes, make_optimiser(config.rate, config.clip)
    vectors = jnp.asarray(starting(account.race.problem, seed, 0, config.starts), slopes.dtype)
    state = initial_tuning(vectors, optimiser, jax.random.key(seed))
    step = jax.jit(lambda state, found: tune_step(state, found, optimiser))
    while count := min(config.starts, account.affordable(gradient=True)):
        loss, slope = account.gradients(np.asarray(state.vector[:count]))
        full_loss, full_slope = np.full(config.starts, np.nan), np.full(state.vector.shape, np.nan)
        full_loss[:count], full_slope[:count] = loss, slope
        found = (jnp.asarray(x, slopes.dtype) for x in (full_loss, full_loss[:, None, None], full_slope))
        state = step(state, Values(*found))
