"""Task-space mapping (Robotica 2025, section 2.2): depth images of a still table in, named obstacles as shapes out."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from hrcjax.task_space.instances import Part, SplitParams, image_parts, join_parts
from hrcjax.task_space.segmenter import Detection, Segmenter, no_segmenter, pixel_labels
from hrcjax.task_space.shape_fit import FitParams
from hrcjax.task_space.solid_distance import POINTS
from hrcjax.task_space.split import Explained, explain, hand_over, rejoin, shaped
from hrcjax.task_space.table import Table, find_table, inside
from hrcjax.task_space.view import View, points, steady, turned


class TaskSpaceParams(NamedTuple):
    """Numbers of the mapping. All are our choice."""

    split: SplitParams = SplitParams()
    fit: FitParams = FitParams()
    above: float = 0.006
    """Least height over the table of a point of a thing, added to `above_deviations` [m]."""
    above_deviations: float = 4.0
    """The same in standard deviations of the height [1]."""
    ceiling: float = 0.7
    """Greatest height over the table [m]."""
    least_height: float = 0.015
    """Lower things are not taken for obstacles [m]."""
    edge: float = 0.05
    """How far beyond the outline of what is seen of the table things may begin: a thing at its border hides the table behind it [m]."""
    overhang: float = 0.3
    """How far beyond the outline a thing may reach that begins there: what reaches farther stands beside the table, as a wall does, and is cut
    at `edge` [m]."""


class Instance(NamedTuple):
    """One thing on the table, in the table's frame."""

    name: str
    """By a detector, or "object"."""
    kind: int
    """SPHERE, COLUMN, BOX or `POINTS`."""
    center: Float[np.ndarray, "3"]
    """Middle of the shape, or of the points' upright box [m]."""
    size: Float[np.ndarray, "3"]
    """Half extents, as in a `Scene` [m]."""
    yaw: float
    """Turn about the vertical [rad]."""
    center_deviation: Float[np.ndarray, "3"]
    """Standard deviations of the centre; not finite for points [m]."""
    size_deviation: Float[np.ndarray, "3"]
    """And of the half extents [m]."""
    residual: float
    """Root mean square of the points' distances from the shape; not finite for points [m]."""
    claimed: float
    """Share of the free rays about it that pass through the shape [1]."""
    points: Float[np.ndarray, "point 3"]
    """[m]"""
    box: bool = True
    """Whether `size` is solid for points too: the box that bounds them, down to the table where nothing passes below."""


class TaskSpace(NamedTuple):
    """The map of a table."""

    table: Table
    instances: list[Instance]
    views: list[View]
    """In the table's frame."""


def _name(parts: list[Part], found: list[list[Detection]]) -> str:
    """The name that most of the pixels have."""
    votes: dict[str, int] = {}
    for part in parts:
        if part.label >= 0:
            name = found[part.view][part.label].name
            votes[name] = votes.get(name, 0) + len(part.pixels)
    return max(votes, key=lambda name: votes[name]) if votes else "object"


def _instance(name: str, one: Explained, params: TaskSpaceParams) -> Instance:
    kind, fit, seen, place = one.kind, one.fit, one.seen, one.place
    if shaped(one, params.split):
        center, size, off, spread = (np.asarray(x, float) for x in (fit.center, fit.size, fit.center_deviation, fit.size_deviation))  # fmt: skip
        return Instance(name, kind, center, size, float(fit.yaw), off, spread, float(fit.residual), float(fit.claimed), place)  # fmt: skip
    lower, upper = place.min(0), place.max(0)
    if seen.stands:
        lower[2] = 0.0
    nothing = np.full(3, np.inf)
    return Instance(name, POINTS, (lower + upper) / 2, (upper - lower) / 2, 0.0, nothing, nothing, np.inf, float(fit.claimed), place)  # fmt: skip


def above_table(view: View, table: Table, params: TaskSpaceParams) -> Bool[np.ndarray, "height width"]:
    """Pixels higher than the table, beside it too. The view is in the table's frame."""
    place = points(view)
    away = view.position - place
    fall = np.abs(away[..., 2]) / np.maximum(np.linalg.norm(away, axis=-1), 1e-9)
    height = place[..., 2]
    least = params.above + params.above_deviations * view.deviation * fall
    return steady(view) & (height > least) & (height < params.ceiling)


def parts_on_table(
    view: View, index: int, table: Table, labels: Int[np.ndarray, "height width"], params: TaskSpaceParams
) -> list[Part]:
    """Parts of an image that are on the table: what is over it or up to `edge` beside it, and hangs together; with what hangs together
    with that beyond `edge`, if it ends within `overhang`. The view is in the table's frame."""
    above = above_table(view, table, params)
    place = points(view).reshape(-1, 3)[:, :2]
    whole, cut = [], np.zeros(above.size, bool)
    for part in image_parts(view, index, above, labels, params.split):
        near = inside(table.corners, place[part.pixels], params.edge)
        if near.any() and inside(table.corners, place[part.pixels], params.overhang).all():
            whole.append(part)
        else:
            cut[part.pixels] = near
    if cut.any():  # what is left may hang together no more
        whole += image_parts(view, index, cut.reshape(above.shape), labels, params.split)
    return sorted(whole, key=lambda part: part.pixels[0])


def map_table(
    views: list[View],
    up: Float[np.ndarray, "3"],
    params: TaskSpaceParams | None = None,
    segmenter: Segmenter = no_segmenter,
    table: Table | None = None,
) -> TaskSpace:
    """The things on a table, from views of it.

    Args:
        up: about upwards in the world, of length 1.
        segmenter: names things and splits what depth alone would join; used on views that have a colour image.
        table: if it is known; None: it is found.

    Raises:
        ValueError: no table is in view.
    """
    params = TaskSpaceParams() if params is None else params
    table = find_table(views, up) if table is None else table
    own = [turned(v, table.rotation, table.shift) for v in views]
    own = [v._replace(deviation=v.deviation * table.excess) for v in own]
    found = [[] if v.colour is None else segmenter(v.colour) for v in own]
    labels = [pixel_labels(view.depth.shape, here) for view, here in zip(own, found, strict=True)]
    parts = [part for k, view in enumerate(own) for part in parts_on_table(view, k, table, labels[k], params)]
    flat = [points(view).reshape(-1, 3) for view in own]
    places = [flat[part.view][part.pixels] for part in parts]
    things: list[Explained] = []
    for group in join_parts(parts, places, params.split):
        mine, where = [parts[k] for k in group], [places[k] for k in group]
        if np.percentile(np.concatenate(where)[:, 2], 95) < params.least_height:
            continue
        things += explain(own, mine, flat, params.fit, params.split)
    things = rejoin(own, things, flat, params.fit, params.split)
    things = hand_over(own, things, flat, params.fit, params.split)
    instances = [_instance(_name(one.parts, found), one, params) for one in things]
    return TaskSpace(table, instances, own)
