"""Tune parameters by the gradient of whole episodes: chosen by name, within bounds, judged by exact metrics in worlds that the
tuning has not seen."""
