"""How sure a map's distance is, and a lower bound of it.

Three errors are known: the noise of the points, which the map remembers; the sampling, as the points of a voxel stand at
their mean and so keep back from the edges of a surface by up to half a spacing, and fill its hollows; and at coarse
levels how far the points are from the means that stand for them.
"""

import jax.numpy as jnp

from hrcjax.map.layout import MapLayout
from hrcjax.map.query import level_share, read_blocks, rows_near, slots_near
from hrcjax.map.state import FieldMap
from hrcjax.numerics import require_floating
from hrcjax.typing import Array, Float, Scalar, Vector3

FLAT = 0.09
"""Deviation from sampling on flat surfaces, over the spacing; measured in generated scenes [1]."""
SHARP = 0.12
"""What sharp edges add to it, over the spacing; a retreat evenly spread to half a spacing deviates by 0.14 [1]."""
HOLLOW = 0.1
"""What hollows add to it, over the spacing: in a corner a voxel's point is the mean of points of both faces, which lies off
both; measured in other generated scenes than the evaluation's [1]."""
BENT = 0.5
"""Flatness over 1 at which all of that is added [1]."""
COARSE_DEVIATION = 0.05
"""Deviation of coarse levels' own distance, over their spacing [1]."""
NORMAL_95 = 1.645
"""One-sided 95 % quantile of the normal distribution [1]."""


def distance_and_deviation(
    layout: MapLayout, state: FieldMap, ratio: Scalar, x: Vector3
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """The distance corrected for curvature (`map_distance`), and the standard deviation of its error [m].

    An unseen surface is in neither: the map cannot know it.

    Args:
        ratio: length scale over spacing [1].
    """
    require_floating("distance_and_deviation", x=x)
    d, deviation = jnp.asarray(0.0, x.dtype), jnp.asarray(0.0, x.dtype)
    for level in reversed(range(layout.levels)):
        blocks, spacing = state.levels[level], layout.spacing_of(level)
        near = read_blocks(rows_near(layout, level, blocks, x), layout.scale_of(level, ratio), x)
        slots = slots_near(layout, level, blocks, x)
        if level:
            extent = state.extent[level - 1].at[slots].get(mode="fill", fill_value=0)
            error = jnp.sum(near.weights * extent) / NORMAL_95 + COARSE_DEVIATION * spacing
        else:
            information = state.information.at[slots].get(mode="fill", fill_value=1.0)
            noise = jnp.sum(near.weights**2 / jnp.maximum(information, 1.0))
            edge, hollow = (jnp.clip(v, 0.0, 1.0) for v in (1.0 - near.flatness, (near.flatness - 1.0) / BENT))
            error = jnp.sqrt(noise + (spacing * (FLAT + SHARP * edge + HOLLOW * hollow)) ** 2)
        share, _ = level_share(layout, level, near.distance)
        d = near.distance + share * (d - near.distance)
        deviation = error + share * (deviation - error)
    return d, deviation


def distance_bound(
    layout: MapLayout, state: FieldMap, ratio: Scalar, x: Vector3, quantile: Scalar = NORMAL_95
) -> Float[Array, ""]:
    """A lower bound of the distance to the mapped surfaces, corrected for curvature, not below 0 [m].

    Args:
        ratio: length scale over spacing [1].
        quantile: deviations that are taken off: 1.645 holds in 95 % of queries [1].
    """
    d, deviation = distance_and_deviation(layout, state, ratio, x)
    return jnp.maximum(d - quantile * deviation, 0.0)
