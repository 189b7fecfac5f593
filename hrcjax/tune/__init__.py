"""Losses of episodes, for tuning parameters by gradient."""

from hrcjax.tune.loss import episode_loss

__all__ = ["episode_loss"]
