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
    spread: Scalar = 0.025
    """How far a surface may reach beyond the points that sample it: points of 5 cm voxels stand at their means, and the
    hidden voxels about them count too [m]."""
    far_spread: Scalar = 0.1
    """The same where cubes of 10 cm share a point, beyond the arm's reach [m]."""
    person_noise: Scalar = 0.01
    """And how far the points themselves may lie behind the surface: some standard deviations of the mean of the pixels of a voxel
    1.9 m away [m]."""
