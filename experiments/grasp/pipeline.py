"""From an object's points to grasps, with the normals of each of the three ways."""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp

from hrcjax.field import GPField, distance, fit_exact
from hrcjax.grasp.candidates import Grasps, grasp_candidates
from hrcjax.grasp.contacts import Contacts, by_hessian, by_nearest, by_plane, contacts
from hrcjax.grasp.gripper import Gripper
from hrcjax.grasp.params import GraspParams
from hrcjax.grasp.reach import Reach, reach
from hrcjax.grasp.seen_points import SeenPoints
from hrcjax.robot import Arm

from .perceive import SPACING

WAYS = ("hessian", "pca", "nearest")
"""Normals by the Hessian of the field, by a plane through neighbours, by the nearest point."""
OFF_SURFACE = 3 * SPACING
"""Where the nearest point is asked for, off the surface: least errors among 1 to 6 spacings, nearer the points are told apart, farther
edges are rounded [m]."""


class Planned(NamedTuple):
    """What one way finds on one object."""

    contacts: Contacts
    grasps: Grasps


@partial(jax.jit, static_argnums=(1,))
def plan(seen: SeenPoints, gripper: Gripper, params: GraspParams) -> dict[str, Planned]:
    """Grasps of all ways. They differ in their normals and planarity alone: pairs, score and free space are the same."""
    field, _ = fit_exact(seen.cloud, params.field)
    some = seen.cloud.mask[:, None]
    low = jnp.min(jnp.where(some, seen.cloud.points, jnp.inf), axis=0)
    high = jnp.max(jnp.where(some, seen.cloud.points, -jnp.inf), axis=0)

    def clearance(x: jax.Array) -> jax.Array:
        return jnp.minimum(distance(field, x), x[2])  # the table is z = 0

    normals = {
        "hessian": by_hessian(field, params.least_planarity),
        "pca": by_plane(seen.cloud, params.least_planarity),
        "nearest": by_nearest(seen.cloud, OFF_SURFACE),
    }
    found = {way: contacts(seen, normal) for way, normal in normals.items()}
    grasps = jax.lax.map(
        lambda one: grasp_candidates(one, 0.5 * (low + high), clearance, gripper, params),
        jax.tree.map(lambda *a: jnp.stack(a), *[found[way] for way in WAYS]),
    )
    return {way: Planned(found[way], jax.tree.map(lambda a, k=k: a[k], grasps)) for k, way in enumerate(WAYS)}


@jax.jit
def object_field(seen: SeenPoints, params: GraspParams) -> GPField:
    """The field of an object's points."""
    return fit_exact(seen.cloud, params.field)[0]


@partial(jax.jit, static_argnums=(0,))
def reached(arm: Arm, grasps: Grasps, approach: float) -> Reach:
    """Joints for grasps."""
    return jax.vmap(lambda R, p: reach(arm, R, p, approach))(grasps.R, grasps.p)
