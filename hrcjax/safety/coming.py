"""How a person may come who is measured: every part of the body by its own way and speed, instead of one assumed speed.

A part that is e farther than a control point's distance d, and comes at up to v_h, takes in S_p (ISO/TS 15066, 5.5.4) with it:

    S_p(v_r) - e,   S_p as in `hrcjax.safety.ssm` with this v_h, and a_h T_s^2 / 2 more,

as speeds that are measured may grow by a_h while the arm stops. The greatest of these over all parts is what d needs. It never
needs more than by the assumed speed, which is a bound as well.
"""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.numerics import safe_sqrt
from hrcjax.safety.params import SafetyParams, SsmParams
from hrcjax.safety.ssm import separation_distance, stopping_time
from hrcjax.safety.zones import ZoneThresholds, zone_thresholds
from hrcjax.typing import Array, Bool, Float, Scalar


class Coming(eqx.Module):
    """Bounds of how the parts of a measured person come to every control point."""

    v_h: Float[Array, "row part"]
    """Largest speed towards the point within the reaction time; a retreat counts as 0 [m/s]."""
    beyond: Float[Array, "row part"]
    """How much farther the part is than the row's distance, not negative [m]."""
    gain: Scalar
    """a_h, gain of speed that is counted on while the arm stops [m/s^2]."""
    counts: Bool[Array, "row"]
    """Where this is known; elsewhere the assumed speed holds."""


def _finite(coming: Coming) -> tuple[Float[Array, "row part"], Float[Array, "row part"]]:
    """Speeds and ways, 0 where they do not count."""
    counts = coming.counts[:, None]
    return jnp.where(counts, jnp.maximum(coming.v_h, 0.0), 0.0), jnp.where(counts, coming.beyond, 0.0)


def measured_distance(ssm: SsmParams, v_r: Scalar, coming: Coming) -> Float[Array, "row"]:
    """Distance of every row from which on the approach speed v_r [m/s] is safe; infinite where nothing is measured [m]."""
    stopping = stopping_time(ssm, v_r)
    grown = 0.5 * jnp.asarray(coming.gain) * stopping * stopping

    def needed(v_h: Float[Array, ""], beyond: Float[Array, ""]) -> Float[Array, ""]:
        return separation_distance(ssm, v_r, v_h) + grown - beyond

    each = jax.vmap(jax.vmap(needed))(*_finite(coming))
    return jnp.where(coming.counts, jnp.max(each, axis=1), jnp.inf)


def measured_limit(ssm: SsmParams, d: Float[Array, "row"], coming: Coming) -> Float[Array, "row"]:
    """Largest approach speed of every row, the inverse of `measured_distance`; 0 where nothing is measured [m/s].

    With b = v_h + a T_r, e = d + beyond - S_p(0) and k = 1 + a_h / a it is k v^2 + 2 b v = 2 a e, for each part.
    """
    k = 1.0 + jnp.asarray(coming.gain) / ssm.brake

    def allowed(d: Float[Array, ""], v_h: Float[Array, ""], beyond: Float[Array, ""]) -> Float[Array, ""]:
        excess = d + beyond - separation_distance(ssm, 0.0, v_h)
        possible = excess > 0
        two_a_e = 2 * ssm.brake * jnp.where(possible, excess, 1.0)
        b = v_h + ssm.brake * ssm.reaction_time
        return jnp.where(possible, two_a_e / (b + safe_sqrt(b * b + k * two_a_e)), 0.0)

    each = jax.vmap(jax.vmap(allowed, (None, 0, 0)))(d, *_finite(coming))
    return jnp.where(coming.counts, jnp.min(each, axis=1), 0.0)


def row_thresholds(params: SafetyParams, coming: Coming) -> ZoneThresholds:
    """Where zones begin for every row: by what is measured, not beyond what the assumed speed needs [m]."""
    assumed = zone_thresholds(params)

    def of(speed: Scalar, most: Float[Array, ""]) -> Float[Array, "row"]:
        return jnp.minimum(measured_distance(params.ssm, speed, coming), most)

    return ZoneThresholds(
        stop=of(0.0, assumed.stop),
        yellow=of(params.zone.red_speed, assumed.yellow),
        green=of(params.zone.nominal_speed, assumed.green),
    )


def leaving_thresholds(params: SafetyParams, coming: Coming, rows: ZoneThresholds) -> ZoneThresholds:
    """Where zones may be relaxed again, for every row: `zone.hysteresis` beyond an assumed speed's, `zone.measured_hysteresis` beyond what is
    measured, where that is less [m].

    Args:
        rows: `row_thresholds`.
    """
    assumed = zone_thresholds(params)

    def beyond(of: Float[Array, "row"], most: Float[Array, ""]) -> Float[Array, "row"]:
        measured = coming.counts & (of < most)
        return of + jnp.where(measured, params.zone.measured_hysteresis, params.zone.hysteresis)

    return ZoneThresholds(
        beyond(rows.stop, assumed.stop), beyond(rows.yellow, assumed.yellow), beyond(rows.green, assumed.green)
    )


def at_the_nearest(d: Float[Array, "row"], rows: ZoneThresholds) -> ZoneThresholds:
    """Thresholds which the least distance is within exactly where some row is within its own [m].

    Args:
        d: distance of every row [m].
        rows: thresholds of every row.
    """
    nearest = jnp.min(d)
    return ZoneThresholds(*(nearest - jnp.min(d - of) for of in (rows.stop, rows.yellow, rows.green)))
