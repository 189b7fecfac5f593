"""Every measure of an episode against plain NumPy and C MuJoCo, in float64, to rounding.

Only distances to obstacles differ by more: the library's search along a capsule ends at 0.618^24 of its length, 1e-5, which
where the distance has a kink is 6e-6 m too much.
"""

import dataclasses
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.field import GridLayout, fit_grid
from hrcjax.geom.cloud import Cloud
from hrcjax.geom.segment import FAR, segment_segment_distance
from hrcjax.metrics import METRICS
from hrcjax.plan import PlanParams
from hrcjax.plan.path_result import judge
from hrcjax.reference import truth
from hrcjax.reference.outcome import SerialOutcome
from hrcjax.reference.outcome import outcome as serial_outcome
from hrcjax.robot import load_arm, tool_frame, with_tool
from hrcjax.sim import Cell, Episode, Frames, Params, Record, World, outcome
from hrcjax.sim.tick import initial_state
from hrcjax.world import motion_named, obstacle_distances
from hrcjax.world.scene import BOX, COLUMN, SPHERE
from hrcjax.world.scenes import Obstacle, make_scene

TICKS, STRIDE = 240, 10
SEARCH = 1e-5
"""[m]"""
BY_SEARCH = {
    "clearance": SEARCH,
    "score_safety": 0.01,
    "score_overall": 0.01,
    "sound_clearance": 200 / 0.05 * SEARCH,
    "score_sound": 0.01,
}
"""Measures into which distances to obstacles enter."""


@pytest.fixture(scope="module")
def cell() -> Cell:
    return Cell(arm=with_tool(load_arm("ur5"), 0.12, 0.03), ticks=TICKS, metric_stride=STRIDE)


@pytest.fixture(scope="module")
def record(cell) -> SimpleNamespace:
    """The arm swings over for 1.4 s, then stands. What does not follow from the angles is drawn at random."""
    random, home = np.random.default_rng(0), cell.arm.home
    u = np.minimum(cell.times / 1.4, 1.0)[:, None]
    turn = np.array([0.9, 0.5, -0.4, 0.3, 0.2, 0.6])
    q = home + turn * (10 * u**3 - 15 * u**4 + 6 * u**5) + 0.05 * np.sin(9 * u) * np.sin(np.pi * u) ** 2
    qd = np.gradient(q, cell.dt, axis=0)
    tool = np.asarray(jax.jit(jax.vmap(lambda q: tool_frame(cell.arm, q)[1]))(jnp.asarray(q)))
    return SimpleNamespace(
        q=q,
        qd=qd,
        qdd=np.gradient(qd, cell.dt, axis=0) + random.normal(size=q.shape),
        tau=random.normal(size=q.shape) * 30,
        tool=tool,
        reference=tool,
        travelled=cell.times,
        separation=random.uniform(0, 1, TICKS),
        field_clearance=random.uniform(0, 1, TICKS),
        approach=random.uniform(-0.5, 1.0, TICKS),
        speed_limit=random.uniform(0, 1, TICKS),
        zone=random.integers(0, 4, TICKS).astype(np.int32),
        reasons=np.zeros(TICKS, np.int32),
        cameras=np.zeros(TICKS, np.int32),
        status=np.where(np.arange(TICKS) == 77, 2, 0).astype(np.int32),
    )


@pytest.fixture(scope="module")
def world(record) -> World:
    """One solid of each kind about the way of the tool, and a person who reaches into it."""
    way = record.tool
    solids = [
        Obstacle(SPHERE, tuple(way[60] + [0.1, 0.15, 0.0]), (0.05, 0.05, 0.05), 0.0, 0.05),
        Obstacle(COLUMN, (*(way[100] + [0.05, 0.2, 0.0])[:2], 0.1), (0.03, 0.03, 0.1), 0.0, 0.03),
        Obstacle(BOX, tuple(way[-1] + [-0.25, 0.1, -0.1]), (0.08, 0.04, 0.06), 0.5, 0.06),
    ]
    ends = (tuple(way[0]), tuple(way[-1]))
    scene = make_scene(solids, *ends, (-2.0,) * 3, (2.0,) * 3)
    person = motion_named("reach_in", scene, 1, 3.0, 30.0)
    hands = np.asarray(person.b)[:, 9]
    nearest = np.linalg.norm(hands - way[110], axis=1).argmin()
    come = np.linspace(1.5, -0.6, len(hands))[:, None, None] * np.array([0.3, 0.6, 0.2])  # and touches at the end
    shift = way[110] - hands[nearest] + [0.12, 0.2, 0.1] + come
    person = eqx.tree_at(lambda p: (p.a, p.b), person, tuple(np.asarray(v) + shift for v in (person.a, person.b)))

    def wide(leaf):
        return jnp.asarray(leaf, jnp.float64) if np.issubdtype(leaf.dtype, np.floating) else jnp.asarray(leaf)

    return World(jax.tree.map(wide, scene), jax.tree.map(wide, person), nothing_seen(), jnp.asarray(record.q[0]))


def nothing_seen() -> Frames:
    """No measure depends on what the camera saw."""
    no, none = jnp.zeros(1, bool), jnp.zeros(1)
    scene = fit_grid(GridLayout((0.0, 0.0, 0.0), (4, 4, 4), 1.0), jnp.full((4, 4, 4), FAR))
    moving = Cloud(jnp.zeros((1, 1, 3)), no[None])
    return Frames(scene, moving, none, none, jnp.zeros(1, int), no, jnp.zeros((1, 1), int), no, no[0])


WAYPOINTS = np.array([0.1, 0.7, 0.15]) + np.linspace(0, 1, 20)[:, None] ** 1.5 * np.array([0.5, -0.4, 0.1])
WAYPOINTS[:, 2] += 0.03 * np.sin(7 * np.linspace(0, 1, 20))
WAYPOINTS[7] = WAYPOINTS[6]  # one that comes twice


@pytest.fixture(scope="module")
def measure(cell):
    """(params, world, record) -> outcomes by the library and by plain NumPy."""

    @jax.jit
    def library(params: Params, world: World, record: Record):
        scene, waypoints = world.scene, jnp.asarray(WAYPOINTS)
        path = judge(
            PlanParams(params.potential),
            waypoints,
            lambda x: obstacle_distances(scene, x),
            scene.radius,
            scene.lower,
            scene.upper,
        )
        return outcome(params, cell, world, Episode(path, record, initial_state(cell, world.q_start)))

    def both(world: World, record: SimpleNamespace, params: Params | None = None):
        params = Params() if params is None else params
        ours = library(
            jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), params),
            world,
            Record(**{name: jnp.asarray(value) for name, value in vars(record).items()}),
        )
        return ours, serial_outcome(params, cell, world, WAYPOINTS, record)

    return both


def assert_same(ours, theirs: SerialOutcome) -> None:
    assert list(theirs.metrics) == list(METRICS)
    for name, value in theirs.metrics.items():
        atol = BY_SEARCH.get(name, 1e-9)
        got = float(getattr(ours.metrics, name))
        np.testing.assert_allclose(got, value, rtol=1e-9, atol=atol, err_msg=name)
    np.testing.assert_allclose(ours.traces.separation_t, theirs.separation, rtol=0, atol=1e-12)
    over = np.asarray(ours.traces.clearance_t) - theirs.clearance
    assert over.min() > -1e-12 and over.max() < SEARCH
    np.testing.assert_allclose(ours.traces.speed, theirs.speed, rtol=0, atol=1e-12)
    assert int(ours.run_status) == theirs.run_status
    assert (bool(ours.hit), bool(ours.run_into)) == (theirs.hit, theirs.run_into)


def changed(record: SimpleNamespace, **values) -> SimpleNamespace:
    return SimpleNamespace(**{**vars(record), **values})


def test_the_tool_arrives_while_the_person_comes(measure, world, record) -> None:
    ours, theirs = measure(world, record)
    assert_same(ours, theirs)
    found = theirs.metrics
    assert found["success"] == 1 and 1.0 < found["time_to_goal"] < 1.5 and theirs.run_status == 2
    assert 0.2 < found["time_below_sp"] < found["time_to_goal"], "the scenario must have both"
    assert found["clearance"] < theirs.clearance.min() - 1e-5, "the nearest moment is between two samples"
    near = theirs.separation < 0.31  # S_p(0) at the defaults
    assert 0 < near[: int(found["time_to_goal"] / 0.08)].sum() < 15, "and unsafe moments"
    assert theirs.separation.min() < 0 and theirs.run_into and not theirs.hit, "contact when the arm stands"
    np.testing.assert_allclose(ours.traces.tool, record.tool[::STRIDE])
    np.testing.assert_array_equal(ours.traces.zone, record.zone[::STRIDE])
    np.testing.assert_allclose(ours.traces.speed_limit, record.speed_limit[::STRIDE])


def test_contact_while_the_arm_moves(measure, world, record) -> None:
    ours, theirs = measure(world, changed(record, qd=record.qd + 0.011 * np.eye(6)[3]))  # one joint suffices
    assert theirs.hit and not theirs.run_into
    assert_same(ours, theirs)


def test_a_near_miss_is_no_contact(measure, world, record) -> None:
    moving = changed(record, qd=record.qd + 0.06)
    most = -measure(world, moving)[1].metrics["separation"]
    thinner = eqx.tree_at(lambda w: w.person.radius, world, world.person.radius - most - 0.003)
    ours, theirs = measure(thinner, moving)
    assert_same(ours, theirs)
    assert 0 < theirs.separation.min() < 0.005 and not theirs.hit and not theirs.run_into


def test_what_stands_at_the_base_is_no_obstacle_to_it(measure, cell, world, record) -> None:
    """The base never moves: only the links do that can touch something."""
    bottom = jnp.asarray(cell.arm.capsule_a[0] + [0.0, 0.0, -0.05])
    at_base = eqx.tree_at(lambda w: w.scene.center, world, world.scene.center.at[0].set(bottom))
    ours, theirs = measure(at_base, record)
    assert_same(ours, theirs)
    a, b = truth.arm_axes(cell.arm, record.q[::STRIDE])
    base = truth.segment_distance(a[:, 0], b[:, 0], np.asarray(bottom), np.asarray(bottom))
    assert (theirs.clearance > base - 0.05 - cell.arm.capsule_radii[0] + 0.01).all()


def test_a_goal_that_is_not_reached(measure, world, record) -> None:
    away = eqx.tree_at(lambda w: w.scene.goal, world, world.scene.goal + 0.3)
    ours, theirs = measure(away, record)
    assert_same(ours, theirs)
    assert theirs.metrics["success"] == 0 and theirs.metrics["time_to_goal"] == pytest.approx((TICKS - 1) * 0.008)
    assert theirs.metrics["time_below_sp"] > 0.8


def test_the_distance_that_counts_as_reached(measure, world, record) -> None:
    """The tool comes to stand beside the goal: at 1.9 cm it has arrived, when it was that near; at 2.1 cm it has not."""
    onward = record.tool[100] - record.tool[90]
    onward = onward / np.linalg.norm(onward)
    for off, arrives in ((0.019, True), (0.021, False)):
        beside = jnp.asarray(record.tool[-1] + off * onward)
        ours, theirs = measure(eqx.tree_at(lambda w: w.scene.goal, world, beside), record)
        assert_same(ours, theirs)
        assert theirs.metrics["success"] == arrives
    assert theirs.metrics["goal_error"] == pytest.approx(0.021)


def test_at_the_goal_from_the_start(measure, world, record) -> None:
    still = {name: np.repeat(getattr(record, name)[-1:], TICKS, axis=0) for name in ("q", "tool")}
    ours, theirs = measure(world, changed(record, **still))
    assert_same(ours, theirs)
    assert theirs.metrics["time_to_goal"] == 0 and theirs.metrics["tool_length"] == 0


def test_nobody_and_one_obstacle(measure, world, record) -> None:
    mask = world.scene.mask.at[1:].set(False)
    alone = eqx.tree_at(lambda w: (w.person.present, w.scene.mask), world, (jnp.zeros_like(world.person.present), mask))
    ours, theirs = measure(alone, record)
    assert_same(ours, theirs)
    assert theirs.metrics["separation"] == FAR and theirs.metrics["time_below_sp"] == 0


def test_a_person_who_comes_in_late_and_has_no_legs(measure, world, record) -> None:
    frames = np.arange(len(world.person.present))
    late = eqx.tree_at(
        lambda w: (w.person.present, w.person.radius),
        world,
        (jnp.asarray(frames > 25), world.person.radius.at[-4:].set(-1.0)),
    )
    ours, theirs = measure(late, record)
    assert_same(ours, theirs)
    assert theirs.separation[0] == FAR and theirs.separation[-1] < 1


def test_other_parameters_count(measure, world, record) -> None:
    def of(p: Params):
        ssm, clock = p.safety.ssm, p.motion.clock
        return ssm.brake, ssm.v_h, ssm.v_h_near, ssm.intrusion, ssm.reaction_time, clock.acceleration, p.motion.speed

    params = eqx.tree_at(of, Params(), (2.0, 0.3, 3.0, 0.5, 0.15, 0.7, 0.4))
    ours, theirs = measure(world, record, params)
    assert_same(ours, theirs)
    before = measure(world, record)[1].metrics
    for name in ("time_below_sp", "score_safety", "score_efficiency"):
        assert theirs.metrics[name] != before[name], name


def test_every_measure_is_told_apart_by_the_scenarios(measure, world, record) -> None:
    """A measure that never changed would be compared with itself alone."""
    goal = eqx.tree_at(lambda w: w.scene.goal, world, world.scene.goal + 0.3)
    fast = eqx.tree_at(lambda p: (p.motion.speed, p.motion.clock.acceleration), Params(), (2.0, 20.0))
    pairs = [measure(w, record, fast) for w in (world, goal)]
    pairs.append(measure(world, changed(record, qd=-record.qd + 0.1, tool=record.tool * [1, 1.1, 1]), fast))
    for ours, theirs in pairs:
        assert_same(ours, theirs)
    first, second, third = (theirs.metrics for _, theirs in pairs)
    same = {name for name in METRICS if first[name] == second[name] == third[name]}
    assert same == {"plan_length", "plan_bending_energy", "clearance", "separation", "sound_clearance"}


def test_distance_of_segments_against_a_grid() -> None:
    """Crossing, parallel, touching and vanishing ones; both forms against the least of 1001 x 1001 pairs of places."""
    random = np.random.default_rng(3)
    a, b, c, d = random.uniform(-1, 1, (4, 12, 3))
    d[0] = c[0] + (b[0] - a[0])  # parallel
    b[1], d[2] = a[1], c[2]  # a point against a segment, and the other way
    b[3], d[3] = a[3], c[3]
    c[4], d[4] = a[4] + 2 * (b[4] - a[4]), a[4] + 3 * (b[4] - a[4])  # in line
    c[5] = (a[5] + b[5]) / 2  # touching
    s = np.linspace(0, 1, 1001)[:, None]
    for k in range(12):
        p, r = a[k] + s * (b[k] - a[k]), c[k] + s * (d[k] - c[k])
        square = (p * p).sum(1)[:, None] + (r * r).sum(1) - 2 * p @ r.T
        grid = np.sqrt(max(square.min(), 0.0))
        plain = float(truth.segment_distance(a[k], b[k], c[k], d[k]))
        assert -1e-12 < grid - plain < 2e-3
        np.testing.assert_allclose(
            segment_segment_distance(*map(jnp.asarray, (a[k], b[k], c[k], d[k]))), plain, atol=1e-9
        )


def test_names_of_the_record() -> None:
    assert {f.name for f in dataclasses.fields(Record)} >= {
        "q",
        "qd",
        "qdd",
        "tau",
        "tool",
        "approach",
        "zone",
        "status",
    }
