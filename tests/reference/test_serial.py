"""The closed loop in JAX against the serial one in NumPy, SciPy and C MuJoCo, in float64, tick by tick.

Both do the same sums in another order, so they agree to rounding, about 1e-14, which some 100 ticks of a stable loop do
not raise: 1e-9 is asked for (1e-8 for torques of tens of N m). Only the clock's Newton step has a derivative by finite
differences in the serial loop; it is right to some 1e-10. The least change of a command is found by an active set here and by
nonnegative least squares there, alike to 1e-12 where every limit can be kept; the person stands on one side of the tool, so that it can.
"""

import dataclasses
from functools import cache
from itertools import combinations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.field import FieldParams, GridLayout, fit_grid, grid_nodes
from hrcjax.geom.cloud import Cloud
from hrcjax.plan import PathResult
from hrcjax.presence.cloud import COARSE_FROM
from hrcjax.reference import fields as serial_fields
from hrcjax.reference.clock import Clock, advance
from hrcjax.reference.episode import episode, see
from hrcjax.reference.route import SerialRoute
from hrcjax.robot import load_arm, tool_frame, with_tool
from hrcjax.safety import GREEN, INVALID_FRAME, OLD_DATA, STOP, TOO_CLOSE, WAITING, YELLOW, ClockParams, ClockState
from hrcjax.safety import advance as jax_advance
from hrcjax.sim import Cell, Fields, Frames, Params, Record, fit_fields, follow
from hrcjax.sim.default_parts import COARSE_EDGE, read_fields
from hrcjax.sim.joints_along import joints_along
from hrcjax.sim.route import make_route

FRAMES, PLACES = 30, 40
MOTIONS = ("both", "path", "reactive")
TORQUE_LIMITED = 2


@pytest.fixture(scope="module")
def cell():
    """A short episode of an arm with limits so tight that they are met."""
    arm = with_tool(load_arm("ur5"), 0.12, 0.03)
    q_max = arm.q_max.copy()
    q_max[3] = arm.home[3] + 0.015
    tight = dataclasses.replace(arm, tau_max=0.2 * arm.tau_max, q_max=q_max)
    return Cell(arm=tight, ticks=110, substeps=2)


@pytest.fixture(scope="module")
def at(cell):
    """Where the tool is at home [m]."""
    return np.asarray(tool_frame(cell.arm, jnp.asarray(cell.arm.home))[1])


def box_field(middle, half, layout):
    """The distance to a box, sampled: negative within it."""
    way = np.abs(np.asarray(grid_nodes(layout, np.float64)) - middle) - half
    d = np.linalg.norm(np.maximum(way, 0.0), axis=1) + np.minimum(way.max(axis=1), 0.0)
    return fit_grid(layout, jnp.asarray(d.reshape(layout.shape)))


def frames_of(at, gap, present=True):
    """A block behind the tool, and two person-like cylinders, the second farther and at a right angle to the first, at a distance
    from the tool that changes [m]; two cameras.

    Much of the arm is outside of the grid of the scene.
    """
    k = np.arange(PLACES)
    cylinder = np.column_stack([0.1 * np.cos(k), 0.1 * np.sin(k), np.linspace(-0.3, 0.4, PLACES)])
    gap = np.asarray(gap)[:, None, None]
    first, second = gap * np.array([0.5, 0.8, 0.1]), (gap + 0.3) * np.array([-0.8, 0.5, 0.1])
    points = at + cylinder + np.where((k % 4 == 3)[:, None], second, first)
    layout = GridLayout(tuple(at - np.array([0.3, 0.4, 0.35])), (13, 17, 12), 0.05)
    yes = jnp.ones(FRAMES, bool)
    return Frames(
        scene=box_field(at + np.array([0.0, -0.2, -0.05]), np.array([0.08, 0.08, 0.06]), layout),
        moving=Cloud(jnp.asarray(points), jnp.full((FRAMES, PLACES), present)),
        beyond=jnp.full(FRAMES, 10.0),
        stamp=jnp.asarray((np.arange(FRAMES) - 3) / 30),
        camera=jnp.asarray(np.arange(FRAMES) % 2),
        valid=yes,
        reasons=jnp.zeros((FRAMES, 2), int),
        guarded=~yes,
        static_overflow=jnp.asarray(False),
    )


def bow(at, length):
    """Waypoints of a bent path from the tool [m]."""
    u = np.linspace(0, 1, 12)[:, None]
    return at + length * np.hstack([-0.2 * np.sin(np.pi * u), u, 0.2 * np.sin(2 * np.pi * u)])


def quick(speed, k_att):
    """Parameters with a clock so fast that much happens in a second, and so slow to brake that the governor must."""
    clock = ClockParams(acceleration=2.0, deceleration=1.5, jerk=60.0, brake=0.2)
    return eqx.tree_at(lambda p: (p.motion.clock, p.motion.speed, p.potential.k_att), Params(), (clock, speed, k_att))


def visit(at):
    """The person comes to the tool and leaves; three frames are invalid, so that data age; before, somebody has no point in the cloud."""
    gap = np.interp(
        np.arange(FRAMES) / 30, [0.0, 0.25, 0.35, 0.45, 0.55, 0.6, 0.8], [1.5, 1.1, 0.75, 0.7, 0.18, 0.18, 1.9]
    )
    frames = frames_of(at, gap)
    valid, beyond = frames.valid.at[17:20].set(False), frames.beyond.at[5:9].set(1.35)
    reasons = frames.reasons.at[17:, 1].set(64).at[25, 0].set(3)
    return (
        quick(0.6, 0.03),
        eqx.tree_at(lambda f: (f.valid, f.beyond, f.reasons), frames, (valid, beyond, reasons)),
        bow(at, 0.3),
    )


def alone(at):
    """Nobody, the first frames missing, and a short path that ends."""
    frames = frames_of(at, np.zeros(FRAMES), present=False)
    frames = eqx.tree_at(lambda f: f.valid, frames, frames.valid.at[:4].set(False))
    return quick(0.3, 5.0), frames, bow(at, 0.035)


def broken(at):
    """A policy that is not a number."""
    params, frames, path = visit(at)
    return eqx.tree_at(lambda p: p.policy.target.kp, params, float("nan")), frames, path


@pytest.fixture(scope="module")
def programs(cell):
    """The JAX loop by way to move."""
    q = jnp.asarray(cell.arm.home)

    def of(motion):
        moving = dataclasses.replace(cell, motion=motion)

        @jax.jit
        def run(params, frames, route):
            return follow(params, moving, route, frames, q, fit_fields(params.field, frames))[1]

        return run

    return {motion: of(motion) for motion in MOTIONS}


@pytest.fixture(scope="module")
def program(programs):
    return programs["both"]


def slowed(path):
    """A repulsion that grows towards the end of a path [1]."""
    return np.linspace(0.0, 1.2, len(path)) ** 2


@cache
def joints_program(cell):
    """Path -> joints along it."""
    return jax.jit(lambda path: joints_along(cell.arm, jnp.asarray(cell.arm.home), path))


def both(program, cell, scenario, motion="both", ratio=slowed):
    """The records of the JAX loop and of the serial one."""
    params, frames, path = scenario
    home, slow = jnp.asarray(cell.arm.home), ratio(path)
    joints = joints_program(cell)(jnp.asarray(path))
    planned = PathResult(jnp.asarray(path), *(jnp.zeros(()),) * 4, *(jnp.asarray(True),) * 3, joints, jnp.asarray(slow))
    route = make_route(cell.arm, home, planned)
    ours = program(jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), params), frames, route)
    theirs = alone_in_numpy(cell, (params, frames, path), motion, ratio, np.asarray(joints))
    return ours, theirs


def alone_in_numpy(cell, scenario, motion="both", ratio=slowed, joints=None):
    """The record of the serial loop."""
    params, frames, path = scenario
    if joints is None:
        joints = np.asarray(joints_program(cell)(jnp.asarray(path)))
    moving = dataclasses.replace(cell, motion=motion)
    serial = SerialRoute(cell, path, joints, ratio(path))
    return episode(params, moving, serial, see(params.field, frames), np.asarray(cell.arm.home))


def assert_same(ours, theirs):
    for name in (f.name for f in dataclasses.fields(theirs)):
        atol = 1e-8 if name == "tau" else 1e-9
        np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), rtol=0, atol=atol, err_msg=name)


@pytest.fixture(scope="module")
def visited(programs, cell, at):
    """Both records of the visit, by way to move."""
    return {motion: both(program, cell, visit(at), motion) for motion, program in programs.items()}


@pytest.mark.parametrize("motion", MOTIONS)
def test_a_person_comes_and_goes(visited, motion):
    ours, theirs = visited[motion]
    assert_same(ours, theirs)
    reasons = np.bitwise_or.reduce(np.asarray(ours.reasons))
    assert reasons == OLD_DATA | TOO_CLOSE | WAITING, "the scenario must show all of them"
    assert set(theirs.zone) == {0, 1, 2, 3} and np.diff(theirs.zone).min() < 0
    assert theirs.separation.min() < 0
    assert motion != "both" or (theirs.status == TORQUE_LIMITED).any()
    assert set(theirs.cameras) == {0, 64 << 8, 3 + (64 << 8)}


def test_the_governor_has_work(visited):
    """Faster than the limit before it brakes; and while the person stands at the tool, the arm gives way, but where the path is fixed:
    slowly, since so near their direction is open; see `test_the_arm_gives_way_faster_by_exact_directions`."""
    there = slice(64, 72)
    for motion, (_, theirs) in visited.items():
        if motion != "reactive":
            assert ((theirs.approach > theirs.speed_limit) & (theirs.speed_limit > 0)).any(), motion
        assert (theirs.zone[there] == STOP).all(), motion
        gained = np.diff(theirs.separation[there])
        assert (gained > 1e-6).all() if motion != "path" else (np.abs(gained) < 1e-6).all(), motion


def test_the_arm_gives_way_faster_by_exact_directions(visited, cell, at):
    """A part of the monitor that the serial loop has too: without it the tool leaves at more than 0.1 mm a tick."""
    params, frames, path = visit(at)
    exact = eqx.tree_at(
        lambda p: (p.safety.zone.aside, p.safety.zone.across_speed, p.safety.zone.stop_acceleration),
        params,
        (0.0, 0.0, 1e3),
    )
    there = slice(64, 72)
    fast = np.diff(alone_in_numpy(cell, (exact, frames, path)).separation[there])
    assert (fast > 1e-4).all() and (fast > 2 * np.diff(visited["both"][1].separation[there])).all()


def test_the_ways_to_move_differ(visited):
    tools = [theirs.tool for _, theirs in visited.values()]
    assert min(np.abs(a - b).max() for a, b in combinations(tools, 2)) > 0.01


@pytest.mark.parametrize("motion", MOTIONS)
def test_other_parameters_count_alike(visited, programs, cell, at, motion):
    """Every number up to a tenth larger or smaller: one that either loop passed over, or took for another, would show."""
    params, frames, path = visit(at)
    random = np.random.default_rng(MOTIONS.index(motion))
    changed = jax.tree.map(lambda v: v if isinstance(v, bool) else float(v * random.uniform(0.9, 1.1)), params)
    ours, theirs = both(programs[motion], cell, (changed, frames, path), motion)
    assert_same(ours, theirs)
    assert np.abs(theirs.q - visited[motion][1].q).max() > 1e-4


@pytest.mark.parametrize("motion", MOTIONS)
def test_attraction_and_repulsion_set_the_pace(visited, programs, cell, at, motion):
    """K_att in every way to move, U_rep / U_att where there is a path."""
    params, frames, path = visit(at)
    weak = eqx.tree_at(lambda p: p.potential.k_att, params, 0.6 * params.potential.k_att)
    ours, theirs = both(programs[motion], cell, (weak, frames, path), motion)
    assert_same(ours, theirs)
    before = visited[motion][1]
    assert np.abs(theirs.tool - before.tool).max() > 1e-3
    if motion != "reactive":
        assert theirs.travelled[-1] < before.travelled[-1] - 0.01
        ours, theirs = both(programs[motion], cell, visit(at), motion, lambda path: 2 * slowed(path))
        assert_same(ours, theirs)
        assert theirs.travelled[-1] < before.travelled[-1] - 1e-3


def test_surfaces_beyond_the_nearest_count(visited, cell, at, monkeypatch):
    """Without the second and third surface of the person the serial loop goes another way."""
    monkeypatch.setattr(serial_fields, "other_surfaces", lambda *_: [])
    _, theirs = visited["both"]
    assert np.abs(alone_in_numpy(cell, visit(at)).tool - theirs.tool).max() > 1e-4


def test_a_map_that_lost_points_holds_the_arm(program, cell, at):
    params, frames, path = visit(at)
    ours, theirs = both(
        program, cell, (params, eqx.tree_at(lambda f: f.static_overflow, frames, jnp.asarray(True)), path)
    )
    assert_same(ours, theirs)
    assert (np.asarray(ours.reasons) & INVALID_FRAME == INVALID_FRAME).all() and (theirs.zone == 3).all()


def test_nobody_there_to_the_end_of_the_path(program, cell, at):
    ours, theirs = both(program, cell, alone(at))
    assert_same(ours, theirs)
    assert np.asarray(ours.reasons)[0] == OLD_DATA and theirs.zone[-1] == 0
    assert theirs.travelled[-1] == theirs.travelled[-2] > 0.035, "the clock must come to the end"
    assert theirs.field_clearance.min() < 0.1, "the block must be near"


def test_yellow_at_best_while_somebody_may_hide(program, cell, at):
    """In a frame that is used, and in one that is not but is known to be missing; older frames count while they are used."""
    params, frames, path = alone(at)
    params = eqx.tree_at(lambda p: p.safety.max_age, params, 1.0)  # no stop: it would hide when the zone relaxes
    used, refused, older = 11, 17, 23
    valid = frames.valid.at[jnp.asarray([refused, older + 1])].set(False)
    guarded = frames.guarded.at[jnp.asarray([used, refused, older])].set(True)
    ours, theirs = both(
        program, cell, (params, eqx.tree_at(lambda f: (f.valid, f.guarded), frames, (valid, guarded)), path)
    )
    assert_same(ours, theirs)
    now = np.floor((cell.times - cell.latency) * 30 + 3 + 1e-9).astype(int)
    for frame in (used, refused, older, older + 1):
        zones = theirs.zone[now == frame]
        assert zones[0] == YELLOW and (zones >= YELLOW).all(), frame
    for frame in (used - 1, refused - 1, older - 1):
        assert (theirs.zone[now == frame] == GREEN).all(), frame


def test_a_command_that_is_not_finite(program, cell, at):
    ours, theirs = both(program, cell, broken(at))
    assert_same(ours, theirs)
    assert np.all(theirs.status & 1)


def test_the_record_has_the_same_names(visited):
    _, theirs = visited["both"]
    assert {f.name for f in dataclasses.fields(theirs)} == {f.name for f in dataclasses.fields(Record)} - {"reasons"}


@pytest.mark.parametrize("beyond", [10.0, 1.1])
@pytest.mark.parametrize(("scene", "moving"), [(True, 20), (True, 0), (False, 20), (False, 0)])
def test_readings_near_far_and_empty(scene, moving, beyond):
    """On surfaces, in the block, on the border of the grid and beyond it, at the base, and without anything."""
    rng = np.random.default_rng(1)
    points, layout = rng.uniform(0.3, 0.9, (30, 3)), GridLayout((-0.4, -0.4, -0.1), (17, 17, 13), 0.05)
    middle, half = np.array([0.1, 0.0, 0.2]), np.array([0.1, 0.15, 0.08])
    grid = box_field(middle, half, layout) if scene else fit_grid(layout, jnp.full(layout.shape, 10.0))
    steps = np.outer([0.0, 1e-4, 0.003, 0.006, 0.008, 0.03], [0.6, 0.0, 0.8])
    corners = np.array([layout.lower, layout.upper, (0.4, 0.1, 0.2), (0.1, 0.4, 0.5)])
    side, base = middle + np.array([0.1, 0, 0]), np.zeros((1, 3))
    x = np.concatenate([points[0] + steps, side + steps, middle[None], corners, base, rng.uniform(-2, 2, (40, 3))])
    mask = np.arange(30) < moving

    cloud = Cloud(jnp.asarray(points)[None], jnp.asarray(mask)[None])
    frames = eqx.tree_at(
        lambda f: (f.scene, f.moving, f.beyond),
        frames_of(np.zeros(3), np.zeros(FRAMES)),
        (grid, cloud, jnp.full(1, beyond)),
    )

    @jax.jit
    def ours(params, frames, x):
        fields = fit_fields(params, frames)
        row = Fields(fields.static, jax.tree.map(lambda a: a[0], fields.moving))
        return jax.vmap(lambda one: read_fields(params, row, one))(x)

    params = FieldParams()
    got = ours(params, frames, jnp.asarray(x))
    spread = serial_fields.Spread(params.spread, params.far_spread, params.person_noise, COARSE_FROM, COARSE_EDGE)
    people = serial_fields.fit(points[mask], params.length_scale, params.noise, len(mask))
    want = serial_fields.read(serial_fields.scene_of(grid), people, beyond, spread, x)
    names = ("distance", "gradient", "person_distance", "person_gradient", "standing_distance", "standing_gradient")
    for name, one in zip(names, want, strict=True):
        np.testing.assert_allclose(getattr(got, name), one, rtol=1e-9, atol=1e-10, err_msg=name)
    if moving:
        reach = np.linalg.norm(x[:, None] - points[mask], axis=2).min(axis=1)
        assert (got.person_distance[:, 0] <= reach - 0.02 + 1e-12).all(), "never farther than the nearest point"
        assert len(set(np.round(reach - np.asarray(got.person_distance[:, 0]), 3).tolist())) > 5
    length = np.linalg.norm(got.person_gradient, axis=-1)
    assert (np.isclose(length, 1) | (length == 0)).all()


def test_clock_from_anywhere():
    """Braking, jerk, the end near and far, holds; 1e-7 for the derivative by differences."""
    rng = np.random.default_rng(2)
    params, dt, count = Params().motion.clock, 0.008, 400
    s, v, a = rng.uniform(0, 1, count), rng.uniform(0, 0.8, count), rng.uniform(-3, 1, count)
    limit, left = rng.uniform(-0.1, 1.0, count), rng.uniform(0, 1, count) ** 3
    hold, limit = rng.uniform(size=count) < 0.1, np.where(rng.uniform(size=count) < 0.1, np.nan, limit)

    def one(s, v, a, limit, left, hold):
        after = jax_advance(params, ClockState(s, v, a), limit, left, dt, hold)
        return after.s, after.v, after.a

    columns = (s, v, a, limit, left, hold)
    ours = np.stack(jax.jit(jax.vmap(one))(*map(jnp.asarray, columns)), axis=1)
    states = zip(*(column.tolist() for column in columns), strict=True)
    theirs = [advance(params, Clock(s, v, a), limit, left, dt, hold) for s, v, a, limit, left, hold in states]
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-7)
