"""Whether the monitor's limits always leave a way to stop: one point that approaches one person on a line, integrated exactly.

The point asks for the most at every tick and gets what `monitor` allows; it brakes at the deceleration that S_p counts on. As in the
cell, the monitor is told the distance from where the point is, by its encoders, to where the person was when the last image was
taken. The person comes on meanwhile, at most as fast as is assumed at the distance of the first decision, to the end. Then the
point must come to rest before the separation is less than C + Z_d + Z_r.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.safety import SafetyParams, SsmParams, ZoneState, allowed_speed, assumed_human_speed, initial_zone, monitor
from hrcjax.typing import Array, Bool, Float, Int, PRNGKeyArray

DT = 0.008
"""Control period [s]."""
TICKS = 160
"""Ticks until everything is at rest, or the person was there."""
KEPT = 16
"""Ticks of the past whose separation may still be what the monitor is told."""


class StopState(eqx.Module):
    """A moment in which the point moves and the person comes."""

    separation: Float[Array, ""]
    """Separation that the monitor was told last, when it was measured [m]."""
    share: Float[Array, ""]
    """Speed of the point as a share of the speed allowed there [1]."""
    person: Float[Array, ""]
    """Speed of the person as a share of the speed assumed there [1]."""
    restless: Float[Array, ""]
    """Chance that the person rests for a tick [1]."""
    latency: Int[Array, ""]
    """Age of a measurement when it arrives [ticks]."""
    period: Int[Array, ""]
    """Time between measurements [ticks]."""


class Stopped(NamedTuple):
    """What came of it."""

    moving_least: Float[Array, ""]
    """Least separation while the point moved towards the person, or when it came to rest; infinite if it never moved [m]."""
    rest: Bool[Array, ""]
    """Whether it came to rest."""


def random_state(ssm: SsmParams, key: PRNGKeyArray) -> StopState:
    """A state whose latency and period the reaction time covers; half of the people come steadily at the full speed assumed."""
    keys = jax.random.split(key, 6)
    dtype = jnp.asarray(ssm.reaction_time).dtype
    most = jnp.floor(ssm.reaction_time / DT + 1e-9).astype(jnp.int32) - 1  # one tick to act in
    period = jax.random.randint(keys[0], (), 1, jnp.maximum(most, 2), jnp.int32)
    latency = jax.random.randint(keys[1], (), 0, jnp.maximum(most - period, 0) + 1, jnp.int32)
    separation = jax.random.uniform(keys[2], (), dtype, 0.15, 2.5)
    steady = jax.random.bernoulli(keys[3])
    person = jnp.where(steady, 1.0, jax.random.uniform(keys[3], (), dtype))
    restless = jnp.where(steady, 0.0, jax.random.uniform(keys[4], (), dtype, 0.0, 0.6))
    share = jnp.where(steady, 1.0, jax.random.uniform(keys[5], (), dtype))
    return StopState(separation, share, person, restless, latency, period)


class Carry(NamedTuple):
    """What a tick hands to the next."""

    person: Float[Array, "past"]
    """Place of the person on the line, now and at the ticks before [m]."""
    point: Float[Array, "past"]
    """Place of the point [m]."""
    v: Float[Array, ""]
    """Its speed [m/s]."""
    zone: ZoneState
    """Of the monitor."""
    least: Float[Array, ""]
    """Least separation while it moved [m]."""


def approach(
    params: SafetyParams,
    true: SsmParams,
    start: StopState,
    key: PRNGKeyArray,
    harsh: bool = False,
    encoders: bool = True,
) -> Stopped:
    """Play a state to its end.

    Args:
        params: of the monitor.
        true: what holds: deceleration, and how fast people are.
        harsh: the person is as fast as is assumed at the distance of each moment, faster within `near`, instead of at the first.
        encoders: whether the monitor is told the distance from where the point is, instead of that when the image was taken.
    """
    first = assumed_human_speed(true, start.separation)
    v = start.share * allowed_speed(params.ssm, start.separation, first)
    ages = jnp.asarray(DT * np.arange(KEPT), v.dtype)
    # on straight lines until now, when the first image is as old as the latency
    begun = start.latency.astype(v.dtype) * DT
    person = start.separation + start.person * first * jnp.minimum(ages - begun, 0.0)
    person = jnp.where(ages > begun, start.separation, person)
    point = v * (begun - ages) - (v * begun if encoders else 0.0)  # `separation` is what the monitor is told

    def tick(carry: Carry, item: tuple[Array, Array]) -> tuple[Carry, None]:
        k, chance = item
        age = (
            start.latency + k % start.period
        )  # an image is used from `latency` after it was taken until the next one is there
        told = carry.person[age] - carry.point[0 if encoders else age]
        zone, decision = monitor(params, carry.zone, told[None], carry.v[None], 0.0, DT)
        asked = jnp.maximum(decision.point_limit[0], 0.0)
        after = jnp.maximum(asked, carry.v - true.brake * DT)
        here = carry.person[0] - carry.point[0]
        speed = start.person * (assumed_human_speed(true, here) if harsh else first)
        came = jnp.where(chance < start.restless, 0.0, speed) * DT
        went = 0.5 * (carry.v + after) * DT  # exact: both speeds are linear in time
        there = here - came - went
        moved = jnp.maximum(carry.v, after) > 0
        least = jnp.where(moved, jnp.minimum(carry.least, there), carry.least)
        persons, points = (jnp.concatenate([new[None], old[:-1]]) for new, old in ((carry.person[0] - came, carry.person), (carry.point[0] + went, carry.point)))  # fmt: skip
        return Carry(persons, points, after, zone, least), None

    chances = jax.random.uniform(key, (TICKS,), v.dtype)
    begin = Carry(person, point, v, initial_zone(v.dtype), jnp.where(v > 0, person[0] - point[0], jnp.inf))
    end, _ = jax.lax.scan(tick, begin, (jnp.arange(TICKS, dtype=jnp.int32), chances))
    return Stopped(end.least, end.v <= 0)


def margins(
    params: SafetyParams, true: SsmParams, keys: PRNGKeyArray, harsh: bool = False, encoders: bool = True
) -> tuple[Stopped, StopState]:
    """Random states, played; and these states. Separations of `Stopped` are beyond C + Z_d + Z_r [m]."""

    def one(key: PRNGKeyArray) -> tuple[Stopped, StopState]:
        draw, play = jax.random.split(key)
        start = random_state(true, draw)
        found = approach(params, true, start, play, harsh, encoders)
        return Stopped(found.moving_least - (true.intrusion + true.Z_d + true.Z_r), found.rest), start

    return jax.vmap(one)(keys)
