"""The distance field of a finished map at the nodes of a grid, once for a world that does not move."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial import KDTree

from hrcjax.field import FAR
from hrcjax.field.grid import GridLayout, grid_nodes
from hrcjax.map.batch import group_readings
from hrcjax.map.layout import VOXELS, MapLayout
from hrcjax.map.state import FieldMap
from hrcjax.typing import Array, Float, Scalar

BLEND = (3.2, 4.8)
"""Between these many spacings h from the nearest point the distance d to it takes over from the field. It is too far by
h^2 / (4 d) at most, amid four points of a plane: by less than h / 10 from there on [1]."""
TAIL = 28.0
"""Points may stay unread if each adds less than exp(-TAIL / 2) to the occupancy, relatively [1]."""
BRICK = 4
"""Nodes along the edge of the bricks whose nodes are read together."""
CHUNK = 64
"""Bricks of one call: one compiled program serves maps of every size."""


@partial(jax.jit, static_argnums=3)
def _distances(
    rows: Float[Array, "brick block 4 voxel"], scale: Scalar, x: Float[Array, "brick query 3"], corrected: bool
) -> Float[Array, "brick query"]:
    """The map's own distances, every brick by its own points [m]."""
    return jax.lax.map(
        lambda one: group_readings(one[0], scale, one[1], jnp.mean(one[1], axis=0), corrected)[0][0], (rows, x)
    )


def _near_distances(
    points: Float[np.ndarray, "point 4"], tree: KDTree, outer: float, scale: float, x: np.ndarray, corrected: bool
) -> Float[np.ndarray, "brick query"]:
    """The map's own distances at the nodes of some bricks, as far as they are less than `outer` [m].

    Args:
        points: of level 0 [m], and their weights.
        tree: of the points.
        scale: length scale of level 0 [m].
        x: (brick, node, 3) [m].
    """
    low, high = x.min(axis=1), x.max(axis=1)
    reach = np.sqrt(outer**2 + TAIL * scale**2) + np.linalg.norm(high - low, axis=1) / 2
    lists = tree.query_ball_point((low + high) / 2, reach, workers=-1)
    longest = max(1, *(len(one) for one in lists))
    width = VOXELS * 2 ** int(np.ceil(np.log2(max(longest / VOXELS, 1.0))))  # few sizes: few programs
    rows = np.zeros((len(x), width, 4), points.dtype)
    for row, one in zip(rows, lists, strict=True):
        row[: len(one)] = points[one]
    rows = np.moveaxis(rows.reshape(len(x), -1, VOXELS, 4), 3, 2)
    found = []
    for start in range(0, len(x), CHUNK):
        chosen = np.minimum(np.arange(start, start + CHUNK), len(x) - 1)
        found.append(_distances(jnp.asarray(rows[chosen]), scale, jnp.asarray(x[chosen]), corrected))
    return np.concatenate([np.asarray(one) for one in found])[: len(x)]


def sample_map(
    layout: MapLayout, state: FieldMap, ratio: Scalar, grid: GridLayout, corrected: bool = True
) -> Float[Array, "x y z"]:
    """Distance to the mapped surfaces at the nodes of a grid, for `hrcjax.field.fit_grid`; FAR if the map has no points [m].

    Near surfaces the map's own field; farther away the distance to the nearest point of level 0, which is cheap, and
    beyond the reach of level 0 nearer to the truth than coarse levels are. Needs concrete numbers: call it outside jit. A large plane in the map, such as a
    table, takes ten times as long: far above it all its points are about as near, and the tree searches them all.

    Args:
        ratio: length scale over spacing [1].
        corrected: for curvature, as in `map_distance`.
    """
    rows = np.asarray(state.levels[0].rows)
    points = np.moveaxis(rows, 1, 2)[rows[:, 3] > 0]
    if len(points) == 0:
        return jnp.full(grid.shape, FAR, rows.dtype)
    x = np.asarray(grid_nodes(grid, rows.dtype))
    tree = KDTree(points[:, :3])
    d = tree.query(x, workers=-1)[0].astype(rows.dtype)
    inner, outer = (share * layout.spacing for share in BLEND)
    near = np.stack(np.unravel_index(np.flatnonzero(d < outer), grid.shape), axis=-1)
    if len(near) > 0:
        steps = np.stack(np.unravel_index(np.arange(BRICK**3), (BRICK,) * 3), axis=-1)
        places = BRICK * np.unique(near // BRICK, axis=0)[:, None] + steps
        nodes = np.ravel_multi_index(np.moveaxis(places, -1, 0), grid.shape, mode="clip")
        scale = float(np.asarray(layout.scale_of(ratio)))
        own = _near_distances(points, tree, outer, scale, x[nodes], corrected)
        t = np.clip((d[nodes] - inner) / (outer - inner), 0.0, 1.0)
        d[nodes] = np.where(t < 1, own + t * t * (3.0 - 2.0 * t) * (d[nodes] - own), d[nodes])
    return jnp.asarray(d.reshape(grid.shape))
