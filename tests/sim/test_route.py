"""A route: the tool points in C MuJoCo at its joints, its length by quadrature in SciPy, and the joints that follow a tool."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

from hrcjax.plan import PathResult
from hrcjax.reference.arm import SerialArm
from hrcjax.robot import load_arm, tool_frame, with_tool
from hrcjax.sim import Cell
from hrcjax.sim.joints_along import joints_along
from hrcjax.sim.route import JOINT_LENGTH, make_route

COUNT = 25


@pytest.fixture(scope="module")
def cell():
    return Cell(arm=with_tool(load_arm("ur5"), 0.12, 0.03))


@pytest.fixture(scope="module")
def home(cell):
    return jnp.asarray(cell.arm.home)


def planned(waypoints, joints=None, ratio=None):
    """A plan of which nothing is known but where it leads."""
    none, yes = jnp.zeros(()), jnp.asarray(True)
    return PathResult(jnp.asarray(waypoints), none, none, none, none, yes, yes, yes, joints, ratio)


def bow(cell, home):
    """A bent path of the tool [m]."""
    u = np.linspace(0, 1, COUNT)[:, None]
    at = np.asarray(tool_frame(cell.arm, home)[1])
    return at + 0.3 * np.hstack([-0.2 * np.sin(np.pi * u), u, 0.2 * np.sin(2 * np.pi * u)])


@pytest.fixture(scope="module")
def followed(cell, home):
    """The route of a planner that gives no joints."""
    return jax.jit(lambda path: make_route(cell.arm, home, planned(path)))(bow(cell, home))


@pytest.fixture(scope="module")
def whole(cell, home):
    """Waypoints, joints and route of a planner for the whole arm: the joints turn by up to 0.6 rad, equally spaced along the route."""
    u = np.linspace(0, 1, 400)[:, None]
    fine = np.asarray(home) + np.hstack([0.6 * u, 0.3 * u**2, -0.4 * np.sin(u), 0.5 * u, -0.2 * u, 0.6 * u**3])
    x = mujoco_tool(cell, fine)[:, 0]
    step = np.sqrt(np.sum(np.diff(x, axis=0) ** 2, axis=1) + np.sum((0.1 * np.diff(fine, axis=0)) ** 2, axis=1))
    s = np.append(0.0, np.cumsum(step))
    at = np.linspace(0, s[-1], COUNT)
    joints = np.stack([np.interp(at, s, column) for column in fine.T], axis=1)
    waypoints = mujoco_tool(cell, joints)[:, 0]
    ratio = np.linspace(0, 1, COUNT) ** 2
    route = jax.jit(lambda *path: make_route(cell.arm, home, planned(*path)))(waypoints, joints, ratio)
    return waypoints, joints, route


def mujoco_tool(cell, joints):
    """The three tool points at each configuration in C MuJoCo, (place 3 3) [m]."""
    arm, found = SerialArm(cell), []
    for q in np.asarray(joints):
        arm.reset(q)
        found.append(arm.motion().x[-3:].copy())
    return np.array(found)


def along(route, share):
    """Places of a route at shares of its length."""
    return np.asarray(jax.jit(jax.vmap(route.curve.point))(jnp.asarray(share) * route.length))


@pytest.mark.parametrize("name", ["followed", "whole"])
def test_the_tool_points_are_those_of_the_joints(cell, request, name):
    """To rounding at the waypoints, and between them to 0.1 mm, as all 15 columns are splines of their own."""
    route = request.getfixturevalue(name)
    route = route[-1] if isinstance(route, tuple) else route
    places = along(route, np.linspace(0, 1, COUNT))
    np.testing.assert_allclose(places[:, :9].reshape(-1, 3, 3), mujoco_tool(cell, places[:, 9:]), atol=1e-9)
    between = along(route, np.linspace(0, 1, 10 * COUNT))
    np.testing.assert_allclose(between[:, :9].reshape(-1, 3, 3), mujoco_tool(cell, between[:, 9:]), atol=1e-4)
    np.testing.assert_allclose(route.end, mujoco_tool(cell, places[-1:, 9:])[0], atol=1e-9)
    three = between[:, :9].reshape(-1, 3, 3)
    sides = np.linalg.norm(three - np.roll(three, 1, axis=1), axis=2)
    np.testing.assert_allclose(sides, np.broadcast_to([0.5, 0.5, 0.5**0.5], sides.shape), atol=1e-4)  # rigid


def test_joints_follow_the_tool_with_the_orientation_of_the_start(cell, home, followed):
    places = along(followed, np.linspace(0, 1, COUNT))
    tool = mujoco_tool(cell, places[:, 9:])
    np.testing.assert_allclose(
        tool[:, 1:] - tool[:, :1], (tool[:1, 1:] - tool[:1, :1]).repeat(COUNT, axis=0), atol=1e-6
    )
    path = CubicSpline(np.linspace(0, 1, COUNT), bow(cell, home))(np.linspace(0, 1, 4001))
    gap = np.linalg.norm(places[:, None, :3] - path, axis=2).min(axis=1)
    assert gap.max() < 1e-4, "on the path that was planned"
    np.testing.assert_allclose(places[[0, -1], :3], path[[0, -1]], atol=1e-6)
    np.testing.assert_allclose(places[0, 9:], home, atol=1e-6)


def test_length_counts_tool_and_joints(whole):
    """The integral of sqrt(|dx|^2 + (0.1 m |dq|)^2) along splines through the waypoints."""
    waypoints, joints, route = whole
    spline = CubicSpline(np.arange(COUNT), np.hstack([waypoints, 0.1 * joints]), bc_type="natural")
    pieces = [quad(lambda u: np.linalg.norm(spline(u, 1)), k, k + 1)[0] for k in range(COUNT - 1)]
    np.testing.assert_allclose(route.length, sum(pieces), rtol=1e-6)
    tool = np.linalg.norm(np.diff(waypoints, axis=0), axis=1).sum()
    assert route.length > tool + 0.01


def test_a_turn_in_place_takes_its_time(cell, home):
    """0.8 rad of the last joint leave the tool where it is: 8 cm of route, along which the joint turns evenly."""
    joints = np.asarray(home) + np.linspace(0, 0.8, COUNT)[:, None] * np.eye(6)[5]
    waypoints = mujoco_tool(cell, joints)[:, 0]
    np.testing.assert_allclose(waypoints, waypoints[:1].repeat(COUNT, axis=0), atol=1e-12)
    route = jax.jit(lambda *path: make_route(cell.arm, home, planned(*path)))(waypoints, joints)
    np.testing.assert_allclose(route.length, 0.8 * JOINT_LENGTH, rtol=1e-9)
    np.testing.assert_allclose(along(route, [0.25])[0, 9:], np.asarray(home) + 0.2 * np.eye(6)[5], atol=1e-9)


def test_ratio_is_linear_between_waypoints(whole):
    _, _, route = whole
    s = np.append(np.linspace(0, 1, 40), [-0.2, 1.3]) * float(route.length)
    found = jax.vmap(route.ratio_at)(jnp.asarray(s))
    np.testing.assert_allclose(found, np.interp(s, np.linspace(0, route.length, COUNT), route.ratio), atol=1e-12)


def test_without_repulsion_nothing_slows(followed):
    assert (np.asarray(followed.ratio) == 0).all()


def test_joints_follow_in_both_precisions(cell, home, dtype):
    follow = jax.jit(lambda q, x: joints_along(cell.arm, q, x))
    joints = follow(home.astype(dtype), jnp.asarray(bow(cell, home), dtype))
    assert joints.dtype == dtype
    np.testing.assert_allclose(mujoco_tool(cell, joints)[:, 0], bow(cell, home), atol=2e-5)
