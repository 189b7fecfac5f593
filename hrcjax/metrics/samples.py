"""Sums and means over the samples of a run that count."""

import jax.numpy as jnp

from hrcjax.numerics import safe_divide
from hrcjax.typing import Array, Bool, Float, Scalar


def masked_mean(x: Float[Array, "time"], mask: Bool[Array, "time"] | None = None) -> Float[Array, ""]:
    """Mean of the samples under the mask; 0 where there is none."""
    if mask is None:
        return jnp.mean(x)
    return safe_divide(jnp.sum(jnp.where(mask, x, 0)), jnp.sum(mask, dtype=x.dtype))


def masked_max(x: Float[Array, "time"], mask: Bool[Array, "time"] | None = None) -> Float[Array, ""]:
    """Largest of the samples under the mask; -inf where there is none."""
    return jnp.max(x) if mask is None else jnp.max(jnp.where(mask, x, -jnp.inf))


def masked_min(x: Float[Array, "time"], mask: Bool[Array, "time"] | None = None) -> Float[Array, ""]:
    """Smallest of the samples under the mask; inf where there is none."""
    return jnp.min(x) if mask is None else jnp.min(jnp.where(mask, x, jnp.inf))


def differences(x: Float[Array, "time n"], order: int) -> Float[Array, "difference n"]:
    """Plain forward differences over time, `order` times.

    Raises:
        ValueError: fewer than order + 1 samples.
    """
    if x.shape[0] <= order:
        raise ValueError(f"{x.shape[0]} samples have no difference of order {order}: give at least {order + 1}")
    return jnp.diff(x, n=order, axis=0)


def difference_mask(mask: Bool[Array, "time"] | None, order: int) -> Bool[Array, "difference"] | None:
    """Which differences of that order are made of samples under the mask alone."""
    if mask is None:
        return None
    count = mask.shape[0] - order
    whole = mask[:count]
    for k in range(1, order + 1):
        whole = whole & mask[k : k + count]
    return whole


def resample(x: Float[Array, "time n"], rate: Scalar, new_rate: Scalar, count: int) -> Float[Array, "sample n"]:
    """`count` samples at another rate by cubic interpolation over the four nearest; exact for cubics.

    Smoothness depends on the rate: compare two runs only at one. Samples beyond the end repeat the last.

    Args:
        x: samples; at least 4.
        rate: their rate [1/s].
        new_rate: rate wanted [1/s].
        count: number of samples wanted.

    Raises:
        ValueError: fewer than 4 samples.
    """
    n = x.shape[0]
    if n < 4:
        raise ValueError(f"{n} samples can't be interpolated by cubics: give at least 4")
    at = jnp.arange(count).astype(x.dtype) * (jnp.asarray(rate, x.dtype) / jnp.asarray(new_rate, x.dtype))
    at = jnp.minimum(at, jnp.asarray(n - 1, x.dtype))
    first = jnp.clip(jnp.floor(at).astype(jnp.int32) - 1, 0, n - 4)
    u = (at - first.astype(x.dtype))[:, None]  # place within the four samples 0, 1, 2, 3
    weights = (
        -(u - 1) * (u - 2) * (u - 3) / 6,
        u * (u - 2) * (u - 3) / 2,
        -u * (u - 1) * (u - 3) / 2,
        u * (u - 1) * (u - 2) / 6,
    )
    return weights[0] * x[first] + weights[1] * x[first + 1] + weights[2] * x[first + 2] + weights[3] * x[first + 3]
