"""When a run reached its goal."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.numerics import safe_divide, safe_norm
from hrcjax.typing import Array, Bool, Float, Scalar


class Arrival(eqx.Module):
    """When and whether the goal was reached."""

    time: Float[Array, ""]
    """Time to the goal; the whole duration where it was not reached [s]."""
    success: Bool[Array, ""]
    """Whether it was reached."""
    error: Float[Array, ""]
    """Distance to the goal at arrival, or at the end [m]."""
    before: Bool[Array, "time"]
    """Samples up to and with the arrival: those of the task."""


SLOW = 0.05
"""Largest speed that counts as arrived [m/s]."""


def short_of(
    x: Float[Array, "time 3"], goal: Float[Array, "3"], tolerance: Scalar, dt: Scalar, slow: Scalar = SLOW
) -> Float[Array, "time"]:
    """How far every sample is from an arrival, by distance and by speed; arrived where it is at most 1 [1].

    Args:
        x: tool positions [m].
        goal: [m].
        tolerance: distance to the goal that counts as reached [m].
        dt: time between samples [s].
        slow: largest speed that counts as arrived [m/s].
    """
    step = safe_norm(jnp.diff(x, axis=0)) / dt
    speed = jnp.concatenate([step[:1], step])
    return jnp.maximum(safe_norm(x - goal) / tolerance, speed / slow)


def arrival(
    x: Float[Array, "time 3"], goal: Float[Array, "3"], tolerance: Scalar, dt: Scalar, slow: Scalar = SLOW
) -> Arrival:
    """The first moment at which the tool is within the tolerance of the goal AND not faster than `slow`.

    A run that only passes the goal has not arrived. Between samples the moment is interpolated linearly, so it is
    differentiable almost everywhere where the goal is reached.

    Args:
        x: tool positions [m].
        goal: [m].
        tolerance: distance to the goal that counts as reached [m].
        dt: time between samples [s].
        slow: largest speed that counts as arrived [m/s].

    Raises:
        ValueError: fewer than 2 samples.
    """
    n = x.shape[0]
    if n < 2:
        raise ValueError(f"{n} samples have no speed: give at least 2")
    distance, missing = safe_norm(x - goal), short_of(x, goal, tolerance, dt, slow)
    arrived = missing <= 1
    success = jnp.any(arrived)
    index = jnp.where(success, jnp.argmax(arrived), n - 1)
    earlier = jnp.maximum(index - 1, 0)
    over = missing[earlier] - 1
    share = safe_divide(over, missing[earlier] - missing[index])
    crossed = success & (index > 0)
    position = jnp.where(crossed, earlier.astype(x.dtype) + share, index.astype(x.dtype))
    return Arrival(
        time=position * dt, success=success, error=distance[index], before=jnp.arange(n, dtype=index.dtype) <= index
    )


def ideal_time(length: Scalar, speed: Scalar, acceleration: Scalar) -> Float[Array, ""]:
    """Time of a way at constant speed, with equal ramps up and down at its ends [s].

    Args:
        length: of the way, at least speed^2 / acceleration [m].
        speed: between the ramps [m/s].
        acceleration: of both ramps [m/s^2].
    """
    return jnp.asarray(length / speed + speed / acceleration)
