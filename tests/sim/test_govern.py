"""The speed governor of a tick: speeds in any direction, retreats that are asked for, and gaps."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.cells import make_cell
from hrcjax.robot import control_points
from hrcjax.safety import APPROACH_TOLERANCE, STOP, SafetyDecision
from hrcjax.safety.least_change import EFFORT, least_change
from hrcjax.sim import Clearance, Params
from hrcjax.sim.govern import IN_A_GAP, RETREAT_TURN, Rows, govern
from hrcjax.sim.tick import approaching, steered

CELL = make_cell()
HOME = jnp.asarray(CELL.arm.home)
POINTS = len(CELL.arm.control_links)
X, J = jax.jit(lambda q: (control_points(CELL.arm, q), jax.jacfwd(lambda q: control_points(CELL.arm, q))(q)))(HOME)
"""Control points at home [m] and their derivatives."""


def beside(person, standing=None, slope=None):
    """The rows towards a person at a place, and the room of the arm at home."""
    way = X - jnp.asarray(person)
    reach = jnp.linalg.norm(way, axis=1)
    g, d = way / reach[:, None], reach - 0.1
    far, up = jnp.full(POINTS, 1.0), jnp.tile(jnp.asarray([0.0, 0.0, 1.0]), (POINTS, 1))
    room = Clearance(d, g, d, g, far if standing is None else standing, up if slope is None else slope)
    return Rows.towards(CELL.arm, d[:, None], g[:, None], J), room


@jax.jit
def both(qd, rows, limit, room, top):
    return govern(Params(), CELL, qd, rows, limit, room, top)


@jax.jit
def path(qd, rows, limit, room, top):
    return govern(Params(), replace(CELL, motion="path"), qd, rows, limit, room, top)


def speeds(qd):
    return np.linalg.norm(np.asarray(J) @ np.asarray(qd), axis=1)


@pytest.mark.parametrize("seed", range(6))
def test_no_point_is_faster_than_the_zone_allows_in_any_direction(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows, room = beside(rng.uniform(-1.0, 1.0, 3) + np.array([0.0, 1.5, 0.3]))
    qd = jnp.asarray(rng.normal(size=6) * 2)
    for mode in (both, path):
        got = mode(qd, rows, jnp.full(POINTS, 10.0), room, jnp.asarray(0.25))
        assert speeds(got).max() <= 0.25 + 1e-9


@pytest.mark.parametrize("seed", range(12))
def test_a_retreat_that_is_asked_for_turns_no_joint_fast(seed: int) -> None:
    """Wherever the person is: people at the axis of a joint cannot be retreated from by turning it."""
    rng = np.random.default_rng(seed)
    rows, room = beside(rng.uniform([-0.4, -0.3, 0.0], [0.9, 0.5, 0.7]))
    got = np.asarray(both(jnp.zeros(6), rows, jnp.full(POINTS, -0.15), room, jnp.asarray(0.25)))
    assert speeds(got).max() <= 0.25 + 1e-9 and np.linalg.norm(got) <= EFFORT + 1e-9
    assert np.asarray(rows.A @ got).max() <= APPROACH_TOLERANCE


def test_it_retreats_where_that_is_possible() -> None:
    """Somebody in front of the tool alone: it goes away at nearly the speed that is asked for."""
    rows, room = beside(X[-1] + jnp.asarray([0.35, 0.0, -0.1]))
    limit = jnp.where(rows.distance < 0.36, -0.1, 1.0)
    got = both(jnp.zeros(6), rows, limit, room, jnp.asarray(10.0))
    nearest = int(jnp.argmin(rows.distance))
    wanted = max(-0.1, -RETREAT_TURN * float(jnp.linalg.norm(rows.A[nearest])))
    assert float(limit[nearest]) < 0 and float(rows.A[nearest] @ got) <= 0.8 * wanted


def test_between_people_on_both_sides_the_arm_stands() -> None:
    """Each asks for a retreat that approaches the other; what was asked for before stays, where nobody is in its way."""
    A = jnp.asarray([[1.0, 0, 0, 0, 0, 0], [-1.0, 0, 0, 0, 0, 0]])
    got = jax.jit(least_change)(jnp.asarray([0.5, 0.3, 0, 0, 0, 0]), A, jnp.asarray([-0.1, -0.1]))
    np.testing.assert_allclose(got, [0, 0.3, 0, 0, 0, 0], atol=1e-6)
    almost = A.at[1, 1].set(0.02)
    fast = jax.jit(least_change)(jnp.zeros(6), almost, jnp.asarray([-0.15, -0.15]))
    assert np.linalg.norm(fast) <= EFFORT and np.asarray(almost @ fast).max() <= APPROACH_TOLERANCE


def test_a_retreat_is_not_weakened_near_contact() -> None:
    """A limit of approach is, so that the link between two control points keeps it."""
    rows, _ = beside(np.asarray(X)[8] + [0.0, 0.12, 0.0])
    near = int(jnp.argmin(rows.distance))
    asked, allowed = rows.limits(jnp.full(POINTS, -0.01)), rows.limits(jnp.full(POINTS, 0.01))
    assert float(rows.share[near]) < 0.99
    np.testing.assert_allclose(asked[near], -0.01)
    np.testing.assert_allclose(allowed[near], 0.01 * rows.share[near])


def test_a_bound_below_zero_leaves_the_limit_of_a_touch() -> None:
    """Sensed distances are lower bounds: where a limit holds in a contact, as of power and force limiting, the arm gets on near one."""
    q = jnp.asarray(CELL.arm.home)
    J = jax.jacfwd(lambda q: control_points(CELL.arm, q))(q)
    up = jnp.tile(jnp.asarray([0.0, 0.0, 1.0]), (len(J), 1, 1))

    def limits(distance: float) -> np.ndarray:
        rows = Rows.towards(CELL.arm, jnp.full((len(J), 1), distance), up, J)
        return np.asarray(rows.limits(jnp.full(len(J), 0.14)))

    np.testing.assert_array_equal(limits(-0.08), limits(0.0))
    assert limits(0.0).min() > 0.05 and (limits(0.1) >= limits(0.0)).all()
    assert np.isnan(limits(np.nan)).any(), "no distance is no touch"


def test_a_gap_does_not_hold_the_arm_for_ever() -> None:
    """One point between two surfaces, where the distance has no direction: it may move, slowly."""
    d = jnp.full(POINTS, 1.0).at[POINTS - 1].set(-0.001)
    slope = jnp.tile(jnp.asarray([0.0, 0.0, 1.0]), (POINTS, 1)).at[POINTS - 1].set(jnp.asarray([0.0, 0.3, 0.0]))
    rows, room = beside([3.0, 3.0, 0.5], d, slope)
    got = both(jnp.asarray([0.5, 0.1, 0, 0, 0, 0]), rows, jnp.full(POINTS, 1.0), room, jnp.asarray(1.0))
    assert 0.5 * IN_A_GAP < speeds(got)[POINTS - 1] <= IN_A_GAP + 1e-9


def test_a_point_between_two_surfaces_does_not_keep_the_hand_from_its_retreat() -> None:
    """People on both sides of an elbow, whom it must not approach; the hand is asked to go away from somebody else, and can."""
    _, room = beside([0.0, 0.0, 5.0])
    hand = POINTS - 1
    elbow = int(np.argmax(np.array(CELL.arm.control_links) == 2))
    side = np.asarray(J[elbow, :, 0])
    side = side / np.linalg.norm(side)
    way = np.asarray(
        jnp.sum(J[hand, :, 3:] @ jnp.ones(3)) * jnp.asarray([0.0, 0.0, 1.0])
    )  # up or down, by the wrist alone
    way = way / np.linalg.norm(way)
    g = np.zeros((POINTS, 2, 3))
    g[elbow] = [side, -side]
    g[hand, 0] = way
    d, limit = np.full((POINTS, 2), 9.0), np.full((POINTS, 2), 1.0)
    d[elbow], limit[elbow], d[hand, 0], limit[hand, 0] = 0.3, -0.02, 0.25, -0.1
    squeezed = Rows.towards(CELL.arm, jnp.asarray(d), jnp.asarray(g), J)
    got = np.asarray(both(jnp.zeros(6), squeezed, jnp.asarray(limit.reshape(-1)), room, jnp.asarray(0.25)))
    assert way @ np.asarray(J)[hand] @ got > 0.05
    assert abs(side @ np.asarray(J)[elbow] @ got) <= APPROACH_TOLERANCE


def stopped(limit, aside, gain=1e3):
    """A decision of a stop."""
    number, nothing = jnp.asarray(STOP, jnp.int32), jnp.zeros(())
    return SafetyDecision(
        zone=number, speed_limit=nothing, point_limit=limit, scale=nothing, hold=jnp.asarray(False), reasons=number,
        any_limit=jnp.asarray(0.25), aside=jnp.asarray(aside), gain=jnp.asarray(gain),
    )  # fmt: skip


@jax.jit
def settled(qd, rows, limit, room, aside):
    """The joint speeds after some ticks in which nothing changes, asked for the same each time."""
    decision, top = stopped(limit, aside), jnp.asarray(0.25)

    def once(_, got):
        return approaching(steered(Params(), CELL, qd, got, rows, decision, room, top), rows, decision)

    return jax.lax.fori_loop(0, 6, once, qd)


def fastest_approach(qd, place, aside, rng):
    """Of control points nearer than 0.4 m to a place, towards a person, a point, who is up to `aside` [m] from it [m/s]."""
    x, v = np.asarray(X), np.asarray(J) @ np.asarray(qd)
    moved = rng.normal(size=(500, 3))
    moved *= aside * rng.uniform(0, 1, (500, 1)) / np.linalg.norm(moved, axis=1, keepdims=True)
    way = np.asarray(place) + moved[:, None] - x
    size = np.linalg.norm(way, axis=-1)
    near = np.linalg.norm(np.asarray(place) - x, axis=-1) < 0.4
    return ((way * v).sum(axis=-1) / size)[:, near].max()


def test_in_a_stop_no_point_approaches_a_person_who_is_beside_where_they_are_seen() -> None:
    """The person is exactly a point here. With the directions taken for exact, many of these commands approach them."""
    rng, careful, careless = np.random.default_rng(0), [], []
    for _ in range(10):
        way = rng.normal(size=3)
        place = np.asarray(X)[-1] + 0.2 * way / np.linalg.norm(way)
        _, room = beside(place)
        away = X - jnp.asarray(place)
        reach = jnp.linalg.norm(away, axis=1)
        rows = Rows.towards(CELL.arm, (reach - CELL.arm.control_radii)[:, None], (away / reach[:, None])[:, None], J)
        limit = jnp.where(reach < 0.5, -0.02, 1.0).at[jnp.argmin(reach)].set(-0.1)
        asked = jnp.asarray(rng.normal(size=6))
        for found, aside in ((careful, 0.05), (careless, 0.0)):
            found.append(fastest_approach(settled(asked, rows, limit, room, aside), place, 0.05, rng))
    assert max(careful) <= APPROACH_TOLERANCE + 1e-6
    assert (np.array(careless) > 0.005).sum() >= 4, "the part that is tested"


def test_in_a_stop_speed_grows_slowly_and_falls_at_once() -> None:
    rows, room = beside([3.0, 3.0, 0.5])
    decision = stopped(jnp.full(POINTS, 1.0), 0.0, 0.004)
    asked = jnp.asarray([0.5, 0.2, 0.1, 0.0, 0.3, 0.0])
    got = steered(Params(), CELL, asked, 0.1 * asked, rows, decision, room, jnp.asarray(0.25))
    np.testing.assert_allclose(speeds(got).max(), speeds(0.1 * asked).max() + 0.004, rtol=1e-6)
    got = steered(Params(), CELL, 0.01 * asked, asked, rows, decision, room, jnp.asarray(0.25))
    np.testing.assert_allclose(got, 0.01 * asked)
    fixed = replace(CELL, motion="path")
    got = steered(Params(), fixed, 0.2 * asked, 0.1 * asked, rows, decision, room, jnp.asarray(10.0))
    np.testing.assert_allclose(got, 0.2 * asked, err_msg="the clock alone sets the pace of a path")


def test_a_steady_retreat_passes_whole() -> None:
    """Somebody before the hand alone, and far from all else: it goes away as fast as without doubt about their place, nearly."""
    hand = X[-1]
    rows, room = beside(hand + jnp.asarray([0.35, 0.0, -0.1]))
    limit = jnp.where(rows.distance < 0.36, -0.1, 1.0)
    nearest = int(jnp.argmin(rows.distance))
    careful, careless = (settled(jnp.zeros(6), rows, limit, room, aside) for aside in (0.05, 0.0))
    away = [-float(rows.A[nearest] @ qd) for qd in (careful, careless)]
    assert away[0] > 0.7 * away[1] > 0.03
