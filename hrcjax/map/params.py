"""The numbers of a map."""

import equinox as eqx

from hrcjax.typing import Scalar

POSITIVE = ("ratio", "least_deviation", "memory", "far")
"""Parameters that must not be 0."""


class MapParams(eqx.Module):
    """What a map is tuned by. Sources: the presets of the HRI paper's map where they have one, else our choice."""

    ratio: Scalar = 0.7
    """Length scale over spacing; best 0.6 to 1.0 [1]."""
    noise: Scalar = 0.01
    """Standard deviation of the noise of the occupancy, whose training target is 1 [1]."""
    pixel_noise: Scalar = 0.08 / (385.0 * 0.05)
    """Standard deviation of a pixel's depth over the square of the depth, s / (f B); the D435i's [1/m]."""
    least_deviation: Scalar = 1e-3
    """Errors of one frame are not independent: the mean of many pixels is not surer than this [m]."""
    memory: Scalar = 25.0
    """Most observations that the information of a point stands for, so that slow changes are tracked [1]."""
    through: Scalar = 0.01
    """A point is in free space if all pixels of its tile measured a surface farther behind it than this and a standard
    deviation of the depth [m]."""
    clear_distance: Scalar = 0.025
    """And if no point of the frame is nearer to it than this: at grazing view a surface lies behind its own points [m]."""
    new_distance: Scalar = 0.0375
    """A measured point farther than this from all points of the map is new [m]."""
    patience: Scalar = 1.0
    """Frames that must find a point in free space, without an observation in between, before it is removed [1]."""
    fade: Scalar = 0.8
    """Factor of a point's information for every frame that finds it in free space [1]."""
    least_information: Scalar = 0.6
    """A point is removed when its information falls below this share of that of one pixel: noise near a surface that was
    observed once [1]."""
    near: Scalar = 0.28
    """Least depth that counts [m]."""
    far: Scalar = 3.0
    """Greatest depth that counts: farther, noise makes a D435i's surfaces thicker than voxels of 2.5 cm [m]."""
    drift: Scalar = 0.1
    """Weights are refitted when points have moved by this share of the spacing [1]."""
