"""Which pixels above the table belong to one thing: hanging together in an image without a step in depth, and sharing cells of
a grid in metres with what other images show."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from hrcjax.task_space.view import View


class SplitParams(NamedTuple):
    """How things are told apart. All are our choice."""

    edge: float = 0.015
    """Step in depth between neighbouring pixels that is an edge, added to `edge_deviations` [m]."""
    edge_deviations: float = 5.0
    """The same in standard deviations of the step [1]."""
    cell: float = 0.01
    """Edge of the cells that images share [m]."""
    shared: float = 0.15
    """Share of the smaller part's cells that must be the larger one's too [1]."""
    least_pixels: int = 12
    """Smaller parts are noise [1]."""
    poor: float = 1.0
    """Root mean square of residuals, over what noise makes of them, over which a thing is tried as two [1]."""
    claimed: float = 0.01
    """Share of the free rays that a shape may claim before the same [1]."""
    off: int = 12
    """Pixels that are not of the shape's surface before the same [1]."""
    cover: float = 0.01
    """How far outside of its shape something of a thing may be: farther, the shape describes less than what was measured, and two are tried;
    what still has such a shape at the end is kept as points [m]."""
    worst_residual: float = 0.01
    """Root mean square distance of the points from the best shape at which a thing is kept as points [m]."""
    worst_claim: float = 0.1
    """Share of the free rays about a thing that the best shape may claim before it is kept as points [1]."""
    loose: float = 0.5
    """Share of a divided group's points in parts that no shape explains over which it is kept whole [1]."""
    handed: float = 0.5
    """Share of its points that must be on the surface of a neighbour for a thing to hand them over [1]."""
    near: float = 0.025
    """Things with points nearer than this to each other are tried as one [m]."""
    alike: float = 1.1
    """One shape may explain two things worse than two by this factor, and is taken [1]."""
    most: int = 4
    """Times that a group is divided, one part after the other [1]."""


class Part(NamedTuple):
    """A part of one image."""

    view: int
    """Which view."""
    pixels: Int[np.ndarray, "pixel"]
    """Indices into the flat image."""
    label: int
    """Detection that it belongs to; -1: none."""


def image_parts(
    view: View, index: int, above: Bool[np.ndarray, "height width"], labels: Int[np.ndarray, "height width"], params: SplitParams
) -> list[Part]:  # fmt: skip
    """Parts of one image that hang together over its four neighbours without an edge, within one detection."""
    own = np.flatnonzero(above)
    if len(own) == 0:
        return []
    number = np.zeros(above.shape, int)
    number.flat[own] = np.arange(len(own))
    pairs = []
    for a, b in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        step = np.abs(view.depth[a] - view.depth[b])
        slope = 3 * view.depth[a] / view.focal[0]  # of a surface at 70 degrees to the image
        limit = np.maximum(params.edge, slope) + params.edge_deviations * np.hypot(view.deviation[a], view.deviation[b])
        joined = above[a] & above[b] & (step < limit) & (labels[a] == labels[b])
        pairs.append(np.stack([number[a][joined], number[b][joined]]))
    first, second = np.concatenate(pairs, axis=1)
    graph = coo_matrix((np.ones(len(first), bool), (first, second)), shape=(len(own),) * 2)
    component = connected_components(graph, directed=False)[1]
    order = np.argsort(component, kind="stable")
    groups = np.split(own[order], np.flatnonzero(np.diff(component[order])) + 1)
    flat = labels.ravel()
    return [Part(index, g, int(flat[g[0]])) for g in groups if len(g) >= params.least_pixels]


def _cells(place: np.ndarray, edge: float) -> np.ndarray:
    """One number for every cell that holds a point, each once."""
    at = np.floor(place / edge).astype(np.int64) + (1 << 20)
    return np.unique((at[:, 0] << 42) | (at[:, 1] << 21) | at[:, 2])


def join_parts(parts: list[Part], places: list[Float[np.ndarray, "_ 3"]], params: SplitParams) -> list[list[int]]:
    """Groups of parts that share cells: one thing each.

    Args:
        places: of the parts' pixels [m].
    """
    cells = [_cells(p, params.cell) for p in places]
    linked = np.zeros((len(parts), len(parts)), bool)
    for i in range(len(parts)):
        for j in range(i):
            if (
                {parts[i].label, parts[j].label} - {-1}
                and parts[i].view == parts[j].view
                and parts[i].label != parts[j].label
            ):
                continue  # a detector says that they are two
            common = len(np.intersect1d(cells[i], cells[j], assume_unique=True))
            linked[i, j] = common >= 2 and common >= params.shared * min(len(cells[i]), len(cells[j]))
    count, group = connected_components(linked, directed=False)
    return [np.flatnonzero(group == g).tolist() for g in range(count)]
