"""A score of a run that holds what it says, out of 100: beside the Robotica paper's, in which more power scores higher.

Every term is out of 100, higher is better, and grows with what it is named after alone. The weighted mean of the terms is
the quality of a run. A run that arrives without contact scores between `least` and 100, any other below `failed` < `least`:
no quality makes up for a failure. Between, the score is smooth almost everywhere.
"""

import math

import equinox as eqx
import jax.numpy as jnp

from hrcjax.metrics.samples import masked_mean
from hrcjax.numerics import safe_divide
from hrcjax.typing import Array, Bool, Float, Scalar

MINIMUM_JERK = math.log(720 / 1.875**2)
"""ln of the dimensionless jerk of a minimum-jerk reach, 720 / 1.875^2 (Hogan and Sternad 2009) [1]."""


class SoundScoreParams(eqx.Module):
    """Weights of the terms, which count relative to their sum, and what the terms are measured by."""

    clearance: float = 0.25
    """Weight of the clearance to obstacles [1]."""
    separation: float = 0.25
    """Weight of the separation from the person [1]."""
    time: float = 0.2
    """Weight of the time [1]."""
    jerk: float = 0.15
    """Weight of the smoothness [1]."""
    energy: float = 0.15
    """Weight of the energy [1]."""
    least: float = 20.0
    """Score of a successful run without any quality [1]."""
    failed: float = 10.0
    """Score that failed runs stay below; less than `least` [1]."""
    full_clearance: float = 0.05
    """Clearance from which on more does not count [m]."""
    half_energy: float = 30.0
    """Energy at which the term is 50 [J]."""
    jerk_scale: float = 10.0
    """Excess of ln of the dimensionless jerk over that of a minimum-jerk reach at which the term has fallen to 1/e [1]."""


class SoundTerms(eqx.Module):
    """The terms of the score, each out of 100."""

    clearance: Float[Array, ""]
    """[1]."""
    separation: Float[Array, ""]
    """[1]."""
    time: Float[Array, ""]
    """[1]."""
    jerk: Float[Array, ""]
    """[1]."""
    energy: Float[Array, ""]
    """[1]."""


def sound_clearance(clearance: Scalar, full: Scalar) -> Float[Array, ""]:
    """0 at contact, 100 from `full` on; the first millimetres count most: 100 u (2 - u), u = clearance / full.

    Args:
        clearance: smallest true distance of the arm to an obstacle; far or infinite where there is none [m].
        full: where it saturates [m].
    """
    u = jnp.clip(clearance / full, 0.0, 1.0)
    return 100 * u * (2 - u)


def sound_separation(
    separation: Float[Array, "time"],
    protective_distance: Float[Array, "time"] | Scalar,
    mask: Bool[Array, "time"] | None = None,
) -> Float[Array, ""]:
    """100 where the person is never nearer than the protective separation distance, 0 where in contact all the time.

    100 (1 - mean over time of u (2 - u)), u = the missing share of S_p: it falls with the time below S_p and with the depth.

    Args:
        separation: true distance to the person; far or infinite where nobody is [m].
        protective_distance: S_p at the speed of the arm [m].
        mask: samples that count.
    """
    u = jnp.clip(1 - separation / protective_distance, 0.0, 1.0)
    return 100 * (1 - masked_mean(u * (2 - u), mask))


def sound_time(ideal: Scalar, time: Scalar) -> Float[Array, ""]:
    """100 ideal / time, at most 100; 100 where the time is 0.

    Args:
        ideal: time of the straight way from start to goal without person and zones [s].
        time: [s].
    """
    time = jnp.asarray(time)
    return 100 * jnp.minimum(safe_divide(jnp.full_like(time, ideal), time, 1.0), 1.0)


def sound_jerk(log_dimensionless_jerk: Scalar, scale: Scalar) -> Float[Array, ""]:
    """100 for a minimum-jerk reach or smoother; 1/e of it where ln of the dimensionless jerk is larger by `scale` [1].

    Args:
        log_dimensionless_jerk: -ln, as `hrcjax.metrics.log_dimensionless_jerk` [1].
        scale: [1].
    """
    return 100 * jnp.exp(-jnp.maximum(-log_dimensionless_jerk - MINIMUM_JERK, 0.0) / scale)


def sound_energy(energy: Scalar, half: Scalar) -> Float[Array, ""]:
    """100 half / (half + energy): 100 for no work at all, which a slow level motion comes near, 50 at `half`.

    Args:
        energy: mechanical work of the joints, braking counted as driving [J].
        half: [J].
    """
    return jnp.asarray(100 * half / (half + energy))


def sound_quality(params: SoundScoreParams, terms: SoundTerms) -> Float[Array, ""]:
    """The weighted mean of the terms, in [0, 1]. Not finite if: all weights are 0."""
    names = ("clearance", "separation", "time", "jerk", "energy")
    weights = {name: getattr(params, name) for name in names}
    return jnp.asarray(sum(weights[name] * getattr(terms, name) for name in names) / sum(weights.values()) / 100)


def sound_score(params: SoundScoreParams, success: Bool[Array, ""], terms: SoundTerms) -> Float[Array, ""]:
    """The score, out of 100. Not finite if: all weights are 0.

    Args:
        success: arrived, and no contact with an obstacle, nor with a person.
        terms: each out of 100.
    """
    quality = sound_quality(params, terms)
    return jnp.where(success, params.least + (100 - params.least) * quality, params.failed * quality)
