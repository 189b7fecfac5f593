"""Speed of the arm towards a person beyond what the distance allows."""

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.robot import Arm
from hrcjax.safety import SsmParams, allowed_speed, assumed_human_speed
from hrcjax.world import Person

from .truth import FAR, axis_points, link_frames, on_links, person_capsules, point_to_segment

STEP = 1e-4
"""Step of the central difference of the arm's motion [s]."""


@jax.jit
def _allowed(ssm: SsmParams, d: jax.Array) -> jax.Array:
    return jax.vmap(lambda one: allowed_speed(ssm, one, assumed_human_speed(ssm, one)))(d)


def approach(arm: Arm, person: Person, q: NDArray, qd: NDArray, t: NDArray) -> tuple[NDArray, NDArray]:
    """Of spheres along the arm at every tick: distance to the person, and speed towards it, (time sphere) [m], [m/s].

    The speed is that of the arm's motion alone, along the true direction: the person is held where it is at the tick.
    """
    links, offsets, radii = axis_points(arm)
    x, ahead, behind = (on_links(link_frames(arm, q + h * qd), links, offsets) for h in (0.0, STEP, -STEP))
    xd = (ahead - behind) / (2 * STEP)
    a, b, radius = person_capsules(person, t)
    best = np.full(x.shape[:2], FAR)
    speed = np.zeros(x.shape[:2])
    for k in range(a.shape[1]):
        gap, near = point_to_segment(x, a[:, None, k], b[:, None, k])
        away = (x - near) / np.maximum(gap, 1e-9)[..., None]
        distance = np.where(np.isnan(radius[:, None, k]), FAR, gap - radius[:, None, k] - radii)
        nearer = distance < best
        best = np.where(nearer, distance, best)
        speed = np.where(nearer, -(away * xd).sum(-1), speed)
    return best, speed


def within_last(distance: NDArray, ticks: int) -> NDArray:
    """The largest of each sphere's distances within the last ticks, (time sphere) [m]."""
    found = distance.copy()
    for k in range(1, min(ticks, len(distance) - 1) + 1):
        found[k:] = np.maximum(found[k:], distance[:-k])
    return found


def excess_speed(distance: NDArray, speed: NDArray, ssm: SsmParams, dt: float) -> NDArray:
    """Speed towards the person less the speed allowed at the largest distance within the reaction time, the most of all
    spheres at every tick [m/s]."""
    ticks = int(np.ceil(float(ssm.reaction_time) / dt - 1e-6))
    largest = within_last(distance, ticks)
    allowed = np.asarray(_allowed(ssm, jnp.asarray(largest.reshape(-1)))).reshape(largest.shape)
    return (speed - allowed).max(axis=1)
