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
    """A point counts as many frames at most, so that slow changes are followed [1]."""
    through: Scalar = 0.01
    """A point is seen through if all pixels of its tile lie farther behind than this and a deviation [m]."""
    clear_distance: Scalar = 0.025
    """And if nothing that the frame sees is nearer to it than this: aslant, a surface lies behind its own points [m]."""
    new_distance: Scalar = 0.0375
    """What is seen farther than this from all points of the map is new [m]."""
    patience: Scalar = 2.0
    """Frames that see through a point, without meeting it in between, before it goes [1]."""
    fade: Scalar = 0.8
    """What is left of a point's information when a frame sees through it [1]."""
    least_information: Scalar = 0.6
    """It goes when less is left than this share of what one pixel tells: beside a surface, noise that was seen once [1]."""
    near: Scalar = 0.28
    """Least depth that counts [m]."""
    far: Scalar = 3.0
    """Greatest depth that counts: farther, noise makes a D435i's surfaces thicker than voxels of 2.5 cm [m]."""
    drift: Scalar = 0.1
    """Weights are fitted anew when points have moved by this share of the spacing [1]."""
