"""The parameters of our systems in this experiment, and how they were chosen. They are part of the name of every run."""

import equinox as eqx

from hrcjax.sim import Params

TARGET_KP, TARGET_KD = 0.9, 6.0
"""Pull and damping of the target leaf, critically damped: kp / eps = (kd / 2)^2 [m/s^2, 1/s]. The cell's own 10 and 20 follow the
reference to a millimetre, and give back to it all that an image of noise pushes; with these the tool swings by centimetres where people
push it. Chosen by ours_free beside `reach_in`, seed 0: mean squared jerk 1,000 m^2/s^6 with 20, 3.6 with 6."""


def our_params(speed: float) -> Params:
    """The parameters of our systems: the cell's own, but for the pace and the softness of the target leaf.

    Args:
        speed: largest speed of the reference; the default makes the undisturbed cycle as long as the baseline's [m/s].
    """
    return eqx.tree_at(
        lambda p: (p.motion.speed, p.policy.target.kp, p.policy.target.kd), Params(), (speed, TARGET_KP, TARGET_KD)
    )
