"""What a person is exposed to by the arm, by the speed at which that person really comes: tick by tick, against the exact shapes."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.segment import FAR
from hrcjax.numerics import safe_divide, safe_norm
from hrcjax.robot import Arm, point_motion
from hrcjax.robot.link_spheres import link_spheres
from hrcjax.safety import SsmParams, allowed_speed, assumed_human_speed, stopping_distance, stopping_time
from hrcjax.typing import Array, Float

STRIDE = 3
"""Ticks between two poses of the person of which speeds are taken: motions have a pose each 33 ms."""
FASTEST = 1.0
"""Speed of the arm up to which the time to stop is looked ahead [m/s]."""
TOWARDS = 0.005
"""Slower than this towards a person the arm does not approach; faster than allowed by more is a violation [m/s]."""


class Exposure(eqx.Module):
    """Of every tick."""

    separation: Float[Array, "time"]
    """Least distance of the surfaces of arm and person [m]."""
    excess: Float[Array, "time"]
    """Largest speed of any point of the arm towards the person beyond v(d): d is its largest distance within the reaction time before, v_h
    the greatest speed at which the person really comes to the point from then until the point would have stopped [m/s]."""
    excess_assumed: Float[Array, "time"]
    """The same by the speed that is assumed of a person who is not measured [m/s]."""
    short: Float[Array, "time"]
    """The most that C exceeds what is left when a point that approaches brakes now and the person goes on as they really do [m]."""


def _gaps(x: Array, person: Capsules) -> tuple[Array, Array]:
    """Of every capsule: distance of a place to its surface, FAR where nobody is, and unit direction from it."""
    way, off = person.b - person.a, x - person.a
    part = jnp.clip(safe_divide(jnp.sum(off * way, -1), jnp.sum(way * way, -1)), 0, 1)
    gap = off - part[:, None] * way
    size = safe_norm(gap)
    return jnp.where(person.radius >= 0, size - person.radius, FAR), gap / jnp.maximum(size, 1e-6)[:, None]


def real_exposure(
    arm: Arm, ssm: SsmParams, dt: float, q: Float[Array, "time joint"], qd: Float[Array, "time joint"], person: Capsules
) -> Exposure:  # fmt: skip
    """The exposure of a person to an arm.

    Args:
        ssm: by which speeds are allowed.
        dt: length of a tick [s].
        person: at every tick.
    """
    links, offsets, radii = link_spheres(arm)
    radius = jnp.asarray(radii, q.dtype)
    before = int(np.ceil(float(ssm.reaction_time) / dt / STRIDE - 1e-6))
    ahead = int(np.ceil(FASTEST / float(ssm.brake) / dt / STRIDE)) + 1
    steps = STRIDE * np.arange(-before, ahead + 1)
    last = q.shape[0] - 1

    def at(tick: Array) -> tuple[Array, ...]:
        moved = point_motion(arm.chain, q[tick], qd[tick], links, offsets)
        which = jnp.clip(tick + jnp.asarray(steps, tick.dtype), 0, last)

        def pose(k: Array) -> Array:
            here = jax.tree.map(lambda a: a[k], person)
            return jax.vmap(lambda x: jnp.min(_gaps(x, here)[0]))(moved.x) - radius

        d = jax.lax.map(pose, which)  # (pose sphere)
        here = jax.tree.map(lambda a: a[tick], person)

        def towards(x: Array, xd: Array) -> Array:
            gap, u = _gaps(x, here)
            nearest = jnp.argmin(gap)
            return jnp.where(gap[nearest] < FAR, -jnp.sum(u[nearest] * xd), 0.0)

        speed = jax.vmap(towards)(moved.x, moved.xd)
        seconds = jnp.asarray(steps * dt, q.dtype)
        stops = jax.vmap(lambda v: stopping_time(ssm, v))(speed) + STRIDE * dt
        within = seconds[:, None] <= stops
        there = d[0] < FAR - 1.0
        comes = jnp.where(within[1:] & there, (d[:-1] - d[1:]) / (STRIDE * dt), 0.0)
        real = jnp.clip(jnp.max(comes, axis=0), 0.0, 1e3)
        least = jnp.min(jnp.where(within & (seconds >= 0)[:, None], d, jnp.inf), axis=0)
        lacks = ssm.intrusion - (least - jax.vmap(lambda v: stopping_distance(ssm, v))(speed))
        return d[before], speed, real, jnp.max(jnp.where(speed > TOWARDS, lacks, -FAR))

    ticks = jnp.arange(q.shape[0], dtype=jnp.int32)
    d, speed, real, short = jax.lax.map(at, ticks)
    window = int(np.ceil(float(ssm.reaction_time) / dt - 1e-6))
    largest = jax.lax.reduce_window(d, -jnp.inf, jax.lax.max, (window + 1, 1), (1, 1), ((window, 0), (0, 0)))

    def beyond(speed: Array, d: Array, v_h: Array) -> Array:
        return speed - allowed_speed(ssm, d, v_h)

    each = jax.vmap(jax.vmap(beyond))
    assumed = jax.vmap(jax.vmap(lambda d: assumed_human_speed(ssm, d)))(largest)
    return Exposure(
        jnp.min(d, axis=1),
        jnp.max(each(speed, largest, real), axis=1),
        jnp.max(each(speed, largest, assumed), axis=1),
        short,
    )
