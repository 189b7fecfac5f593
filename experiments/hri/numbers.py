"""The parameters of our systems in this experiment, and how they were chosen. They are part of the name of every run."""

import equinox as eqx

from hrcjax.plan import PathParams
from hrcjax.sim import Params

SOFT = {
    "target.kp": 0.9,
    "target.kd": 6.0,
    "repulsion.gain": 2.0,
    "collision.k_rep": 2.0,
    "collision.s_rep": 0.1,
    "collision.r_act": 0.3,
    "collision.weight": 3.0,
    "collision.v_gate": 0.5,
    "collision.k_damp": 3.0,
    "joint_limit.kd": 5.0,
    "damping.weight": 5e-4,
    "resolve.regularisation": 1e-5,
}
"""Numbers of the policy that differ from the cell's own. Its target leaf follows the reference to a millimetre (kp 10, kd 20), and gives
all back to it that an image's noise pushes; this one is as critically damped, kp / eps = (kd / 2)^2, and swings by centimetres. Collision and
repulsion begin earlier and push less. Chosen by ours_free beside `reach_in`, seed 0, mean squared jerk at 50 Hz [m^2/s^6] and
change of curvature at 4 Hz [1/m]: the cell's own 1,000 and 1.22; the soft target leaf alone 3.6 and 0.68; both 1.5 and 0.34. The last
three numbers are of leaves that draw joints to rest wherever they are, 200 1/s, 5e-3 and 1e-3 in the cell's own: they push a soft target
leaf 2 mm off a straight way. Weaker, they leave `reach_in` as it is, and an undisturbed cycle's change of curvature falls from 0.043 to 0.009."""


def our_params(speed: float) -> Params:
    """The parameters of our systems: the cell's own, but for the pace and the softness of the policy.

    Args:
        speed: largest speed of the reference; the default makes the undisturbed cycle as long as the baseline's [m/s].
    """
    params = eqx.tree_at(lambda p: (p.motion.speed, p.plan), Params(), (speed, PathParams()))
    for name, value in SOFT.items():
        leaf, number = name.split(".")
        params = eqx.tree_at(lambda p, a=leaf, b=number: getattr(getattr(p.policy, a), b), params, value)
    return params
