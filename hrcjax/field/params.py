"""The numbers of a distance field."""

import equinox as eqx

from hrcjax.typing import Scalar


class FieldParams(eqx.Module):
    """What a Gaussian-process distance field is tuned by."""

    length_scale: Scalar = 0.035
    """Length scale of the kernel: best 0.6 to 1.0 of the spacing of the points. Larger is smoother, and further over
    the true distance of convex bodies (see `convex_bias`) [m]."""
    noise: Scalar = 0.01
    """Standard deviation of the noise of the occupancy, whose training target is 1 [1]."""
    person_radius: Scalar = 0.05
    """Smallest radius of a limb whose distance must not be over-estimated, by `lower_bound`: convex bodies read too far
    [m]."""
