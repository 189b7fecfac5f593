"""The distance field of a finished map at the nodes of a grid, once for a world that does not move."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial import KDTree

from hrcjax.field import FAR
from hrcjax.field.grid import GridLayout, grid_nodes
from hrcjax.map.batch import map_distances_and_gradients
from hrcjax.map.host import labelled_points
from hrcjax.map.layout import MapLayout
from hrcjax.map.level import Level
from hrcjax.map.state import FieldMap
from hrcjax.typing import Array, Float, Scalar

BLEND = (3.2, 4.8)
"""Between these many spacings h from the nearest point the distance d to it takes over from the field. It is too far by
h^2 / (4 d) at most, amid four points of a plane: by less than h / 10 from there on [1]."""
CHUNK = 4096
"""Queries of one call: one compiled program serves maps of every size."""
BRICK = 8
"""Nodes along the edge of the bricks that chunks are made of."""


@partial(jax.jit, static_argnums=(0, 4))
def _distances(
    layout: MapLayout, levels: tuple[Level, ...], ratio: Scalar, x: Float[Array, "query 3"], corrected: bool
) -> Float[Array, "query"]:
    """The map's own distances [m]."""
    return map_distances_and_gradients(layout, levels, ratio, x, corrected)[0]


def sample_map(
    layout: MapLayout, state: FieldMap, ratio: Scalar, grid: GridLayout, corrected: bool = True
) -> Float[Array, "x y z"]:
    """Distance to the mapped surfaces at the nodes of a grid, for `hrcjax.field.fit_grid`; FAR if the map has no points [m].

    Near surfaces the map's own field, farther away the distance to the nearest point of level 0, which is nearer to the
    truth there than coarse levels are. Needs concrete numbers: call it outside jit.

    Args:
        ratio: length scale over spacing [1].
        corrected: for curvature, as in `map_distance`.
    """
    points, _ = labelled_points(state)
    dtype = state.levels[0].rows.dtype
    if len(points) == 0:
        return jnp.full(grid.shape, FAR, dtype)
    x = np.asarray(grid_nodes(grid, dtype))
    d = KDTree(points).query(x, workers=-1)[0].astype(dtype)
    inner, outer = (share * layout.spacing for share in BLEND)
    near = np.flatnonzero(d < outer)
    if len(near) == 0:
        return jnp.asarray(d.reshape(grid.shape))
    bricks = [index // BRICK for index in np.unravel_index(near, grid.shape)]
    near = near[np.lexsort(bricks)]  # chunks of neighbours
    padded = np.concatenate([near, np.full(-len(near) % CHUNK, near[-1])]).reshape(-1, CHUNK)
    chunks = [_distances(layout, state.levels, ratio, jnp.asarray(x[one]), corrected) for one in padded]
    own = np.concatenate([np.asarray(one) for one in chunks])[: len(near)]
    t = np.clip((d[near] - inner) / (outer - inner), 0.0, 1.0)
    d[near] = own + t * t * (3.0 - 2.0 * t) * (d[near] - own)
    return jnp.asarray(d.reshape(grid.shape))
