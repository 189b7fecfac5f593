"""Coordinates without bounds for parameters with bounds, so that an optimiser may go anywhere.

Between two bounds z = logit((x - low) / (high - low)), with the logarithms of all three where low > 0: equal steps of z are
then equal factors, far from the bounds. Above one bound z = log(x - low), below one z = -log(high - x), without any z = x.
"""

import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp

from hrcjax.typing import Array, Float, Scalar


@dataclass(frozen=True)
class Bounds:
    """An open interval, and the map of it onto all numbers."""

    low: float = -math.inf
    """[unit of the parameter]."""
    high: float = math.inf
    """[unit of the parameter]."""

    def __post_init__(self) -> None:
        if not self.low < self.high:
            raise ValueError(f"bounds {self.low:g}:{self.high:g}; accepted is LOW < HIGH")

    def inside(self, x: float) -> bool:
        """Whether x has a finite coordinate."""
        return self.low < x < self.high

    def to_free(self, x: Scalar) -> Float[Array, ""]:
        """The coordinate of x [1]. Infinite if: x is at a bound."""
        x = jnp.asarray(x)
        low, high = math.isfinite(self.low), math.isfinite(self.high)
        if low and high and self.low > 0:
            return jnp.log(jnp.log(x / self.low)) - jnp.log(jnp.log(self.high / x))
        if low and high:
            return jnp.log(x - self.low) - jnp.log(self.high - x)
        if low:
            return jnp.log(x - self.low)
        return -jnp.log(self.high - x) if high else x

    def from_free(self, z: Scalar) -> Float[Array, ""]:
        """The parameter at a coordinate, never outside of the bounds, whatever the rounding."""
        z = jnp.asarray(z)
        low, high = math.isfinite(self.low), math.isfinite(self.high)
        if low and high and self.low > 0:
            x = self.low * jnp.exp(math.log(self.high / self.low) * jax.nn.sigmoid(z))
        elif low and high:
            x = self.low + (self.high - self.low) * jax.nn.sigmoid(z)
        elif low:
            x = self.low + jnp.exp(z)
        else:
            x = self.high - jnp.exp(-z) if high else z
        return jnp.clip(x, self.low, self.high)
