"""The three ways to move: what the policy is asked, and that the joints stay on the path where the geometry is fixed."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from hrcjax.field import fit_grid
from hrcjax.geom.cloud import Cloud
from hrcjax.plan import PathResult
from hrcjax.robot import load_arm, tool_frame, with_tool
from hrcjax.safety import ClockParams, ClockState, SafetyDecision
from hrcjax.sim import Cell, FieldPart, Fields, Frames, Params, Reading, SafetyPart, follow
from hrcjax.sim.govern import Rows
from hrcjax.sim.guide import guide
from hrcjax.sim.joints_along import joints_along
from hrcjax.sim.parts import ArmMotion, Clearance
from hrcjax.sim.route import make_route
from hrcjax.sim.tick import control_motion, joint_limits

COUNT = 16
PLACE = jnp.array([-0.45, 0.45, 0.4])
"""Where somebody stands [m]."""


def told_limits(params, tick, separation):
    """A monitor with other limits for every point, which jump every fifth of a second, at times to 0; or which flow, if told."""
    period = tick // 25
    number = jnp.arange(1.0, 1.0 + separation.distance.shape[0])
    noise = jnp.abs(jnp.sin(12.9898 * number * (period + 1).astype(float)))
    jumping = jnp.where(period % 4 == 3, 0.0, params["most"] * noise)
    flowing = params["most"] * (0.3 + 0.2 * jnp.sin(number + 0.05 * tick.astype(float)))
    limit = jnp.where(params["jumps"] > 0, jumping, flowing)
    none = jnp.zeros((), jnp.int32)
    top = jnp.where((period % 5 == 4) & (params["jumps"] > 0), 0.1, 1.0)
    return tick + 1, SafetyDecision(none, jnp.min(limit), limit, jnp.ones(()), jnp.asarray(False), none, top)


def one_person(params, fields, x):
    """A person as a point, and nothing else."""
    way = x - PLACE
    d = jnp.sqrt(jnp.sum(way * way))
    return Reading(d, way / d, d, way / d)


@pytest.fixture(scope="module")
def cell():
    field = FieldPart(lambda params, frames: Fields((), frames.beyond), one_person)
    safety = SafetyPart(lambda dtype: jnp.zeros((), jnp.int32), told_limits)
    return Cell(arm=with_tool(load_arm("ur5"), 0.12, 0.03), field=field, safety=safety, ticks=250, substeps=2)


@pytest.fixture(scope="module")
def route(cell):
    home = jnp.asarray(cell.arm.home)
    at = tool_frame(cell.arm, home)[1]
    u = jnp.linspace(0, 1, COUNT)[:, None]
    way = at + 0.35 * jnp.concatenate([-0.4 * jnp.sin(jnp.pi * u), u, 0.3 * jnp.sin(2 * jnp.pi * u)], axis=1)
    joints = jax.jit(lambda x: joints_along(cell.arm, home, x))(way)
    none, yes = jnp.zeros(()), jnp.asarray(True)
    ratio = jnp.linspace(0.2, 0.8, COUNT)
    return make_route(cell.arm, home, PathResult(way, none, none, none, none, yes, yes, yes, joints, ratio))


def frames(count=4):
    layout = Cell.grid
    yes = jnp.ones(count, bool)
    return Frames(
        scene=fit_grid(replace(layout, shape=(6, 6, 6)), jnp.full((6, 6, 6), 10.0)),
        moving=Cloud(jnp.zeros((count, 1, 3)), jnp.zeros((count, 1), bool)),
        beyond=jnp.full(count, 10.0),
        stamp=jnp.linspace(-0.1, 0.0, count),
        camera=jnp.zeros(count, int),
        valid=yes,
        reasons=jnp.zeros((count, 1), int),
        guarded=~yes,
        static_overflow=jnp.asarray(False),
    )


def params_of():
    clock = ClockParams(acceleration=2.0, deceleration=2.0, jerk=40.0)
    params = eqx.tree_at(
        lambda p: (p.motion.clock, p.potential.k_att), Params(safety={"most": 0.6, "jumps": 1.0}), (clock, 0.06)
    )
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), params)


@pytest.mark.parametrize(("jumps", "most"), [(0.0, 5e-4), (1.0, 1e-3)])
def test_the_joints_stay_on_the_path_whatever_the_limits(cell, route, jumps, most):
    """Within 5e-4 rad of the joint curve where limits flow, over 2 s; 1e-3 where they jump, even to 0: all joints then brake as hard
    as they can, straight on.

    Without the path speed the clock runs on: the governor then stops the arm, and the reference leaves it behind.
    """
    params = eqx.tree_at(lambda p: p.safety["jumps"], params_of(), jnp.asarray(jumps))
    fixed = replace(cell, motion="path")
    run = jax.jit(
        lambda params, frames, route: follow(
            params, fixed, route, frames, jnp.asarray(cell.arm.home), Fields((), frames.beyond)
        )[1]
    )
    record = run(params, frames(), route)
    q, travelled = np.asarray(record.q), np.asarray(record.travelled)
    length = float(route.length)
    nodes = np.asarray(jax.vmap(route.curve.point)(jnp.linspace(0, 1, COUNT) * route.length))[:, 9:]
    curve = CubicSpline(np.arange(COUNT), nodes, bc_type="natural")(np.linspace(0, COUNT - 1, 200_001))
    off = cKDTree(curve).query(q)[0]
    assert off.max() < most
    speeds = np.diff(travelled) / cell.dt
    assert travelled[-1] > 0.25 * length and speeds.max() > 0.15
    assert (speeds[50:] < 1e-3).any() == bool(jumps), "it stands where it must"


def state_of(cell, route, s, v):
    """Motion of the arm beside its path, with the clock at s."""
    q = route.curve.point(jnp.asarray(s))[9:] + 0.02
    body, tool = control_motion(cell, q, 0.1 * jnp.ones(6))
    return ClockState(jnp.asarray(s), jnp.asarray(v), jnp.asarray(0.0)), ArmMotion(q, 0.1 * jnp.ones(6), tool, body)


def asked(cell, route, params, s, v, decision, told):
    """Guidance with a policy that answers with what it is told: six numbers of the goal."""
    telling = replace(cell, policy=lambda p, arm, goal, clearance, limits: told(goal))
    clock, arm = state_of(cell, route, s, v)
    count = len(cell.arm.control_links)
    d, g = jnp.full((count, 1), 2.0), jnp.zeros((count, 1, 3)).at[..., 0].set(1.0)
    clearance = (d[:, 0], g[:, 0])
    room, people = Clearance(*clearance, *clearance, *clearance), Rows.towards(cell.arm, d, g, arm.body.J)
    limits = joint_limits(cell, arm.q.dtype)
    return guide(params, telling, route, clock, arm, room, people, decision, decision.hold, limits), arm


def allowed(cell, limit=1.0, top=None, hold=False):
    points = jnp.full(len(cell.arm.control_links), limit)
    none = jnp.zeros((), jnp.int32)
    given = None if top is None else jnp.asarray(top)
    return SafetyDecision(none, jnp.asarray(limit), points, jnp.ones(()), jnp.asarray(hold), none, given)


def test_with_a_path_the_policy_gets_its_motion(cell, route):
    """Place and speed of the tool by the clock, as differences of the curve; the posture and the goal of the route."""
    params, s, v, h = params_of(), 0.15, 0.2, 1e-5
    point = jax.jit(lambda s: route.curve.point(s))
    before, at, after = (np.asarray(point(jnp.asarray(s + k * h))) for k in (-1, 0, 1))
    got, _ = asked(cell, route, params, s, v, allowed(cell), lambda goal: jnp.concatenate([goal.x[0], goal.xd[1]]))
    np.testing.assert_allclose(got.asked[:3], at[:3], atol=1e-12)
    np.testing.assert_allclose(got.asked[3:], v * (after - before)[3:6] / (2 * h), atol=1e-8)
    np.testing.assert_allclose(got.reference, at[:3], atol=1e-12)
    got, _ = asked(cell, route, params, s, v, allowed(cell), lambda goal: jnp.concatenate([goal.xdd[0], goal.end]))
    bend = v**2 * (after - 2 * at + before)[:3] / h**2 + float(got.clock.a) * (after - before)[:3] / (2 * h)
    np.testing.assert_allclose(got.asked[:3], bend, atol=1e-4)
    np.testing.assert_allclose(got.asked[3:], point(route.length)[:3], atol=1e-9)
    got, _ = asked(cell, route, params, s, v, allowed(cell), lambda goal: goal.posture)
    np.testing.assert_allclose(got.asked, at[9:], atol=1e-12)


def test_without_a_path_the_tool_is_drawn_straight_to_the_goal(cell, route):
    """Speed by the law of motion, along the way to the goal; the clock and the bend of the path have no say."""
    params, reactive = params_of(), replace(cell, motion="reactive")
    got, arm = asked(
        reactive, route, params, 0.15, 0.2, allowed(cell), lambda goal: jnp.concatenate([goal.xd[0], goal.x[0]])
    )
    end, x = np.asarray(route.end[0]), np.asarray(arm.tool.x[0])
    far = np.linalg.norm(end - x)
    np.testing.assert_allclose(got.asked[:3], min(30 * 0.06 * far, 1.0) * (end - x) / far, rtol=1e-9)
    np.testing.assert_allclose(got.asked[3:], x, atol=1e-12)  # its speed alone counts, and its orientation:
    assert got.clock.s == 0.15
    got, _ = asked(reactive, route, params, 0.15, 0.2, allowed(cell), lambda goal: (goal.x[1:] - goal.x[0]).reshape(-1))
    np.testing.assert_allclose(got.asked, np.ravel(route.end[1:] - route.end[0]), atol=1e-12)
    got, _ = asked(
        reactive,
        route,
        params,
        0.15,
        0.2,
        allowed(cell, top=0.1),
        lambda goal: jnp.concatenate([goal.xd[0], goal.xd[2]]),
    )
    np.testing.assert_allclose(np.linalg.norm(got.asked[:3]), 0.1, rtol=1e-9)
    got, _ = asked(
        reactive,
        route,
        params,
        0.15,
        0.2,
        allowed(cell, hold=True),
        lambda goal: jnp.concatenate([goal.xd[0], goal.xd[2]]),
    )
    assert not np.asarray(got.asked).any()


@pytest.mark.parametrize("motion", ["both", "path"])
def test_what_the_clock_listens_to(cell, route, motion):
    """The speed in any direction, and the limits of the points where the geometry is fixed; None stands for the least of these."""
    params, moving = params_of(), replace(cell, motion=motion)
    slow = eqx.tree_at(lambda p: p.motion.leash, params, 1e3)
    slow = eqx.tree_at(lambda p: (p.motion.lag, p.motion.clock.brake), slow, (1e3, 1e3))

    def speed(decision):
        return float(asked(moving, route, slow, 0.15, 0.3, decision, lambda goal: goal.posture)[0].clock.v)

    assert abs(speed(allowed(cell, 5.0, top=0.1)) - 0.1) < 1e-9
    assert abs(speed(allowed(cell, 0.1)) - (0.1 if motion == "both" else speed(allowed(cell, 0.1, top=0.1)))) < 1e-9
    at_rest = speed(allowed(cell, 0.0, top=0.2))
    assert abs(at_rest - (0.2 if motion == "both" else 0.0)) < 1e-9
    assert speed(allowed(cell, 1.0, top=1.0, hold=True)) == 0.0
    law = 30 * 0.06 * (float(route.length) - 0.15) / (1 + float(route.ratio_at(jnp.asarray(0.15))))
    weak = eqx.tree_at(lambda p: p.potential.k_att, slow, 0.06 * 0.2 / law)
    found = asked(moving, route, weak, 0.15, 0.3, allowed(cell, 5.0, top=1.0), lambda goal: goal.posture)[0].clock.v
    np.testing.assert_allclose(found, 0.2, rtol=1e-6)


def test_the_reference_waits_for_the_tool(cell, route):
    """exp(-(distance / leash)^2) of the speed, in `path` by the lag."""
    params = params_of()
    for motion, where in (("both", lambda p: p.motion.leash), ("path", lambda p: p.motion.lag)):
        moving = replace(cell, motion=motion)
        near = eqx.tree_at(lambda p: p.motion.clock.brake, params, 1e3)
        decision = allowed(cell, 5.0, top=0.2)
        _, arm = state_of(cell, route, 0.15, 0.3)
        off = float(jnp.linalg.norm(route.curve.point(jnp.asarray(0.15))[:3] - arm.tool.x[0]))
        near = eqx.tree_at(where, near, off / 0.5)
        found = asked(moving, route, near, 0.15, 0.3, decision, lambda goal: goal.posture)[0].clock.v
        np.testing.assert_allclose(found, 0.2 * np.exp(-0.25), rtol=1e-9)


def test_beside_a_fixed_path_the_joints_are_drawn_back(cell, route):
    params, fixed = params_of(), replace(cell, motion="path")
    got, _ = asked(fixed, route, params, 0.15, 0.0, allowed(cell), lambda goal: goal.posture)
    tangent = np.asarray(route.curve.tangent(jnp.asarray(0.15)))[9:]
    np.testing.assert_allclose(got.asked, -400 * 0.02 - 40 * 0.1 + tangent * float(got.clock.a), atol=1e-9)
