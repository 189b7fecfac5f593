"""How sure a map's distance is, and a lower bound of it.

Two errors are known: the noise of the points, which the map remembers, and the sampling, as the points of a voxel stand at
their mean and so keep back from the edges of a surface by up to half a spacing, and fill its hollows.
"""

import jax.numpy as jnp

from hrcjax.map.layout import MapLayout
from hrcjax.map.level import block_rows
from hrcjax.map.query import far_share, no_number, read_blocks, slots_far
from hrcjax.map.search import slots_near
from hrcjax.map.state import FieldMap
from hrcjax.numerics import require_floating
from hrcjax.typing import Array, Float, Int, Scalar, Vector3

FLAT = 0.09
"""Deviation from sampling on flat surfaces, over the spacing; measured in generated scenes [1]."""
SHARP = 0.12
"""What sharp edges add to it, over the spacing; a retreat evenly spread to half a spacing deviates by 0.14 [1]."""
HOLLOW = 0.1
"""What hollows add to it, over the spacing: in a corner a voxel's point is the mean of points of both faces, which lies off
both; measured in other generated scenes than the evaluation's [1]."""
BENT = 0.5
"""Flatness over 1 at which all of that is added [1]."""
AWAY = 0.15
"""What is added to it far away, over the spacing: seen from there the nearest part of a body is mostly a corner, where the
retreats of several edges add up [1]."""
FAR_AWAY = (8.0, 40.0)
"""Between these distances over the spacing it sets in [1]."""
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

    def by(slots: Int[Array, "block"], corrected: bool) -> tuple[Float[Array, ""], Float[Array, ""]]:
        reading = read_blocks(block_rows(state.levels[0], slots), layout.scale_of(ratio), x)
        information = state.information.at[slots].get(mode="fill", fill_value=1.0)
        noise = jnp.sum(reading.weights**2 / jnp.maximum(information, 1.0))
        edge, hollow = (jnp.clip(v, 0.0, 1.0) for v in (1.0 - reading.flatness, (reading.flatness - 1.0) / BENT))
        d = reading.distance if corrected else reading.plain
        low, high = (part * layout.spacing for part in FAR_AWAY)
        t = jnp.clip((d - low) / (high - low), 0.0, 1.0)
        sampling = FLAT + SHARP * edge + HOLLOW * hollow + AWAY * t * t * (3.0 - 2.0 * t)
        return d, jnp.sqrt(noise + (layout.spacing * sampling) ** 2)

    d, deviation = by(slots_near(layout, state.levels, x), True)
    far, deviation_far = by(slots_far(layout, state.levels, x), False)
    share, _ = far_share(layout, d)
    nothing = no_number(x)
    return d + share * (far - d) + nothing, deviation + share * (deviation_far - deviation) + nothing


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
