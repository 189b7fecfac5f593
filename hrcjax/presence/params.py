"""The numbers by which people are told from the scene, and followed where no camera sees them."""

import equinox as eqx

from hrcjax.typing import Scalar


class PresenceParams(eqx.Module):
    """Foreground, support, and what is lost from sight. Values without another source are our choice."""

    margin: Scalar = 0.02
    """A pixel is foreground if it is nearer than all that is known around it by this and by `deviations` [m]."""
    deviations: Scalar = 3.0
    """Standard deviations of the measured depth beyond the margin [1]."""
    robot_margin: Scalar = 0.03
    """The same in front of the robot, whose pose and shape are known less well [m]."""
    pixel_noise: Scalar = 0.08 / (385.0 * 0.05)
    """Standard deviation of a pixel's depth over the square of the depth, s / (f B); the D435i's [1/m]."""
    support_gap: Scalar = 0.05
    """Two of a foreground pixel's eight neighbours must be foreground too, with a depth this near to its own, at 1 m and
    nearer; farther in proportion [m]."""
    least_pixels: Scalar = 2.0
    """Pixels that make a voxel occupied at once; fewer do where somebody was a moment ago [1]."""
    speed: Scalar = 1.6
    """Speed at which a person who was lost from sight may spread where no camera looks (ISO 13855) [m/s]."""
    late: Scalar = 1.6
    """A camera without a good image for this many of its periods does not count any more [1]."""
