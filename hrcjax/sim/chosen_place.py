"""A place that somebody points at, as a place for the tool; or why it can be none."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.bits import pack, words
from hrcjax.hand.pointing import Pointed, spread
from hrcjax.numerics import safe_divide, safe_norm
from hrcjax.sim.cell import Cell
from hrcjax.sim.prepare import posture_at
from hrcjax.typing import Array, DistanceFn, Int, Joints, Vector3

NOTHING = 1
UNSURE = 2
NO_ROOM = 4
OUT_OF_REACH = 8
PLACE_REASONS = {
    NOTHING: "no surface where the line points",
    UNSURE: "place not known well enough",
    NO_ROOM: "no room for the tool beside an obstacle",
    OUT_OF_REACH: "out of the arm's reach",
}
"""Why a place is refused: bit -> words."""
SAMPLES = 8
"""Places along each way at which there must be room."""


class PlaceParams(eqx.Module):
    """Where the tool goes for a place on a surface, and which places are refused. All are our choice."""

    above: float = 0.06
    """Distance of the tool point from the surface, along its normal [m]."""
    radius: float = 0.03
    """Of the tool, and of a ball about the tool point [m]."""
    room: float = 0.01
    """Free space about it [m]."""
    approach: float = 0.1
    """Length of the way along the normal on which there must be room: the tool comes by it [m]."""
    tool: float = 0.12
    """Length of the tool over the tool point, which points down [m]."""
    unsure: float = 0.05
    """Standard deviation along the worst direction from which on a place is refused [m]."""


class ToolPlace(NamedTuple):
    """A place for the tool."""

    x: Vector3
    """Of the tool point [m]."""
    normal: Vector3
    """Of the surface there, away from it [1]."""
    reasons: Int[Array, ""]
    """Why it is refused: bits of `PLACE_REASONS`; 0: it is not."""


class ChosenPlace(NamedTuple):
    """A place for the tool that the arm has been asked about."""

    x: Vector3
    """Of the tool point [m]."""
    q: Joints | None
    """Joint positions there, tool down [rad]; None: refused."""
    reasons: int
    """Why it is refused: bits of `PLACE_REASONS`; 0: it is not. In words: `describe_place`."""


def tool_place(params: PlaceParams, pointed: Pointed, distance: DistanceFn) -> ToolPlace:
    """The place for the tool `above` a place on a surface, along its normal; refused without a surface, where it is known badly, or
    where the tool has no room: a ball about it on its last way along the normal, and the tool itself, pointing down.

    A direction that is no number leaves no room.

    Args:
        distance: to everything that stands [m]; its gradient at a surface is the normal.
    """
    place = pointed.place
    gradient = jax.grad(distance)(place)
    normal = safe_divide(gradient, safe_norm(gradient))
    x = place + params.above * normal
    up = jnp.asarray([0.0, 0.0, 1.0], x.dtype)
    share = jnp.linspace(0.0, 1.0, SAMPLES, dtype=x.dtype)[:, None]
    ways = jnp.concatenate([x + params.approach * share * normal, x + params.tool * share * up])
    least = jnp.min(jax.vmap(distance)(ways))
    fits = (least >= params.radius + params.room) & (safe_norm(normal) > 0.5)
    sure = spread(pointed.covariance) <= params.unsure
    reasons = {NOTHING: ~pointed.found, UNSURE: pointed.found & ~sure, NO_ROOM: pointed.found & ~fits}
    return ToolPlace(x, normal, pack(reasons))


def chosen_place(params: PlaceParams, cell: Cell, pointed: Pointed, distance: DistanceFn) -> ChosenPlace:
    """`tool_place`, and whether the arm reaches it with the tool down. Needs concrete values: call it outside jit."""
    return reached_place(cell, tool_place(params, pointed, distance))


def reached_place(cell: Cell, place: ToolPlace) -> ChosenPlace:
    """A place for the tool, refused as well if the arm does not reach it. Needs concrete values: call it outside jit."""
    reasons = int(place.reasons)
    if reasons & NOTHING or not np.isfinite(np.asarray(place.x)).all():
        return ChosenPlace(place.x, None, reasons | NOTHING)
    try:
        q = posture_at(cell, place.x)
    except ValueError:
        return ChosenPlace(place.x, None, reasons | OUT_OF_REACH)
    return ChosenPlace(place.x, None if reasons else q, reasons)


def describe_place(reasons: int | Int[Array, ""]) -> str:
    """Why a place is refused, in words; "none" if it is not."""
    return words(PLACE_REASONS, int(reasons))
