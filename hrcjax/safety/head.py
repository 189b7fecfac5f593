"""Near the head: every point of the arm that is too near it by itself, and from where."""

import jax
import jax.numpy as jnp

from hrcjax.safety.params import SafetyParams
from hrcjax.safety.ssm import allowed_speed, separation_distance
from hrcjax.safety.zones import BEYOND_STOP, STOP, retreat_share
from hrcjax.typing import Array, Float, Int

MARGIN = 0.5
"""Share of the hysteresis by which the arm stops before the distance of a stop [1]."""


def head_limit(params: SafetyParams, zone: Int[Array, ""], d: Float[Array, "point"]) -> Float[Array, "point"]:
    """Largest speed of every point towards the head; negative: it is asked to retreat as fast [m/s].

    The arm can stop `MARGIN` of the hysteresis before `zone.head_stop` beside a head that stands still, after the reaction time and with
    `ssm.brake`: then only a head that comes nearer stops it, and not the noise of its place. In a stop it can stop before where that is
    left, no point nearer than this approaches, and the nearest ones retreat, so that the stop can end, as `retreat_share`.

    Args:
        zone: of this tick.
        d: distance of every point's surface to the head; far: not watched [m].
    """
    more = params.zone.head_hysteresis
    left = params.zone.head_stop + more
    stopped = zone == STOP
    ends = jnp.where(stopped, left, params.zone.head_stop + MARGIN * more)
    beside = d - ends + separation_distance(params.ssm, 0.0, 0.0)
    free = jax.vmap(lambda one: allowed_speed(params.ssm, one, 0.0))(beside)
    share = retreat_share(params, zone, d, left + BEYOND_STOP)
    limit = (1.0 - share) * free - share * params.zone.retreat_speed
    return jnp.where(stopped & (d < left), jnp.minimum(limit, 0.0), limit)
