"""The points of a map with the directions from which they were seen, as a small cloud of fixed capacity."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.cloud import Cloud
from hrcjax.map import FieldMap
from hrcjax.map.direction import LEVELS
from hrcjax.map.layout import VOXELS
from hrcjax.numerics import safe_divide, safe_sqrt, unit
from hrcjax.typing import Array, Bool, Float, Scalar, Vector3


class SeenPoints(eqx.Module):
    """Points of surfaces, and where they were seen from."""

    cloud: Cloud
    """Where they are."""
    toward: Float[Array, "point 3"]
    """Mean unit direction to the cameras; 0 where the map has none [1]."""
    deviation: Float[Array, "point"]
    """Standard deviation of the position along the rays, as far as the map knows it [m]."""
    more: Bool[Array, ""]
    """True if there were more points than places."""


def seen_points(
    state: FieldMap, most: int, lower: Vector3, upper: Vector3, most_deviation: Scalar = jnp.inf
) -> SeenPoints:
    """The points of a map's finest level within a box.

    Points of noise lie in the voxels before and behind a surface. Few observations fall there, so that the map knows them by
    their deviation.

    Args:
        most: places.
        lower: least corner of the box [m].
        upper: greatest corner [m].
        most_deviation: points that are less sure than this are left out [m].
    """
    rows = state.levels[0].rows
    inside = jnp.all((rows[:, :3] >= lower[:, None]) & (rows[:, :3] <= upper[:, None]), axis=1)
    variance = safe_divide(jnp.ones_like(state.information), state.information, jnp.inf)
    there = ((rows[:, 3] > 0) & inside & (variance <= most_deviation**2)).reshape(-1)
    index = jnp.nonzero(there, size=most, fill_value=there.size)[0]
    at = (index // VOXELS, slice(None), index % VOXELS)
    points = rows[:, :3].at[at].get(mode="fill", fill_value=0)
    toward = state.levels[0].toward.at[at].get(mode="fill", fill_value=0).astype(points.dtype) / LEVELS
    deviation = safe_sqrt(variance.reshape(-1).at[index].get(mode="fill", fill_value=0))
    return SeenPoints(Cloud(points, index < there.size), jax.vmap(unit)(toward), deviation, jnp.sum(there) > most)
