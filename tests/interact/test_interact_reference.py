"""References: bounded, without jumps, on a moving place exactly; poses against SciPy's rotations."""

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

from hrcjax.interact import (
    Reference,
    ReferenceParams,
    Tool,
    at_rest,
    frame_of,
    goal_at,
    led_to,
    no_share,
    pointing,
    shifted,
    turn_between,
)
from hrcjax.plan import PotentialParams

F = jnp.result_type(float)
DT = 0.008


def _f(x: object) -> jax.Array:
    return jnp.asarray(x, F)


def led(place, ticks: int, params: ReferenceParams, tool=None):  # type: ignore[no-untyped-def]
    """(tick 9) place, velocity and acceleration of a point that is led; the tool is on it unless given."""
    step = jax.jit(lambda now, x, v, a, tool: led_to(params, now, tool, x, v, a, DT))
    now, found = at_rest(jnp.zeros(3)), []
    for k in range(ticks):
        x, v, a = (jnp.asarray(u, F) for u in place(k * DT))
        now = step(now, x, v, a, Tool(now.x, now.v) if tool is None else tool)
        found.append(np.concatenate([np.asarray(u) for u in (now.x, now.v, now.a)]))
    return np.array(found)


def test_it_comes_within_its_speed_and_acceleration_and_does_not_overshoot() -> None:
    goal, zero = np.array([0.6, 0.3, -0.2]), np.zeros(3)
    found = led(lambda t: (goal, zero, zero), 400, ReferenceParams(speed=0.4, acceleration=1.0))
    speed, a = np.linalg.norm(found[:, 3:6], axis=1), np.linalg.norm(found[:, 6:], axis=1)
    assert speed.max() < 0.401 and 0.99 < a.max() < 1.001
    assert np.linalg.norm(found[-1, :3] - goal) < 1e-3
    assert (found[:, :3] @ goal).max() < goal @ goal * 1.002


def test_on_a_place_that_moves_it_stays_on_it() -> None:
    def place(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        w = 1.5
        return (
            np.array([0.2 * np.sin(w * t), 0, 0]), np.array([0.2 * w * np.cos(w * t), 0, 0]), np.array([-0.2 * w * w * np.sin(w * t), 0, 0]),
        )  # fmt: skip

    found = led(place, 500, ReferenceParams())
    wanted = np.array([place((k + 1) * DT)[0] for k in range(500)])
    assert np.abs(found[250:, :3] - wanted[250:]).max() < 2e-3


def test_it_does_not_leave_a_tool_that_is_held() -> None:
    held, zero = Tool(jnp.zeros(3), jnp.zeros(3)), np.zeros(3)
    found = led(lambda t: (np.array([1.0, 0, 0]), zero, zero), 200, ReferenceParams(), held)
    assert np.linalg.norm(found[:, :3], axis=1).max() <= 0.03 + 0.5 * DT
    assert np.linalg.norm(found[:, 3:6], axis=1).max() <= 0.06 + 1.5 * DT + 1e-6


def test_a_share_neither_overshoots_nor_jumps() -> None:
    step = jax.jit(lambda share, on: shifted(4.0, share, on, DT))
    share, found = no_share(F), []
    for k in range(900):
        share = step(share, jnp.asarray(k < 450))
        found.append([float(share.s), float(share.rate), float(share.curve)])
    s, rate, curve = np.array(found).T
    assert s.min() > -1e-5 and s.max() < 1 + 1e-5 and abs(s[449] - 1) < 1e-3 and abs(s[-1]) < 1e-3
    assert (np.diff(s[:449]) > -1e-6).all() and (np.diff(s[451:]) < 1e-6).all()
    assert np.abs(np.diff(curve)).max() < 1.05 * 4.0**3 * DT
    np.testing.assert_allclose(np.gradient(s, DT)[5:-5], rate[5:-5], atol=0.02)


def test_poses_are_rotations_and_the_turn_joins_them() -> None:
    draw = np.random.default_rng(0)
    for _ in range(5):
        z = draw.normal(size=3)
        z /= np.linalg.norm(z)
        R = np.asarray(pointing(jnp.asarray(z, F), jnp.asarray([1.0, 0.0, 0.0])))
        np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-5)
        assert np.linalg.det(R) > 0 and R[0, 0] >= -1e-6
        np.testing.assert_allclose(R[:, 2], z, atol=1e-6)
        turn = draw.normal(size=3)
        turn *= draw.uniform(0.1, 3.0) / np.linalg.norm(turn)
        other = (Rotation.from_rotvec(turn) * Rotation.from_matrix(R)).as_matrix()
        np.testing.assert_allclose(turn_between(jnp.asarray(R), jnp.asarray(other, F)), turn, atol=2e-3)


def test_a_goal_has_the_three_tool_points() -> None:
    x, v = jnp.asarray([0.1, 0.2, 0.3]), jnp.asarray([0.1, 0.0, 0.0])
    goal = goal_at(frame_of(Reference(x, v, v), jnp.eye(3)), jnp.zeros(6), PotentialParams())
    np.testing.assert_allclose(goal.x, np.asarray(x) + 0.5 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), atol=1e-6)
    np.testing.assert_allclose(goal.xd, np.tile(v, (3, 1)), atol=1e-6)
