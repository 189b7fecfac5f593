"""Consistency check of the arrays of a map."""

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.map import LABELS, FieldMap, MapLayout
from hrcjax.map.blocks import bounding_boxes
from hrcjax.map.index import GRAIN, NO_BOX, OCTET, boxes_by_place, hull_below, hull_of
from hrcjax.map.layout import REACH
from hrcjax.map.level import Level

FRAMES = 1 << 16
"""Frames are counted modulo this."""
ROUNDING = 1
"""Tolerance of the sides of a box, for rounding of compiled programs [parts of a block]."""


def fault_of_map(layout: MapLayout, state: FieldMap) -> str:
    """The first inconsistency of a map whose arrays have the right shapes and finite numbers; "": none.

    Args:
        state: with arrays of NumPy or JAX.
    """
    for k, level in enumerate(state.levels):
        fault = fault_of_level(layout, k, level, state.levels[k - 1] if k else None)
        if fault:
            return f"levels.{k}.{fault}"
    ranges = {
        "turn": (state.turn, layout.capacity),
        "label": (state.label, len(LABELS)),
        "missed": (state.missed, np.inf),
        "unmet": (state.unmet, np.inf),
        "information": (state.information, np.inf),
        "drift": (state.drift, np.inf),
        "frames": (state.frames, FRAMES),
    }
    for name, (values, end) in ranges.items():
        array = np.asarray(values)
        if ((array < 0) | (array >= end)).any():
            return f"{name} holds {array[(array < 0) | (array >= end)].flat[0]:g}, out of range"
    return ""


def fault_of_level(layout: MapLayout, level: int, blocks: Level, below: Level | None = None) -> str:
    """The first inconsistency of one level, starting with the array's name; "": none.

    Args:
        below: the level below; None: this is level 0.
    """
    slot, place, rows = (np.asarray(a) for a in (blocks.slot, blocks.place, blocks.rows))
    capacity = len(place)
    if slot.min() < 0 or slot.max() > capacity:
        return f"slot points outside of the {capacity} blocks"
    used = np.flatnonzero((place != 0).any(axis=1))
    own = place[used]
    if ((own < REACH) | (own >= REACH + np.asarray(layout.shape_of(level)))).any():
        return "place lies outside of the box"
    at = tuple(own.T)
    if (slot[at] != used).any() or np.sum(slot < capacity) != len(used):
        return "slot and place are inconsistent"
    if (rows[:, 3] < 0).any():
        return "rows holds a negative weight"
    free = np.ones(capacity, bool)
    free[used] = False
    if (rows[free, 3] > 0).any():
        return "rows holds points in a free slot"
    box, found = (np.asarray(a) for a in boxes_by_place(blocks.index, slot.shape))
    if below is None:
        expected = np.asarray(bounding_boxes(layout, level, jnp.asarray(own), jnp.asarray(rows[used])))
    else:
        expected = np.asarray(hull_below(jax.tree.map(jnp.asarray, below.index), jnp.asarray(own)))
    if ((box[at] == NO_BOX) != (expected == NO_BOX)).any() or np.sum(box != NO_BOX) != np.sum(expected != NO_BOX):
        return "index and rows are inconsistent about which blocks hold points"
    if (np.abs(_sides(box[at]) - _sides(expected)) > ROUNDING).any() or ((box < NO_BOX) | (box >= 1 << 30)).any():
        return "index holds a box that is not the bounding box of the points"
    if (found != np.where(box == NO_BOX, capacity, slot)).any():
        return "index and slot are inconsistent"
    if (np.asarray(blocks.index.hull) != np.asarray(hull_of(jnp.asarray(blocks.index.octets[..., :OCTET])))).any():
        return "index holds a hull that is not the bounding box of its boxes"
    return ""


def _sides(box: np.ndarray) -> np.ndarray:
    """The six sides of packed boxes (block, 6), in parts of a block."""
    return (box[:, None] >> np.arange(0, 30, 5)) & (GRAIN - 1)
