"""The orientation leaf against SciPy's rotations, its laws and its derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hrcjax.geom.rotation import rotation_vector
from hrcjax.policy import OrientationParams, ResolveParams, orientation, pullback, resolve, turn
from hrcjax.robot import load_arm, tool_frame

STILL = jnp.zeros(3)
PARAMS = OrientationParams(kp=3.0, kd=1.5, weight=0.2, eps=0.05)


def turned(rng: np.random.Generator, angle: float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """A goal, and a frame that is turned by an angle from it."""
    goal = Rotation.random(rng=rng)
    axis = rng.normal(size=3)
    return goal.as_matrix(), (Rotation.from_rotvec(axis / np.linalg.norm(axis) * (angle or 1.0)) * goal).as_matrix()


@pytest.mark.parametrize("angle", [1e-6, 0.3, 1.5, 2.8])
def test_the_pull_is_along_the_shortest_turn_back(angle: float) -> None:
    goal, R = turned(np.random.default_rng(0), angle)
    M, a = orientation(PARAMS, jnp.asarray(R), STILL, jnp.asarray(goal), STILL, STILL)
    back = (Rotation.from_matrix(goal) * Rotation.from_matrix(R).inv()).as_rotvec()
    size = PARAMS.kp * np.sin(angle) / np.hypot(np.cos(angle / 2), PARAMS.eps)
    np.testing.assert_allclose(a, size * back / angle, rtol=1e-6)
    np.testing.assert_allclose(M, 0.2 * np.eye(3))


def test_at_half_a_turn_it_is_finite_and_beside_it_leads_back() -> None:
    goal, R = turned(np.random.default_rng(1), np.pi)
    pull = lambda R: orientation(PARAMS, R, STILL, jnp.asarray(goal), STILL, STILL)[1]  # noqa: E731
    assert np.abs(pull(jnp.asarray(R))).max() < 1e-6
    slope = jax.jacfwd(lambda v: pull(rotation_vector(v) @ R))(jnp.zeros(3))
    assert np.isfinite(slope).all()
    steps = 1e-6 * np.eye(3)
    by_hand = [(pull(rotation_vector(jnp.asarray(s)) @ R) - pull(rotation_vector(-jnp.asarray(s)) @ R)) / 2e-6 for s in steps]  # fmt: skip
    np.testing.assert_allclose(slope, np.stack(by_hand, 1), rtol=1e-4, atol=1e-4)


def test_it_does_not_depend_on_the_base_frame() -> None:
    rng = np.random.default_rng(2)
    goal, R = turned(rng)
    Q = Rotation.random(rng=rng).as_matrix()
    given = [rng.normal(size=3) for _ in range(3)]
    _, a = orientation(PARAMS, jnp.asarray(R), *map(jnp.asarray, (given[0], goal, *given[1:])))
    _, b = orientation(
        PARAMS, jnp.asarray(Q @ R), *map(jnp.asarray, (Q @ given[0], Q @ goal, Q @ given[1], Q @ given[2]))
    )
    np.testing.assert_allclose(b, Q @ a, atol=1e-12)


@pytest.mark.parametrize("start", [0.5, 3.0])
def test_energy_never_grows_and_the_goal_is_reached(start: float) -> None:
    """A free frame of unit metric: kinetic energy and the integral of the pull fall together."""
    goal, R = (jnp.asarray(x) for x in turned(np.random.default_rng(3), start))
    t = np.linspace(0, np.pi, 4001)
    pull = PARAMS.kp * np.sin(t) / np.hypot(np.cos(t / 2), PARAMS.eps)
    potential = np.concatenate([[0], np.cumsum((pull[1:] + pull[:-1]) / 2 * (t[1] - t[0]))])
    dt = 1e-3

    def step(state: tuple, _: None) -> tuple:
        R, omega = state
        # the mean of both ends, for second order
        half = omega + dt / 2 * orientation(PARAMS, R, omega, goal, STILL, STILL)[1]
        R = rotation_vector(dt * half) @ R
        omega = half + dt / 2 * orientation(PARAMS, R, half, goal, STILL, STILL)[1]
        cosine = (jnp.trace(R @ goal.T) - 1) / 2
        return (R, omega), (omega @ omega / 2, cosine)

    kinetic, cosine = jax.lax.scan(step, (R, jnp.zeros(3)), None, length=20_000)[1]
    angle = np.arccos(np.clip(cosine, -1, 1))
    energy = np.asarray(kinetic) + np.interp(angle, t, potential)
    assert np.diff(energy).max() < 2e-6 and angle[-1] < 1e-3


def test_the_motion_of_a_frame_is_that_of_the_arm() -> None:
    """Against rotation matrices of MuJoCo's kinematics, by differences."""
    import mujoco

    arm = load_arm("ur5e")
    rng = np.random.default_rng(4)
    q, qd = rng.uniform(-1.5, 1.5, 6), rng.normal(size=6)
    found = turn(lambda q: tool_frame(arm, q)[0], jnp.asarray(q), jnp.asarray(qd))
    data = mujoco.MjData(arm.model)
    body = arm.model.nbody - 1

    def at(q: np.ndarray) -> Rotation:
        data.qpos[:] = q
        mujoco.mj_kinematics(arm.model, data)
        return Rotation.from_matrix(data.xmat[body].reshape(3, 3))

    def omega(q: np.ndarray) -> np.ndarray:
        h = 1e-5
        return (at(q + h * qd) * at(q - h * qd).inv()).as_rotvec() / (2 * h)

    np.testing.assert_allclose(found.omega, omega(q), atol=1e-7)
    np.testing.assert_allclose(found.J @ qd, found.omega, atol=1e-12)
    h = 1e-4
    np.testing.assert_allclose(found.Jd_qd, (omega(q + h * qd) - omega(q - h * qd)) / (2 * h), atol=1e-5)
    M, a = orientation(PARAMS, found.R, found.omega, jnp.asarray(at(q + 0.2).as_matrix()), STILL, STILL)
    alone = resolve(ResolveParams(regularisation=1e-10), pullback(found.J, found.Jd_qd, M, a))
    np.testing.assert_allclose(found.J @ alone + found.Jd_qd, a, atol=1e-5, err_msg="one leaf gets what it asks for")


def test_a_goal_that_turns_is_kept() -> None:
    """On a goal in motion the leaf asks for the goal's own acceleration."""
    goal, _ = turned(np.random.default_rng(5))
    spin, more = jnp.asarray([0.3, -0.2, 0.5]), jnp.asarray([1.0, 2.0, 3.0])
    np.testing.assert_allclose(
        orientation(PARAMS, jnp.asarray(goal), spin, jnp.asarray(goal), spin, more)[1], more, atol=1e-12
    )
