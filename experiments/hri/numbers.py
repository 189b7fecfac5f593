"""The parameters of our systems in this experiment, and how they were chosen. They are part of the name of every run."""

import equinox as eqx

from hrcjax.sim import Params


def our_params(speed: float) -> Params:
    """The parameters of our systems: the cell's own, but for the pace.

    Args:
        speed: largest speed of the reference [m/s].
    """
    return eqx.tree_at(lambda p: p.motion.speed, Params(), speed)
