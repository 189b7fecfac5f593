"""The exact truth beside a run: distances of arm and tool to the person, and where the hands are. For measuring alone."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.geom.segment import FAR
from hrcjax.interact import HandParams
from hrcjax.robot import arm_capsules, control_points, tool_frame
from hrcjax.sim import Cell
from hrcjax.sim.exact import person_distances
from hrcjax.typing import Array
from hrcjax.world import Person, person_at


class Truth(NamedTuple):
    """Every tick of a run."""

    separation: NDArray
    """(tick) of the moving links to the person; 10: nobody is there [m]"""
    tool_distance: NDArray
    """(tick) of the last link with its tool to the person [m]"""
    hand: NDArray
    """(tick 3) middle of the hand that is nearest to the arm's base, as a function finds it [m]"""
    hand_radius: float
    """Of the ball about it [m]"""
    axis: NDArray
    """(tick 3) the tool's axis, out of it [1]"""
    fastest: NDArray
    """(tick) largest speed of a control point of the arm, from each tick to the next [m/s]"""


def truth_of(cell: Cell, person: Person, q: NDArray) -> Truth:
    """The truth of a run.

    Args:
        q: (tick joint) [rad].
    """
    arm = cell.arm
    fixed = sum(link < 0 for link in arm.capsule_links)
    last = np.flatnonzero(np.asarray(arm.capsule_links) == arm.tool_link)
    hands = np.flatnonzero(np.asarray(person.regions) == "hand")

    base = jnp.asarray([0.0, 0.0, HandParams().height])

    def one(q: Array, t: Array) -> tuple[Array, ...]:
        body = person_at(person, t)
        d = person_distances(arm_capsules(arm, q), body)
        R, _ = tool_frame(arm, q)
        ends = body.b[hands]
        nearest = jnp.argmin(jnp.where(body.radius[hands] < 0, FAR, jnp.linalg.norm(ends - base, axis=1)))
        return jnp.min(d[fixed:]), jnp.min(d[last]), ends[nearest], R[:, 2], control_points(arm, q)

    t = np.asarray(cell.times)[: len(q)]
    found = jax.jit(lambda q, t: jax.lax.map(lambda both: one(*both), (q, t), batch_size=64))(
        jnp.asarray(q, jnp.float32), jnp.asarray(t, jnp.float32)
    )
    separation, tool, hand, axis, points = (np.asarray(a, float) for a in found)
    speed = np.linalg.norm(np.diff(points, axis=0), axis=2).max(axis=1) / cell.dt
    return Truth(separation, tool, hand, float(person.radius[hands[0]]), axis, np.append(speed, speed[-1]))
