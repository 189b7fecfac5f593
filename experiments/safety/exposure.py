"""What a person is exposed to, tick by tick and against the exact shapes: distance, approach, excess of speed, way to stop."""

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
from hrcjax.typing import Array, Float, Joints

TOWARDS = 0.005
"""Slower than this towards a person the arm does not approach; faster than allowed by more is a violation [m/s]."""
LOOKED_AT = 96
"""Ticks of an episode for which the poses before are looked at: those with the largest excess by the pose at the tick."""
SHORT = 1e-3
"""A way to stop may miss so much of the intrusion distance: rounding, and spheres that stand for capsules [m]."""


class Exposure(eqx.Module):
    """Of every tick."""

    separation: Float[Array, "time"]
    """Least distance of the surfaces of arm and person [m]."""
    approach: Float[Array, "time"]
    """Largest speed of a point of the arm nearer than 2 m towards the person, who is held [m/s]."""
    excess: Float[Array, "time"]
    """Largest speed of any point towards the person beyond what the largest distance of that point within the reaction time allows [m/s]."""
    excess_now: Float[Array, "time"]
    """The same by the distance at that very tick [m/s]."""
    excess_pose: Float[Array, "time"]
    """The same by that of the person's poses within the reaction time by which it is least for the whole arm, distance and direction:
    where the person is by now the arm can't know [m/s]."""
    short: Float[Array, "time"]
    """The most that C exceeds what is left when a point that approaches brakes now and the person comes on as fast as is assumed
    [m]."""


def towards(arm: Arm, q: Joints, qd: Joints, person: Capsules) -> tuple[Float[Array, "sphere"], Float[Array, "sphere"]]:
    """Distance of every sphere to the person [m], and its speed towards the person, who is held [m/s]; FAR and 0: nobody."""
    links, offsets, radii = link_spheres(arm)
    moved = point_motion(arm.chain, q, qd, links, offsets)

    def one(x: Array, xd: Array, radius: Array) -> tuple[Array, Array]:
        way, from_a = person.b - person.a, x - person.a
        part = jnp.clip(safe_divide(jnp.sum(from_a * way, -1), jnp.sum(way * way, -1)), 0, 1)
        gaps = from_a - part[:, None] * way
        size = safe_norm(gaps)
        distance = jnp.where(person.radius >= 0, size - person.radius - radius, FAR)
        speed = -jnp.sum(gaps * xd, -1) / jnp.maximum(size, 1e-6)
        nearest = jnp.argmin(distance)
        some = distance[nearest] < FAR
        return distance[nearest], jnp.where(some, speed[nearest], 0.0)

    return jax.vmap(one)(moved.x, moved.xd, jnp.asarray(radii, q.dtype))


def exposed(
    arm: Arm,
    ssm: SsmParams,
    window: int,
    q: Float[Array, "time joint"],
    qd: Float[Array, "time joint"],
    person: Capsules,
) -> Exposure:
    """The exposure of a person to an arm.

    Args:
        ssm: by which speeds are allowed.
        window: ticks of the reaction time.
        person: at every tick.
    """
    distance, speed = jax.lax.map(lambda at: towards(arm, *at), (q, qd, person), batch_size=64)
    largest = jax.lax.reduce_window(distance, -jnp.inf, jax.lax.max, (window + 1, 1), (1, 1), ((window, 0), (0, 0)))

    def beyond(speed: Array, d: Array) -> Array:
        return speed - allowed_speed(ssm, d, assumed_human_speed(ssm, d))

    def lacks(speed: Array, d: Array, before: Array) -> Array:
        comes = assumed_human_speed(ssm, before)
        rest = d - comes * stopping_time(ssm, speed) - stopping_distance(ssm, speed)
        return jnp.where(speed > TOWARDS, ssm.intrusion - rest, -FAR)

    def best(at: Array) -> Array:
        """Of a tick, the excess by the best of the poses within the reaction time."""
        poses = jnp.maximum(at - jnp.arange(window + 1, dtype=at.dtype), 0)
        d, v = jax.vmap(lambda k: towards(arm, q[at], qd[at], jax.tree.map(lambda x: x[k], person)))(poses)
        return jnp.min(jnp.max(jax.vmap(jax.vmap(beyond))(v, d), axis=1))

    now = jnp.max(jax.vmap(jax.vmap(beyond))(speed, distance), axis=1)
    worst = jax.lax.top_k(now, min(LOOKED_AT, now.shape[0]))[1]
    by_pose = jax.lax.map(best, worst, batch_size=16)  # of other ticks the excess is no more than now
    return Exposure(
        separation=jnp.min(distance, axis=1),
        approach=jnp.max(jnp.where(distance < 2.0, speed, 0.0), axis=1),
        excess=jnp.max(jax.vmap(jax.vmap(beyond))(speed, largest), axis=1),
        excess_now=now,
        excess_pose=now.at[worst].set(by_pose),
        short=jnp.max(jax.vmap(jax.vmap(lacks))(speed, distance, largest), axis=1),
    )


def window_of(ssm: SsmParams, dt: float) -> int:
    """Ticks of the reaction time, on the host."""
    return int(np.ceil(float(ssm.reaction_time) / dt - 1e-6))
