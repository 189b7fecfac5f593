"""Smoothness of a sampled motion: the forms of the HRI paper, in metres per sample, and forms in SI units.

The HRI paper's figures (variance of acceleration, total jerk, mean squared jerk) are plain differences of tool
positions per sample, so they depend on the sampling rate; resample both runs to one rate before comparing. The mask
marks the samples that count (for example before the goal was reached); a difference counts where all its samples do.

In float32 third differences of positions at 125 Hz carry rounding noise of about 0.3 m/s^3: resample to 50 Hz or less.
"""

import jax.numpy as jnp

from hrcjax.metrics.samples import difference_mask, differences, masked_max, masked_mean
from hrcjax.numerics import safe_divide, safe_norm, safe_sqrt
from hrcjax.typing import Array, Bool, Float, Scalar


def acceleration_variance(x: Float[Array, "time 3"], mask: Bool[Array, "time"] | None = None) -> Float[Array, "3"]:
    """Variance of the second difference along every axis, the HRI paper's form [m^2/sample^4]."""
    a = differences(x, 2)
    counts = difference_mask(mask, 2)
    means = jnp.stack([masked_mean(a[:, i], counts) for i in range(3)])
    return jnp.stack([masked_mean((a[:, i] - means[i]) ** 2, counts) for i in range(3)])


def total_jerk(x: Float[Array, "time 3"], mask: Bool[Array, "time"] | None = None) -> Float[Array, ""]:
    """Sum of the lengths of the third differences, the HRI paper's form [m/sample^3]."""
    jerk = safe_norm(differences(x, 3))
    counts = difference_mask(mask, 3)
    return jnp.sum(jerk if counts is None else jnp.where(counts, jerk, 0))


def mean_squared_difference_jerk(
    x: Float[Array, "time 3"], mask: Bool[Array, "time"] | None = None
) -> Float[Array, ""]:
    """Mean over time and axes of the squared third difference, the HRI paper's mean squared jerk [m^2/sample^6]."""
    return masked_mean(jnp.mean(differences(x, 3) ** 2, axis=-1), difference_mask(mask, 3))


def mean_squared_jerk(
    x: Float[Array, "time 3"], rate: Scalar, mask: Bool[Array, "time"] | None = None
) -> Float[Array, ""]:
    """Mean over time of |jerk|^2, summed over the axes [m^2/s^6].

    Args:
        x: positions [m].
        rate: samples per second [1/s].
        mask: samples that count.
    """
    jerk = differences(x, 3) * rate**3
    return masked_mean(jnp.sum(jerk * jerk, axis=-1), difference_mask(mask, 3))


def jerk_rms(x: Float[Array, "time 3"], rate: Scalar, mask: Bool[Array, "time"] | None = None) -> Float[Array, ""]:
    """Root of the mean squared jerk [m/s^3]; arguments as there."""
    return safe_sqrt(mean_squared_jerk(x, rate, mask))


def dimensionless_jerk(
    x: Float[Array, "time 3"], rate: Scalar, mask: Bool[Array, "time"] | None = None
) -> Float[Array, ""]:
    """Integral of |jerk|^2 dt times D^3 / v_peak^2, positive [1] (Hogan and Sternad 2009; Balasubramanian et al. 2015).

    A minimum-jerk reach has 720 / 1.875^2 = 204.8. 0 where nothing moves.

    Args:
        x: positions [m].
        rate: samples per second [1/s].
        mask: samples that count; D is their duration.
    """
    duration = _duration(x, rate, mask)
    peak = masked_max(safe_norm(differences(x, 1)), difference_mask(mask, 1)) * rate
    peak = jnp.maximum(peak, 0.0)  # -inf where no sample counts
    return safe_divide(mean_squared_jerk(x, rate, mask) * duration**4, peak * peak)


def log_dimensionless_jerk(
    x: Float[Array, "time 3"], rate: Scalar, mask: Bool[Array, "time"] | None = None
) -> Float[Array, ""]:
    """-ln of the dimensionless jerk: higher is smoother [1] (Balasubramanian et al. 2015). Minimum jerk has -5.32.

    0 where the dimensionless jerk is 0: nothing moves, or the speed never changes.
    """
    jerk = dimensionless_jerk(x, rate, mask)
    moves = jerk > 0
    return jnp.where(moves, -jnp.log(jnp.where(moves, jerk, 1.0)), 0.0)


def spectral_arc_length(
    speed: Float[Array, "time"],
    rate: Scalar,
    mask: Bool[Array, "time"] | None = None,
    cutoff: Scalar = 10.0,
    threshold: Scalar = 0.05,
    padding: int = 4,
) -> Float[Array, ""]:
    """SPARC: minus the length of the curve of the speed's normalised spectrum: nearer 0 is smoother [1].

    Balasubramanian et al. 2015, with their cutoff, amplitude threshold and padding. Not affected by the size and the
    duration of a motion. 0 where nothing moves.

    Args:
        speed: of the tool [m/s].
        rate: samples per second [1/s].
        mask: samples that count; the others are taken as standing.
        cutoff: highest frequency of the spectrum used [1/s].
        threshold: of the normalised spectrum; the curve ends with the last frequency that reaches it [1].
        padding: the transform has 2^padding times the next power of two of samples.
    """
    if mask is not None:
        speed = jnp.where(mask, speed, 0)
    size = 2 ** (max(speed.shape[0] - 1, 1).bit_length() + padding)
    bins = jnp.fft.rfft(speed, size)
    magnitude = safe_sqrt(bins.real**2 + bins.imag**2)
    magnitude = safe_divide(magnitude, jnp.max(magnitude))
    step = rate / jnp.asarray(size, speed.dtype)
    index = jnp.arange(magnitude.shape[0]).astype(speed.dtype)
    seen = (index * step <= cutoff) & (magnitude >= threshold)
    last = jnp.max(jnp.where(seen, index, 0))
    first = jnp.min(jnp.where(seen, index, jnp.inf))
    within = (index[:-1] >= first) & (index[1:] <= last)
    share = safe_divide(
        jnp.ones_like(last), jnp.where(jnp.isfinite(first), last - first, 0.0)
    )  # of one bin in the band
    piece = safe_sqrt(share * share + jnp.diff(magnitude) ** 2)
    return -jnp.sum(jnp.where(within, piece, 0))


def mean_curvature_change(
    x: Float[Array, "time 3"], rate: Scalar, mask: Bool[Array, "time"] | None = None, slowest: Scalar = 0.02
) -> Float[Array, ""]:
    """Mean of |curvature(t + 1) - curvature(t)| over the samples that move [1/m per sample].

    Curvature |v x a| / |v|^3 by central differences. The HRI paper's measure is not defined where the tool stands
    still; here samples slower than `slowest` don't count.

    Args:
        x: positions [m].
        rate: samples per second [1/s].
        mask: samples that count.
        slowest: least speed of a sample that counts [m/s].
    """
    v = (x[2:] - x[:-2]) * (rate / 2)
    a = differences(x, 2) * rate**2
    speed = safe_norm(v)
    moving = speed >= slowest
    curvature = jnp.where(moving, safe_norm(jnp.cross(v, a)) / jnp.where(moving, speed, 1.0) ** 3, 0.0)
    counts = moving if mask is None else moving & mask[:-2] & mask[1:-1] & mask[2:]
    return masked_mean(jnp.abs(jnp.diff(curvature)), counts[:-1] & counts[1:])


def _duration(x: Float[Array, "time 3"], rate: Scalar, mask: Bool[Array, "time"] | None) -> Float[Array, ""]:
    """Time from the first to the last sample that counts [s]."""
    count = jnp.asarray(x.shape[0], x.dtype) if mask is None else jnp.sum(mask, dtype=x.dtype)
    return jnp.maximum(count - 1, 0) / jnp.asarray(rate, x.dtype)
