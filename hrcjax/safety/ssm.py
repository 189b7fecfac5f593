"""Speed and separation monitoring: how far a person must be for a speed, and how fast a distance allows.

ISO/TS 15066, 5.5.4 (since 2025 ISO 10218-2, annex L), as quoted in open literature:

    S_p = v_h (T_r + T_s) + v_r T_r + S_s + C + Z_d + Z_r

v_r is the robot's speed TOWARDS the person and the distance is between the surfaces of the whole robot and the person.
Research software, not safety-rated.
"""

import jax.numpy as jnp

from hrcjax.numerics import safe_sqrt
from hrcjax.safety.params import SsmParams
from hrcjax.typing import Array, Float, Scalar


def stopping_time(params: SsmParams, v_r: Scalar) -> Float[Array, ""]:
    """T_s: time to stop from the approach speed v_r [m/s] at the deceleration `brake` [s]. 0 for a retreat."""
    return jnp.maximum(v_r, 0.0) / params.brake


def stopping_distance(params: SsmParams, v_r: Scalar) -> Float[Array, ""]:
    """S_s = v_r^2 / (2 a): way to a stop from the approach speed v_r [m/s] [m]. 0 for a retreat."""
    return jnp.maximum(v_r, 0.0) * stopping_time(params, v_r) / 2


def protective_distance(
    v_r: Scalar, v_h: Scalar, T_r: Scalar, T_s: Scalar, S_s: Scalar, C: Scalar, Z_d: Scalar, Z_r: Scalar
) -> Float[Array, ""]:
    """The standard's sum with every term given, for robots whose stopping time is tabled [m].

    Args:
        v_r: robot's speed towards the person [m/s].
        v_h: person's speed towards the robot [m/s].
        T_r: reaction time [s].
        T_s: stopping time [s].
        S_s: stopping distance [m].
        C: intrusion distance [m].
        Z_d: uncertainty of the person's position [m].
        Z_r: uncertainty of the robot's position [m].
    """
    return jnp.asarray(v_h * (T_r + T_s) + v_r * T_r + S_s + C + Z_d + Z_r)  # TS 15066, 5.5.4


def separation_distance(params: SsmParams, v_r: Scalar, v_h: Scalar | None = None) -> Float[Array, ""]:
    """S_p: distance to the person that the approach speed v_r needs [m].

    Args:
        v_r: robot's speed towards the person; a retreat counts as 0 [m/s].
        v_h: person's speed towards the robot; a retreat counts as 0; None: `params.v_h` [m/s].
    """
    towards = jnp.maximum(params.v_h if v_h is None else v_h, 0.0)
    return protective_distance(
        jnp.maximum(v_r, 0.0), towards, params.reaction_time, stopping_time(params, v_r),
        stopping_distance(params, v_r), params.intrusion, params.Z_d, params.Z_r,
    )  # fmt: skip


def allowed_speed(params: SsmParams, d: Scalar, v_h: Scalar | None = None) -> Float[Array, ""]:
    """v(d): the largest approach speed at distance d, the inverse of S_p [m/s].

    v = -b + sqrt(b^2 + 2 a e), b = v_h + a T_r, e = d - S_p(0); computed as 2 a e / (b + sqrt(b^2 + 2 a e)), which does
    not cancel. 0 with derivative 0 where e <= 0, and where d or v_h is not a finite number: missing data stop.

    Args:
        d: distance between the surfaces of robot and person [m].
        v_h: person's speed towards the robot; a retreat counts as 0; None: `params.v_h` [m/s].
    """
    given = jnp.asarray(params.v_h if v_h is None else v_h)
    d = jnp.asarray(d)
    known = jnp.isfinite(d) & jnp.isfinite(given)
    towards = jnp.maximum(jnp.where(known, given, 0.0), 0.0)
    excess = jnp.where(known, d, 0.0) - separation_distance(params, 0.0, towards)
    possible = known & (excess > 0)
    b = towards + params.brake * params.reaction_time
    two_a_e = 2 * params.brake * jnp.where(possible, excess, 1.0)
    return jnp.where(possible, two_a_e / (b + safe_sqrt(b * b + two_a_e)), 0.0)


def safe_distance(params: SsmParams, v_r: Scalar) -> Float[Array, ""]:
    """Distance from which on the approach speed v_r [m/s] is safe beside a person whose speed is not measured [m].

    S_p for the person's speed that is to be assumed at that very distance; it jumps where that speed does.
    """
    close = separation_distance(params, v_r, params.v_h_near)
    far = separation_distance(params, v_r, params.v_h)
    return jnp.where((close < params.near) & (far <= params.near), close, jnp.maximum(far, params.near))


def assumed_human_speed(params: SsmParams, d: Scalar) -> Float[Array, ""]:
    """Speed of a person to count on at distance d where it is not measured (ISO 13855) [m/s]."""
    return jnp.where(jnp.asarray(d) < params.near, params.v_h_near, params.v_h)
