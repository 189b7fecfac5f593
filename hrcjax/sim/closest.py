"""The least distance between two sets of shapes over all ticks: exact distances at some ticks, and in between only where the
least one can be."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.numerics import safe_norm
from hrcjax.typing import Array, Bool, Float, Int

RESOLVED = 1e-5
"""Least distances are found to this, which is for rounding alone [m]."""
AT_ONCE = 16
"""Pairs of shapes in intervals between samples that are looked at together."""


class Sampled(eqx.Module):
    """Distances of pairs of shapes at every k-th tick, and what bounds them in between."""

    distance: Float[Array, "sample pair"]
    """At every k-th tick, the first included [m]."""
    way: Float[Array, "sample pair"]
    """The ways of both shapes from that tick to the next sample, or to the end [m]."""


def travelled(shape: Capsules, stride: int) -> Float[Array, "sample capsule"]:
    """The way of every capsule from each sample to the next, or to the end: that of its faster end, from tick to tick [m].

    No point of the capsule goes farther.

    Args:
        shape: at every tick (time capsule).
        stride: ticks from sample to sample.
    """
    step = jnp.maximum(safe_norm(jnp.diff(shape.a, axis=0)), safe_norm(jnp.diff(shape.b, axis=0)))
    whole = -(-shape.a.shape[0] // stride) * stride
    return jnp.sum(jnp.pad(step, ((0, whole - step.shape[0]), (0, 0))).reshape(-1, stride, step.shape[1]), axis=1)


def least_between(sampled: Sampled) -> Float[Array, "sample pair"]:
    """No distance from a sample to the next one is less: (d1 + d2 - way) / 2; after the last, d - way [m]."""
    first, way = sampled.distance, sampled.way
    return jnp.concatenate([(first[:-1] + first[1:] - way[:-1]) / 2, first[-1:] - way[-1:]])


def closest(
    distance: Callable[[Int[Array, ""], Int[Array, ""]], Float[Array, ""]],
    sampled: Sampled,
    counts: Bool[Array, "time"],
    stride: int,
    enough: float | None = None,
) -> Float[Array, ""]:
    """The least distance of any pair at the ticks that count, as if all were computed [m]; infinite where none counts.

    Between samples, pairs are looked at tick by tick in the order of their bounds, until no bound is below the least distance
    found. The derivative is that of the pair and the tick found. NaN where a distance or a way is.

    Args:
        distance: exact distance at a tick of a pair [m].
        sampled: some of them, and bounds of the others.
        counts: ticks that count.
        stride: ticks from sample to sample.
        enough: if given, the search is for any distance under this one [m].
    """
    time, samples = counts.shape[0], sampled.distance.shape[0]
    sampled = jax.lax.stop_gradient(sampled)
    at_samples = jnp.where(counts[::stride, None], sampled.distance, jnp.inf)
    pairs = sampled.distance.shape[1]
    found = jnp.argmin(at_samples).astype(jnp.int32)
    known, tick, pair = jnp.min(at_samples), found // pairs * stride, found % pairs
    if stride == 1:
        return jnp.where(known == jnp.inf, jnp.inf, distance(tick, pair))
    limit, enough = (jnp.inf, -jnp.inf) if enough is None else (enough, enough)
    later = jnp.arange(1, stride, dtype=jnp.int32)
    inner = jnp.arange(samples, dtype=jnp.int32)[:, None] * stride + later
    inside = counts[jnp.minimum(inner, time - 1)] & (inner < time)
    bound = least_between(sampled)
    bound = jnp.where(jnp.any(inside, axis=1)[:, None], bound, jnp.inf).reshape(-1)
    known = jnp.where(jnp.any(jnp.isnan(bound)), jnp.nan, known)

    def unsettled(state: tuple[Array, ...]) -> Array:
        bound, least, *_ = state
        return (jnp.min(bound) < jnp.minimum(least - RESOLVED, limit)) & (least >= enough)

    def look(state: tuple[Array, ...]) -> tuple[Array, ...]:
        bound, least, tick, pair = state
        _, which = jax.lax.top_k(-bound, min(AT_ONCE, bound.shape[0]))
        interval, pairs_now = which // pairs, which % pairs
        ticks, some = inner[interval], inside[interval]
        d = jax.vmap(lambda t, p: jax.vmap(lambda one: distance(one, p))(t))(jnp.minimum(ticks, time - 1), pairs_now)
        d = jnp.where(some, jax.lax.stop_gradient(d), jnp.inf).reshape(-1)
        best = jnp.argmin(d)
        better = ~(d[best] >= least)  # NaN too
        tick = jnp.where(better, ticks.reshape(-1)[best], tick)
        pair = jnp.where(better, pairs_now[best // (stride - 1)].astype(pair.dtype), pair)
        return bound.at[which].set(jnp.inf), jnp.minimum(least, d[best]), tick, pair

    _, least, tick, pair = jax.lax.while_loop(unsettled, look, (bound, known, tick, pair))
    return jnp.where(jnp.isnan(least) | (least == jnp.inf), least, distance(tick, pair))
