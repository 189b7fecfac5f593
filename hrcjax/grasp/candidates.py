"""Candidates of a parallel gripper on an object: pairs of contacts, approaches, free of collision, best first."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.grasp.antipodal import antipodal
from hrcjax.grasp.approach import TURNS, body_clearance, gripper_axes
from hrcjax.grasp.contacts import Contacts
from hrcjax.grasp.gripper import Gripper
from hrcjax.grasp.params import GraspParams
from hrcjax.numerics import safe_norm, unit
from hrcjax.typing import Array, Bool, DistanceFn, Float, Int, Vector3


class Grasps(eqx.Module):
    """Grasps of fixed capacity, best first; or one, without the leading axis."""

    R: Float[Array, "*grasp 3 3"]
    """Axes of the gripper in the world: y the closing axis, z the approach."""
    p: Float[Array, "*grasp 3"]
    """Tool point: the middle between the contacts [m]."""
    width: Float[Array, "*grasp"]
    """Between the contacts [m]."""
    opening: Float[Array, "*grasp"]
    """Between the pads on the approach [m]."""
    score: Float[Array, "*grasp"]
    """The higher the better; minus infinity under no mask [1]."""
    clearance: Float[Array, "*grasp"]
    """Least distance of the gripper's body from object and table [m]."""
    contact: Int[Array, "*grasp 2"]
    """Which contacts the pads touch."""
    mask: Bool[Array, "*grasp"]
    """True where there is a grasp."""


class Pairs(eqx.Module):
    """The best partner of each of the best contacts."""

    contact: Int[Array, "pair 2"]
    """Which contacts."""
    score: Float[Array, "pair"]
    """Without the approach; minus infinity: none [1]."""


def best_pairs(found: Contacts, centre: Vector3, gripper: Gripper, params: GraspParams, most: int) -> Pairs:
    """Of every contact the partner with which it scores most; of these the best, spread over the object as they are.

    Args:
        centre: of the object [m].
        most: capacity.
    """

    def score(i: Array, j: Array) -> Float[Array, ""]:
        a, b = found.points[i], found.points[j]
        pair = antipodal(a, found.normals[i], b, found.normals[j], gripper, params)
        flat = jnp.minimum(found.planarity[i], found.planarity[j])
        flat = jnp.clip((flat - params.least_planarity) / (1 - params.least_planarity), 0, 1)
        near = 1 - safe_norm(0.5 * (a + b) - centre) / params.arm_length
        value = params.weight_cone * pair.cone + params.weight_planarity * flat + params.weight_centre * near
        return jnp.where(pair.ok & found.mask[i] & found.mask[j] & (i != j), value, -jnp.inf)

    index = jnp.arange(found.mask.shape[0], dtype=jnp.int32)

    def of(i: Array) -> tuple[Array, Array]:
        row = jax.vmap(score, in_axes=(None, 0))(i, index)
        best = jnp.argmax(row).astype(jnp.int32)
        return row[best], best

    value, partner = jax.vmap(of)(index)
    twice = (partner[partner] == index) & (partner < index)  # two that chose each other are one pair
    value = jnp.where(twice, -jnp.inf, value)
    top, first = jax.lax.top_k(value, min(most, index.shape[0]))
    return Pairs(jnp.stack([first.astype(jnp.int32), partner[first]], axis=1), top)


def grasp_candidates(
    found: Contacts,
    centre: Vector3,
    clearance: DistanceFn,
    gripper: Gripper,
    params: GraspParams,
    up: Vector3 | None = None,
    pairs: int = 96,
    most: int = 64,
) -> Grasps:
    """The best grasps: antipodal contacts of planar surfaces within the stroke, with an approach that is free.

    Args:
        found: contacts on the object.
        centre: of the object [m].
        clearance: point -> distance to object and table, which the gripper's body must keep.
        up: against gravity; None: z [1].
        pairs: of contacts whose approaches are tried.
        most: capacity.
    """
    dtype = found.points.dtype
    upward = jnp.asarray([0.0, 0.0, 1.0], dtype) if up is None else up
    chosen = best_pairs(found, centre, gripper, params, pairs)
    turns = jnp.asarray(TURNS, dtype)

    def one(item: tuple[Array, Array]) -> Grasps:
        """The best approach to one pair."""
        contact, score = item
        a, b = found.points[contact[0]], found.points[contact[1]]
        width = safe_norm(b - a)
        p, axis = 0.5 * (a + b), unit(b - a)
        opening = jnp.minimum(gripper.stroke, width + 2 * params.clearance)

        def along(turn: Array) -> tuple[Array, Array, Array]:
            R = gripper_axes(axis, turn, upward)
            room = body_clearance(gripper, R, p, opening, params.approach, clearance)
            down = -jnp.sum(R[:, 2] * upward)
            free = (room >= params.margin) & (down >= params.least_down)
            return R, room, jnp.where(free, score + params.weight_down * down, -jnp.inf)

        def none(turns: Array) -> tuple[Array, Array, Array]:
            nothing = jnp.full_like(turns, -jnp.inf)
            return jax.vmap(lambda turn: gripper_axes(axis, turn, upward))(turns), nothing, nothing

        R, room, value = jax.lax.cond(jnp.isfinite(score), jax.vmap(along), none, turns)
        best = jnp.argmax(value)
        return Grasps(R[best], p, width, opening, value[best], room[best], contact, jnp.isfinite(value[best]))

    tried = jax.lax.map(one, (chosen.contact, chosen.score))  # one by one: their distances stay in the cache
    _, order = jax.lax.top_k(tried.score, min(most, tried.score.shape[0]))
    return jax.tree.map(lambda leaf: leaf[order], tried)
