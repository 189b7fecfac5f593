"""A person who is there at once, beside the moving arm: how soon it brakes."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.safety import RED
from hrcjax.world import Person

from .truth import arm_person, tool_poses
from .worlds import Bench, SetUp

BESIDE = 0.3
"""Distance from the arm at which the person appears [m]."""
MOVING = 0.1
"""Joint speed above which the arm counts as moving [rad/s]."""


def moments(t: NDArray, qd: NDArray, count: int, rate: float) -> list[int]:
    """Frames of the person's record at which the arm moves, spread evenly."""
    moving = np.flatnonzero(np.abs(qd).max(axis=1) > MOVING)
    if not len(moving):
        return []
    chosen = moving[np.linspace(0.05 * len(moving), 0.9 * len(moving), count).astype(int)]
    return sorted({int(np.ceil(t[k] * rate)) + 1 for k in chosen})


def appearing(bench: Bench, made: SetUp, q: NDArray, frame: int) -> Person:
    """Somebody who stands at the table's edge, hands over it, and is not there before a frame of the record.

    Moved as a whole so that hands or trunk are at `BESIDE` from the arm in posture q.
    """
    person = bench.person(made, "stand_and_work")
    still = eqx.tree_at(
        lambda p: (p.a, p.b, p.present),
        person,
        (
            jnp.broadcast_to(person.a[:1], person.a.shape),
            jnp.broadcast_to(person.b[:1], person.b.shape),
            jnp.arange(person.present.shape[0]) >= frame,
        ),
    )
    tool = tool_poses(bench.cell.arm, q[None])[1][0]
    hip = np.asarray(person.a[0, 0], float)
    late = np.asarray([person.present.shape[0] / float(person.rate)])

    def moved(back: float) -> Person:
        way = jnp.asarray([tool[0] - hip[0], back, 0.0], person.a.dtype)
        return eqx.tree_at(lambda p: (p.a, p.b), still, (still.a + way, still.b + way))

    near, far = -2.0, 2.0  # along y: people stand at the +y edge
    backs = np.linspace(far, near, 401)
    for back in backs:  # from afar until near enough
        if arm_person(bench.cell.arm, moved(float(back)), q[None], late)[0] < BESIDE:
            return moved(float(back) + 0.01)
    raise ValueError("nobody can stand beside the arm")


def appear_case(bench: Bench, made: SetUp, t: NDArray, q: NDArray, frame: int) -> dict[str, Any]:
    """The episode in which somebody appears.

    Args:
        t: of every tick [s].
        q: of the arm with nobody there (time joint) [rad].
        frame: of the person's record from which on somebody is there.
    """
    rate = float(bench.person(made, "nobody").rate)
    begin = (frame - 1) / rate  # there as soon as the next frame counts
    person = appearing(bench, made, q[np.searchsorted(t, begin)].astype(float), frame)
    played = bench.play(made, person)
    stamps = played.stamp
    return {
        "begin": begin,
        "first": stamps[stamps > begin + 1e-6].min(),
        "t": played.t,
        "zone": played.zone,
        "qd": played.qd,
        "separation": played.separation,
        "true_now": arm_person(bench.cell.arm, person, played.q.astype(float), played.t),
    }


def brake_tick(zone: NDArray, qd: NDArray, first: int) -> int:
    """The first tick from `first` on whose command slows the arm in red or stop; the number of ticks if there is none."""
    speed = np.linalg.norm(qd, axis=1)
    slows = np.append(speed[1:] < speed[:-1], False) & (zone >= RED)
    later = np.flatnonzero(slows[first:])
    return first + int(later[0]) if len(later) else len(zone)
