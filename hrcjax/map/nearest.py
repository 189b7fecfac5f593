"""The points of a map nearest to a place, as a small cloud of fixed capacity."""

import jax
import jax.numpy as jnp

from hrcjax.geom.cloud import Cloud
from hrcjax.map.layout import MapLayout
from hrcjax.map.level import Level, block_rows
from hrcjax.map.search import slots_near
from hrcjax.typing import Vector3

POINTS = 128
"""Points of a local cloud: on a flat surface all within 6.4 spacings."""


def nearest_points(layout: MapLayout, levels: tuple[Level, ...], x: Vector3, count: int = POINTS) -> Cloud:
    """The points of level 0 nearest to x (count, 3) [m]; which they are is a constant to derivatives.

    Args:
        count: capacity of the cloud.
    """
    rows = block_rows(levels[0], slots_near(layout, levels, x))
    points = jnp.moveaxis(rows[:, :3], 1, 2).reshape(-1, 3)
    mask = rows[:, 3].reshape(-1) > 0
    r2 = jnp.sum((points - jax.lax.stop_gradient(x)) ** 2, axis=1)
    _, best = jax.lax.top_k(-jnp.where(mask, r2, jnp.inf), min(count, mask.shape[0]))
    chosen = mask[best]
    return Cloud(jnp.where(chosen[:, None], points[best], 0.0), chosen)
