"""Losses of episodes, and the steps that tune parameters by their gradient."""

from hrcjax.tune.bounds import Bounds
from hrcjax.tune.chosen import Chosen, choose
from hrcjax.tune.declared import LOSSES, Loss, episode_terms, find_loss, parse_losses
from hrcjax.tune.felt import Felt, feel
from hrcjax.tune.loss import episode_loss
from hrcjax.tune.step import TuneState, Values, initial_tuning, minibatch, tune_step, values_and_gradients

__all__ = [
    "LOSSES", "Bounds", "Chosen", "Felt", "Loss", "TuneState", "Values", "choose", "episode_loss", "episode_terms", "feel",
    "find_loss", "initial_tuning", "minibatch", "parse_losses", "tune_step", "values_and_gradients",
]  # fmt: skip
