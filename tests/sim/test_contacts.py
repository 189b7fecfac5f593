"""Contacts, and the end of an episode, on episodes made by hand: the arm swings once and stands, a ball comes to it."""

from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.field import GridLayout, fit_grid
from hrcjax.geom.cloud import Cloud
from hrcjax.plan import PathParams, PlanParams
from hrcjax.plan.path_result import judge
from hrcjax.robot import load_arm, tool_frame, with_tool
from hrcjax.sim import Cell, Episode, Frames, Params, Record, World, outcome
from hrcjax.sim.outcome import AFTER
from hrcjax.sim.tick import initial_state
from hrcjax.world import Person, obstacle_distances
from hrcjax.world.scene import SPHERE
from hrcjax.world.scenes import Obstacle, make_scene

TICKS, DT, RATE = 200, 0.02, 50.0
"""One pose of the person a tick: it may be anywhere in a single one."""
FAR_OFF = (3.0, 3.0, 3.0)
ARRIVES = 60


@pytest.fixture(scope="module")
def cell() -> Cell:
    return Cell(arm=with_tool(load_arm("ur5"), 0.12, 0.03), ticks=TICKS, dt=DT)


@pytest.fixture(scope="module")
def record(cell) -> SimpleNamespace:
    u = np.minimum(np.arange(TICKS) / ARRIVES, 1.0)[:, None]
    q = cell.arm.home + np.array([0.9, 0.4, -0.3, 0.0, 0.0, 0.0]) * (10 * u**3 - 15 * u**4 + 6 * u**5)
    tool = jax.jit(jax.vmap(lambda q: tool_frame(cell.arm, q)[1]))(jnp.asarray(q))
    zero, whole = np.zeros(TICKS), np.zeros(TICKS, np.int32)
    return SimpleNamespace(
        q=q, qd=np.gradient(q, DT, axis=0), qdd=np.zeros_like(q), tau=np.zeros_like(q), tool=np.asarray(tool),
        reference=np.asarray(tool), travelled=zero, separation=zero, field_clearance=zero, approach=zero,
        speed_limit=zero, zone=whole, reasons=whole, cameras=whole, status=whole,
    )  # fmt: skip


def ball(places: dict[int, np.ndarray]) -> Person:
    """A person of one ball of 5 cm, at these places in these ticks, far off in all others."""
    x = np.tile(np.asarray(FAR_OFF), (TICKS, 1, 1))
    for tick, place in places.items():
        x[tick, 0] = place
    at = jnp.asarray(x)
    return Person(at, at, jnp.asarray([0.05]), jnp.asarray(RATE), jnp.ones(TICKS, bool), ("hand",))


def scene_about(record, ball_at=FAR_OFF):
    solid = Obstacle(SPHERE, tuple(ball_at), (0.05, 0.05, 0.05), 0.0, 0.05)
    return make_scene([solid], record.tool[0].tolist(), record.tool[-1].tolist(), (-2.0,) * 3, (2.0,) * 3, jnp.float64)


@pytest.fixture(scope="module")
def measure(cell, record):
    no, none = jnp.zeros(1, bool), jnp.zeros(1)
    field = fit_grid(GridLayout((0.0, 0.0, 0.0), (4, 4, 4), 1.0), jnp.full((4, 4, 4), 10.0))
    frames = Frames(field, Cloud(jnp.zeros((1, 1, 3)), no[None]), none, none, jnp.zeros(1, int), no, jnp.zeros((1, 1), int), no, no[0])  # fmt: skip
    params = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), Params(plan=PathParams()))

    @jax.jit
    def run(world: World, record: Record):
        way = world.known.start + jnp.linspace(0, 1, 12)[:, None] * (world.known.goal - world.known.start)
        known = world.known
        path = judge(
            PlanParams(params.potential, params.plan),
            way,
            lambda x: obstacle_distances(known, x),
            known.radius,
            known.lower,
            known.upper,
        )
        return outcome(params, cell, world, Episode(path, record, initial_state(cell, world.q_start)))

    def measured(person: Person, scene=None, known=None, **changes):
        made = Record(**{name: jnp.asarray(value) for name, value in {**vars(record), **changes}.items()})
        scene = scene_about(record) if scene is None else scene
        return run(World(scene, person, frames, jnp.asarray(record.q[0]), known), made)

    return measured


def test_one_tick_between_samples_counts(measure, record) -> None:
    """The tool runs into a ball that is there for a single tick; no sample is within a metre of it."""
    kept = measure(ball({33: record.tool[33]}))
    assert bool(kept.hit) and not bool(kept.run_into)
    assert float(kept.metrics.separation) < 0 and np.asarray(kept.traces.separation_t).min() > 1
    assert not bool(measure(ball({33: record.tool[33] + [0, 0, -0.09]})).hit), "beside the tool"


def test_slow_motion_is_motion(measure, record) -> None:
    """All joints but one stand: 0.02 rad/s is a moving arm, 0.005 rad/s is not."""
    there = ball({33: record.tool[33]})
    for speed, moves in ((0.02, True), (-0.02, True), (0.005, False)):
        kept = measure(there, qd=speed * np.eye(6)[3] + np.zeros_like(record.qd))
        assert (bool(kept.hit), bool(kept.run_into)) == (moves, not moves)


def test_both_kinds_of_contact(measure, record) -> None:
    kept = measure(ball({33: record.tool[33], 75: record.tool[75]}))
    assert bool(kept.hit) and bool(kept.run_into)
    kept = measure(ball({75: record.tool[75]}))
    assert not bool(kept.hit) and bool(kept.run_into)
    assert not bool(measure(ball({})).run_into)


def test_the_episode_ends_some_time_after_the_arrival(measure, record) -> None:
    """What comes a second after the arrival does not count; if the tool never arrives, it does."""
    arrival = int(float(measure(ball({})).metrics.time_to_goal) / DT) + 1
    last = arrival + round(AFTER / DT)
    assert ARRIVES * 0.7 < arrival < ARRIVES and last < TICKS - 40
    for tick, counts in ((last - 1, True), (last, True), (last + 2, False), (TICKS - 1, False)):
        kept = measure(ball({tick: record.tool[tick]}))
        assert bool(kept.run_into) == counts, tick
        assert (float(kept.metrics.separation) < 0) == counts
    away = eqx.tree_at(lambda s: s.goal, scene_about(record), jnp.asarray(record.tool[-1] + 0.3))
    assert bool(measure(ball({TICKS - 1: record.tool[-1]}), away).run_into)


def test_an_obstacle_passed_between_samples(measure, record) -> None:
    """Brute force at every tick, at places about the way of the tool."""
    draw = np.random.default_rng(2)
    between = 0
    for tick in (13, 24, 36, 47):
        centre = record.tool[tick] + draw.normal(size=3) * 0.05 + [0.0, 0.0, -0.12]
        kept = measure(ball({}), scene_about(record, centre))
        found, seldom = float(kept.metrics.clearance), np.asarray(kept.traces.clearance_t).min()
        assert found <= seldom + 1e-9
        between += found < seldom - 1e-4
    assert between >= 2


def test_the_plan_and_the_truth_have_scenes_of_their_own(measure, record) -> None:
    """A plan is judged by what was known, the arm by what is there."""
    middle = (record.tool[0] + record.tool[-1]) / 2
    blocked, free = scene_about(record, middle), scene_about(record)
    kept = measure(ball({}), free, blocked)
    assert bool(kept.no_plan) and float(kept.metrics.clearance) > 1
    kept = measure(ball({}), scene_about(record, record.tool[40]), free)
    assert not bool(kept.no_plan) and float(kept.metrics.clearance) < 0
    assert not bool(measure(ball({}), free).no_plan)


def test_true_approach_decides_the_time_below_the_protective_distance(measure, record) -> None:
    """A ball 0.6 m before the tool: a fast arm needs more room than one that stands or retreats; what is sensed is nothing."""
    ahead = record.tool[31] - record.tool[30]
    place = record.tool[30] + 0.6 * ahead / np.linalg.norm(ahead)
    stays = ball(dict.fromkeys(range(26, 35), place))
    below = [float(measure(stays, qd=speed * record.qd).metrics.time_below_sp) for speed in (1.5, 0.0, -1.5)]
    assert below[0] > below[1] == below[2]
