"""The motion of points that ride on a mechanism: what a policy asks of kinematics."""

import equinox as eqx

from hrcjax.typing import Array, Float


class PointMotion(eqx.Module):
    """Places of some points, and how the joints move them: xdd = J qdd + Jd_qd."""

    x: Float[Array, "*batch point 3"]
    """Positions, in the world [m]."""
    xd: Float[Array, "*batch point 3"]
    """Velocities J qd [m/s]."""
    J: Float[Array, "*batch point 3 joint"]
    """Jacobians of x by the joint positions [m/rad]."""
    Jd_qd: Float[Array, "*batch point 3"]
    """Time derivative of J, times qd: the acceleration of the points when qdd is 0 [m/s^2]."""
