"""The functions: their decisions and goals beside hands that are known, their leaves' signs, their monitor, the goal in a tick."""

from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.cells.ur5 import make_cell
from hrcjax.interact import (
    CONTACT_OR_SEPARATION,
    FollowParams,
    GiveWayParams,
    HandOverParams,
    KeepAwayParams,
    KeepDistanceParams,
    MonitorParams,
    NearingParams,
    Seen,
    Tool,
    carried_on,
    follow,
    gently,
    give_way,
    hand_over,
    in_refuge,
    keep_away,
    keep_distance,
    kept_from,
    no_share,
    nobody_near,
    not_following,
    not_handing_over,
    not_keeping_away,
    shifted,
    task_at,
    watch_nearing,
)
from hrcjax.interact.composition import FREE, released
from hrcjax.safety import initial_clock
from hrcjax.sim import Clearance, Goal, Params, Separation, separation_monitor
from hrcjax.sim.guide import guide
from hrcjax.sim.params import sensed_safety

F = jnp.result_type(float)
DT = 0.016
U = jnp.asarray([0.0, -1.0, 0.0])
HOME = jnp.asarray([0.0, 0.2, 0.4])
ON, OFF = jnp.asarray(True), jnp.asarray(False)
_DRAW = np.random.default_rng(0)
_BALL = _DRAW.normal(size=(120, 3))
_BALL *= 0.103 / np.linalg.norm(_BALL, axis=1)[:, None]


def _f(x: object) -> jax.Array:
    return jnp.asarray(x, F)


def seen_at(place: np.ndarray, t: float) -> Seen:
    """A ball of points in an image of 30 Hz that is used at once, and an arm behind it."""
    stamp = np.floor(t * 30) / 30
    arm = place + np.linspace(0.17, 0.35, 20)[:, None] * np.array([0, 1.0, 0.3])
    points = np.concatenate([place + _BALL, arm]).astype(float)
    return Seen(jnp.asarray(points), jnp.ones(len(points), bool), _f(stamp), _f(t))


def played(step, memory, place, seconds: float):  # type: ignore[no-untyped-def]
    """Memories of all ticks, with a tool that is on its goal."""
    found = []
    step = jax.jit(step)
    for t in np.arange(0, seconds, DT):
        tool = Tool(memory.reference.x, memory.reference.v)
        memory = step(memory, seen_at(place(t), t), tool)
        found.append(memory)
    return found


def test_follow_stays_at_its_distance_from_a_hand_of_0_3_m_per_s() -> None:
    params = FollowParams()
    params = eqx.tree_at(lambda p: (p.distance, p.track.lag, p.reach), params, (0.4, 0.0, 2.0))

    def place(t: float) -> np.ndarray:
        return np.array([0.2 * np.sin(1.5 * t), 0.9, 0.3])  # up to 0.3 m/s; images are up to 33 ms old

    found = played(lambda m, s, tool: follow(params, m, s, tool, HOME, U, ON, DT), not_following(HOME), place, 5.0)
    t = np.arange(0, 5, DT) + DT
    wanted = np.array([place(one) for one in t]) + 0.503 * np.asarray(U)
    error = np.linalg.norm(np.array([np.asarray(m.reference.x) for m in found]) - wanted, axis=1)
    assert error[t > 2.5].max() < 0.03 and np.median(error[t > 2.5]) < 0.012
    off = played(lambda m, s, tool: follow(params, m, s, tool, HOME, U, OFF, DT), not_following(HOME), place, 0.5)
    np.testing.assert_allclose(off[-1].reference.x, HOME, atol=1e-6)


def test_an_offer_waits_for_a_hand_that_is_still_holds_and_is_withdrawn() -> None:
    params = HandOverParams()

    def place(t: float) -> np.ndarray:
        return np.array([0.2 + 0.5 * max(0.6 - t, 0) + 0.5 * max(t - 4.5, 0), 0.75, 0.3])

    found = played(lambda m, s, tool: hand_over(params, m, s, tool, HOME, U, ON, DT), not_handing_over(HOME), place, 5.6)  # fmt: skip
    offered = np.array([bool(m.offered) for m in found])
    t = np.arange(0, 5.6, DT)
    assert not offered[t < 0.95].any() and offered[(t > 1.4) & (t < 4.5)].all() and not offered[t > 5.0].any()
    there = found[int(4.4 / DT)]
    wanted = place(4.0) + (0.103 + params.distance) * np.asarray(U)
    assert np.linalg.norm(np.asarray(there.reference.x) - wanted) < 0.01 and float(there.turned.s) > 0.99
    back = np.linalg.norm(np.asarray(found[-1].reference.x) - np.asarray(HOME)) - np.linalg.norm(wanted - np.asarray(HOME))  # fmt: skip
    assert back < -0.05


def test_giving_way_stops_the_task_in_the_refuge_and_takes_it_up_where_it_was_left() -> None:
    params = GiveWayParams()
    ends = (jnp.asarray([0.0, 0.5, 0.3]), jnp.asarray([-0.5, 0.1, 0.3]))
    refuge = jnp.asarray([0.3, 0.2, 0.5])

    def place(t: float) -> np.ndarray:
        return np.array([-0.25, 0.35 if 3.0 < t < 6.0 else 1.5, 0.3])

    found = played(lambda m, s, tool: give_way(params, m, s, tool, ends, refuge, ON, DT), in_refuge(refuge), place, 10.0)  # fmt: skip
    t = np.arange(0, 10, DT)
    phase, share = (np.array([float(x) for x in col]) for col in zip(*[(m.phase, m.share.s) for m in found], strict=True))  # fmt: skip
    x, v = (np.array([np.asarray(getattr(m.reference, k)) for m in found]) for k in "xv")
    waits = (t > 5.0) & (t < 6.0)
    assert np.ptp(phase[waits]) < 0.01 and share[waits].min() > 0.98
    assert np.linalg.norm(x[waits][-1] - np.asarray(refuge)) < 0.02
    assert phase[-1] > phase[waits][0] + 0.8 and share[-1] < 0.02
    wanted = np.asarray(task_at(_f(phase[-1]), *ends)[0])
    assert np.linalg.norm(x[-1] - wanted) < 0.03
    steps = np.linalg.norm(np.diff(v, axis=0), axis=1)[t[1:] > 1.0] / DT
    assert steps.max() < 10.0  # a jump of the goal by 0.6 m would be 0.5 m/s in a tick, 30 m/s^2
    off = played(lambda m, s, tool: give_way(params, m, s, tool, ends, refuge, OFF, DT), in_refuge(refuge), place, 5.0)
    assert float(off[-1].share.s) < 0.01


def test_the_task_waits_for_a_tool_that_comes_back_and_is_finished() -> None:
    """Left just before its end, its clock would pass it while the tool is on the way."""
    params = GiveWayParams()
    ends = (jnp.asarray([0.0, 0.5, 0.3]), jnp.asarray([-0.5, 0.1, 0.3]))
    refuge = jnp.asarray([0.3, 0.2, 0.5])

    def place(t: float) -> np.ndarray:
        return np.array([-0.25, 0.3 if 4.2 < t < 6.0 else 1.5, 0.3])

    found = played(lambda m, s, tool: give_way(params, m, s, tool, ends, refuge, ON, DT), in_refuge(refuge), place, 11.0)  # fmt: skip
    t = np.arange(0, 11, DT)
    x = np.array([np.asarray(m.reference.x) for m in found])
    phase = np.array([float(m.phase) for m in found])
    left = phase[t > 5.9][0]
    assert 1.5 < left < np.pi < phase[-1] < 2 * np.pi
    assert np.linalg.norm(x[t > 6.0] - np.asarray(ends[1]), axis=1).min() < 0.02


def test_the_way_back_has_the_acceleration_and_jerk_that_it_may_have() -> None:
    for way in (0.3, 1.0, 4.0):
        k = gently(1.0, 10.0, _f(way))

        def step(share, _, k=k):  # type: ignore[no-untyped-def]
            after = shifted(k, share, ON, 0.002)
            return after, after.curve

        a = way * np.asarray(jax.lax.scan(step, no_share(F), None, 1500)[1])
        jerk = np.diff(a, prepend=0.0) / 0.002
        assert a.max() < 1.02 and np.abs(jerk).max() < 10.1
        assert a.max() > 0.97 or np.abs(jerk).max() > 9.7, "as quick as that"


def test_the_derivatives_of_the_task_are_its_derivatives() -> None:
    ends = (jnp.asarray([0.0, 0.5, 0.3]), jnp.asarray([-0.5, 0.1, 0.4]))
    place, slope, bend = (lambda p, k=k: task_at(p, *ends)[k] for k in range(3))
    for p in (0.3, 2.0, 4.0):
        np.testing.assert_allclose(jax.jacfwd(place)(p), slope(p), atol=1e-6)
        np.testing.assert_allclose(jax.jacfwd(slope)(p), bend(p), atol=1e-6)
    np.testing.assert_allclose(place(0.0), ends[0], atol=1e-6)
    np.testing.assert_allclose(place(np.pi), ends[1], atol=1e-6)


def test_the_distance_leaf_pushes_away_damps_an_approach_and_leaves_the_far_alone() -> None:
    params, g = KeepDistanceParams(), jnp.asarray([0.0, 0.0, 1.0])
    M, a = keep_distance(params, _f(0.4), g, jnp.zeros(3))
    assert float(a[2]) == pytest.approx(params.k * (params.distance - 0.4), rel=0.01) and abs(float(a[0])) < 1e-6
    assert float(M[2, 2]) > 0.99 * params.weight and float(M[0, 0]) == 0
    coming = keep_distance(params, _f(0.4), g, -0.2 * g)[1]
    going = keep_distance(params, _f(0.4), g, 0.2 * g)[1]
    assert float(coming[2]) > float(a[2]) > float(going[2])
    far = keep_distance(params, _f(params.distance + 0.2), g, jnp.zeros(3))
    assert float(far[0][2, 2]) < 1e-4 and float(far[1][2]) < 1e-4
    beside = keep_distance(params, _f(0.4), g, jnp.asarray([0.5, 0.0, 0.0]))
    np.testing.assert_allclose(beside[1], a, atol=1e-5)


def test_keep_away_comes_to_its_pose_and_keeps_farther_from_who_comes_on() -> None:
    params, pose = KeepAwayParams(), jnp.asarray([0.1, 0.4, 0.3])

    def place(t: float) -> np.ndarray:
        return np.array([0.1, 1.6 - 0.8 * min(max(t - 1.0, 0.0), 1.0), 0.3])  # 0.8 m/s for a second

    found = played(lambda m, s, tool: keep_away(params, m, s, tool, pose, DT), not_keeping_away(HOME), place, 3.0)
    np.testing.assert_allclose(found[-1].reference.x, pose, atol=1e-3)
    t = np.arange(0, 3, DT)
    kept = np.array([float(kept_from(params, m, 0.7)) for m in found])
    np.testing.assert_allclose(kept[(t < 1.0) | (t > 2.7)], 0.7, atol=0.01)
    assert kept[(t > 1.6) & (t < 2.0)].mean() == pytest.approx(0.7 + 0.6 * 0.8, abs=0.02)
    gone = eqx.tree_at(lambda m: m.nearing.rate, found[0], _f(0.8))
    assert float(kept_from(params, gone, 0.7)) == pytest.approx(0.7), "who goes lets nobody nearer"


def test_who_comes_into_view_at_once_has_no_rate() -> None:
    params, now = NearingParams(), nobody_near(F)
    assert float(carried_on(params, now)) == 0
    for stamp, d in ((0.0, 10.0), (0.1, 0.8), (0.1, 0.1), (0.2, 0.7)):
        now = watch_nearing(params, now, _f(stamp), _f(d))
    assert float(now.distance) == pytest.approx(0.7), "a distance counts once an image"
    assert float(now.rate) == pytest.approx(-1.0 * (1 - np.exp(-1.0)), rel=1e-5)


def test_released_spheres_know_what_stands_but_not_the_person() -> None:
    hand = np.array([False, True, True])
    d, stands = jnp.asarray([0.1, 0.1, 0.05]), jnp.asarray([0.3, 0.3, 0.05])
    away, up = jnp.tile(jnp.asarray([1.0, 0, 0]), (3, 1)), jnp.tile(jnp.asarray([0, 0, 1.0]), (3, 1))
    room = Clearance(d, away.at[2].set(up[2]), jnp.asarray([0.1, 0.1, 0.4]), away, stands, up)
    free = released(room, hand, _f(1.0))
    np.testing.assert_allclose(free.distance, [0.1, 0.3, 0.05], atol=1e-6)
    np.testing.assert_allclose(free.gradient, [away[0], up[0], up[0]])
    np.testing.assert_allclose(free.person_distance, [0.1, 0.1 + FREE, 0.4 + FREE], atol=1e-6)
    same = released(room, hand, 0.0)
    np.testing.assert_allclose(same.distance, room.distance)
    np.testing.assert_allclose(same.gradient, room.gradient)


def test_the_monitor_is_either_the_cells_own_or_the_contact_speed() -> None:
    safety = jax.tree.map(_f, sensed_safety())

    def seen(d: float, age: float = 0.05) -> Separation:
        return Separation(jnp.full(4, d, F), jnp.zeros(4, F), _f(age), ON, OFF, _f(0.008))  # fmt: skip

    start = CONTACT_OR_SEPARATION.start(F)

    def decided(contact: float, d: float, age: float = 0.05):  # type: ignore[no-untyped-def]
        return CONTACT_OR_SEPARATION.decide(MonitorParams(safety, _f(contact)), start, seen(d, age))[1]

    for d in (0.1, 0.4, 2.0):
        own, mine = separation_monitor(safety, start, seen(d))[1], decided(0.0, d)
        np.testing.assert_allclose(mine.point_limit, own.point_limit)
        np.testing.assert_allclose(mine.any_limit, own.any_limit)
        assert bool(mine.hold) == bool(own.hold)
    near = decided(1.0, 0.02)
    # face: 65 N, 75 N/mm, 4.4 kg against half of 17.05 kg and 1 kg
    mu = 1 / (1 / 4.4 + 1 / (17.05 / 2 + 1.0))
    np.testing.assert_allclose(near.point_limit, 65 / np.sqrt(mu * 75e3), rtol=1e-4)
    assert not bool(near.hold) and float(near.any_limit) == pytest.approx(1.0)
    assert bool(decided(1.0, 0.5, age=5.0).hold) and float(decided(1.0, 0.5, age=5.0).point_limit.max()) == 0


def test_a_goal_leads_the_tick_and_a_path_cannot_be_led() -> None:
    got = []

    def policy(params, arm, goal, room, limits):  # type: ignore[no-untyped-def]
        got.append(goal)
        return jnp.ones(6)

    cell, x = replace(make_cell(), policy=policy), jnp.zeros((3, 3))
    goal = Goal(x + 1, x, x, jnp.zeros(6), x[0], Params().potential)
    clock: Any = initial_clock(F)
    none: Any = None  # room, people, decision, hold and limits are the policy's
    asked = guide.__wrapped__(Params(), cell, goal, clock, none, none, none, none, none, none)  # type: ignore[attr-defined]
    assert got == [goal] and float(asked.asked[0]) == 1 and float(asked.reference[0]) == 1
    with pytest.raises(ValueError, match="Goal leads the arm"):
        guide.__wrapped__(Params(), replace(cell, motion="path"), goal, clock, none, none, none, none, none, none)  # type: ignore[attr-defined]
