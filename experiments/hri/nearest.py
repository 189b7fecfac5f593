"""The nearest point in place of the Gaussian process: what many reactive systems read. All else is as in our field."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp

from hrcjax.field import FAR, FieldParams
from hrcjax.field.grid import grid_distance_and_gradient
from hrcjax.numerics import safe_norm, unit
from hrcjax.sim.default_parts import GP_FIELD, fit_fields, margin_of, read_fields
from hrcjax.sim.parts import FieldPart, Fields, Reading
from hrcjax.typing import Array, Float, Vector3


def nearest_point(people: Any, x: Vector3) -> tuple[Float[Array, ""], Vector3]:
    """Distance to the nearest of the moving points, and the way from it; FAR and no way where there are none [m]."""
    field = people.field
    offsets = x - field.points
    squared = jnp.where(field.mask, jnp.sum(offsets * offsets, axis=1), jnp.inf)
    offset = offsets[jnp.argmin(squared)]
    some = jnp.any(field.mask)
    return jnp.where(some, safe_norm(offset), FAR), jnp.where(some, offset, 0.0)


def read_nearest(params: FieldParams, fields: Fields, x: Vector3) -> Reading:
    """The readings of `read_fields`, but the distance to everything and the nearest surface of people are those of the nearest
    point: its distance has kinks where another becomes the nearest, and its direction jumps there."""
    ours = read_fields(params, fields, x)
    d, offset = nearest_point(fields.moving, x)
    scene, slope = grid_distance_and_gradient(fields.static.scene, x)
    people = d < scene
    least = jnp.where(d < FAR, d - margin_of(params, x, offset), FAR)
    # whoever has no point, and unseen space, count as in our field
    by_point = least <= fields.moving.beyond - safe_norm(x)
    nearest = jnp.where(by_point, least, ours.person_distance[0])
    away = jnp.where(by_point, unit(offset), ours.person_gradient[0])
    return eqx.tree_at(
        lambda r: (r.distance, r.gradient, r.person_distance, r.person_gradient),
        ours,
        (
            jnp.where(people, d, scene), jnp.where(people, unit(offset), slope),
            ours.person_distance.at[0].set(nearest), ours.person_gradient.at[0].set(away),
        ),
    )  # fmt: skip


NEAREST_FIELD = FieldPart(fit_fields, read_nearest, GP_FIELD.unit_gradients)
"""The field part of the nearest point."""
