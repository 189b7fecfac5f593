"""What a followed body says at every row of the tick: who is near, how fast they may come, and where nobody of it is."""

import jax
import jax.numpy as jnp

from hrcjax.body import BodyFit, BodyParams
from hrcjax.body.parts_from import head_gap, parts_from, surface_gap
from hrcjax.body.state import sure_track
from hrcjax.geom.segment import FAR
from hrcjax.numerics import safe_norm
from hrcjax.robot import COVER_MARGIN
from hrcjax.sim.govern import Rows
from hrcjax.sim.parts import BodyRows
from hrcjax.typing import Array, Float, Scalar

EXPLAINED = 0.2
"""A surface of people is the body's where it is no farther in front of it than this. The default field takes off 3.5 cm by spread and noise
near the arm and 11 cm beyond its reach, 1 cm by the arm's cover, and some 3 cm by its kernel; points and body are known to 5 cm [m]."""


def body_rows(
    params: BodyParams, fit: BodyFit, x: Float[Array, "point 3"], people: Rows, age: Scalar, horizon: Scalar
) -> BodyRows:  # fmt: skip
    """The body from every control point and surface near it.

    A row counts where the track is sure, the row's surface, as the field reads it, lies on the body, and no point of the image that is
    not of the body is so near that the surface could be its: of points that no part explains nothing else is known. What is within
    `BodyParams.strange` of the body counts as of it.

    Args:
        fit: the body in the image in use.
        x: control points [m].
        people: the rows towards people.
        age: of the image; infinite: there is none [s].
        horizon: time in which the arm has surely stopped from full speed, the reaction time included [s].
    """
    surfaces = people.g.shape[1]
    reach = people.reach.reshape(-1, surfaces)
    radius = (people.reach - people.distance).reshape(-1, surfaces)[:, 0] + COVER_MARGIN

    def at(
        x: Float[Array, "3"], g: Float[Array, "surface 3"], reach: Float[Array, "surface"]
    ) -> tuple[Array, Array, Array, Array]:
        parts = parts_from(params, fit, x, horizon)
        beyond = jnp.maximum(parts.distance - reach[:, None] - EXPLAINED, 0.0)
        gaps = jax.vmap(lambda p: surface_gap(fit, p))(x - reach[:, None] * g)
        others = jnp.min(safe_norm(x - fit.strange))
        on = (gaps < EXPLAINED) & (others > reach + EXPLAINED) & (jnp.sum(g * g, axis=1) > 0.25)
        nearest = jnp.full_like(reach, FAR).at[0].set(jnp.min(parts.distance))
        return on, jnp.broadcast_to(parts.v_h, beyond.shape), beyond, nearest

    on, v_h, beyond, nearest = jax.vmap(at)(x, people.g, reach)
    sure = sure_track(params, fit)
    far = jnp.asarray(FAR, reach.dtype)
    seconds = jnp.where(jnp.isfinite(age), age, 0.0)
    head, away = head_gap(params, fit, x, seconds)
    rows = people.distance.shape
    return BodyRows(
        counts=(sure & on).reshape(-1),
        v_h=jnp.where(sure, v_h, 0.0).reshape(*rows, -1),
        beyond=jnp.where(sure, beyond, 0.0).reshape(*rows, -1),
        distance=jnp.where(sure, nearest - radius[:, None], far).reshape(-1),
        head_distance=jnp.where(sure, head - radius, far),
        head_gradient=jnp.where(sure, away, 0.0),
        gain=params.human_acceleration,
    )
