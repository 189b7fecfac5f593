"""Near the head: every point of the arm that is too near it by itself, and from where."""

import jax
import jax.numpy as jnp

from hrcjax.safety.params import SafetyParams
from hrcjax.safety.ssm import allowed_speed, separation_distance
from hrcjax.safety.zones import BEYOND_STOP, STOP, retreat_share
from hrcjax.typing import Array, Float, Int


def head_limit(params: SafetyParams, zone: Int[Array, ""], d: Float[Array, "point"]) -> Float[Array, "point"]:
    """Largest speed of every point towards the head; negative: it is asked to retreat as fast [m/s].

    The arm can stop before `zone.head_stop` beside a head that stands still, after the reaction time and with `ssm.brake`: then only a
    head that comes nearer stops it. In a stop no point nearer than where it is left approaches, and the nearest ones retreat, so that
    the stop can end, as `retreat_share`.

    Args:
        zone: of this tick.
        d: distance of every point's surface to the head; far: not watched [m].
    """
    stop = params.zone.head_stop
    beside = d - stop + separation_distance(params.ssm, 0.0, 0.0)
    free = jax.vmap(lambda one: allowed_speed(params.ssm, one, 0.0))(beside)
    left = stop + params.zone.measured_hysteresis
    share = retreat_share(params, zone, d, left + BEYOND_STOP)
    limit = (1.0 - share) * free - share * params.zone.retreat_speed
    near = (zone == STOP) & (d < left)
    return jnp.where(near, jnp.minimum(limit, 0.0), limit)
