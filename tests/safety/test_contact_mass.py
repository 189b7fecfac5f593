"""The mass that a contact feels at every row: MuJoCo's inertia and Jacobians, a pendulum by hand, singular arms."""

import itertools

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from jax.test_util import check_grads

from hrcjax.robot import Arm, load_arm, mass_matrix, point_motion, with_tool
from hrcjax.robot.mjcf import ur_xml
from hrcjax.safety import ContactMobility, link_neighbours, pfl_speeds

PAYLOAD = 1.3


def felt(M, J, A, before=None, after=None, counts=None) -> ContactMobility:
    A = jnp.asarray(A)
    rows = [A if other is None else jnp.asarray(other) for other in (before, after)]
    return ContactMobility(
        jnp.asarray(M), jnp.asarray(J), A, *rows, jnp.ones(len(A), bool) if counts is None else jnp.asarray(counts)
    )


@pytest.fixture(scope="module")
def arm() -> Arm:
    return with_tool(load_arm("ur5"), 0.12, 0.03)


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_against_mujoco_with_the_payload_as_a_body(arm: Arm, kind: type) -> None:
    """The payload is a body of its own in MuJoCo's model; the least between points is sought on a fine grid of them."""
    spec = mujoco.MjSpec.from_string(ur_xml(arm.variant))
    wrist = spec.body(arm.model.body(int(arm.model.jnt_bodyid[arm.tool_link])).name)
    wrist.add_body(
        name="hand", pos=arm.tool_offset, ipos=[0, 0, 0], mass=PAYLOAD, inertia=[1e-12] * 3, explicitinertial=True
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    links = (*arm.control_links, arm.tool_link)
    offsets = np.concatenate([arm.control_offsets, arm.tool_offset[None]])
    before, after = link_neighbours(arm.control_links)

    @jax.jit
    def ours(q, u):
        J = point_motion(arm.chain, q, jnp.zeros_like(q), links, offsets).J
        A = jnp.einsum("pi,pij->pj", u, J[:-1])
        others = [jnp.einsum("pi,pij->pj", u, J[:-1][k]) for k in (before, after)]
        return felt(mass_matrix(arm.chain, q), J[-1], A, *others)(jnp.asarray(PAYLOAD, q.dtype))

    draw = np.random.default_rng(0)
    for _ in range(12):
        q, u = draw.uniform(-np.pi, np.pi, 6), draw.normal(size=(len(before), 3))
        u /= np.linalg.norm(u, axis=1)[:, None]
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        M = np.zeros((6, 6))
        mujoco.mj_fullM(model, data, M)

        def mobility(k: int, other: int, s: float, M=M, u=u) -> float:
            body = int(model.jnt_bodyid[links[k]])
            offset = (1 - s) * offsets[k] + s * offsets[other]
            J = np.zeros((3, 6))
            place = data.xpos[body] + data.xmat[body].reshape(3, 3) @ offset
            mujoco.mj_jac(model, data, J, None, place, body)
            return float(u[k] @ J @ np.linalg.solve(M, J.T @ u[k]))

        places = np.linspace(0, 0.5, 41)
        expected = [
            min(mobility(k, other, s) for other in (before[k], after[k]) for s in places) for k in range(len(before))
        ]
        found = np.asarray(ours(jnp.asarray(q, kind), jnp.asarray(u, kind)))
        assert found.dtype == kind
        np.testing.assert_allclose(found, expected, rtol=2e-3, atol=2e-4)
        ends = [mobility(k, k, 0.0) for k in range(len(before))]
        assert np.all(found <= np.asarray(ends) * (1 + 1e-3) + 1e-5)


def test_a_pendulum_by_hand() -> None:
    """A mass m at l, met at r: across, m_R = (m l^2 + m_L l^2) / r^2, hence heavier nearer to the joint; along the rod it gives not way."""
    m, l, r = 2.0, 0.8, 0.4  # noqa: E741
    A = np.array([[l], [r], [0.0]])
    found = np.asarray(felt(np.array([[m * l * l]]), np.array([[0.0], [l], [0.0]]), A)(1.0))
    np.testing.assert_allclose(found, [1 / 3, r * r / (l * l) / 3, 0.0], rtol=1e-12)
    # rods of which the middle is a joint: the point between both has no lever
    both = felt(np.array([[1.0]]), np.zeros((3, 1)), np.array([[0.3]]), after=np.array([[-0.3]]))
    np.testing.assert_allclose(both(0.0), [0.0], atol=1e-15)
    towards = felt(np.array([[1.0]]), np.zeros((3, 1)), np.array([[0.3]]), after=np.array([[0.1]]))
    np.testing.assert_allclose(towards(0.0), [0.04], rtol=1e-12)


def test_more_payload_is_never_lighter() -> None:
    draw = np.random.default_rng(1)
    B = draw.normal(size=(6, 6))
    mobility = felt(B @ B.T + np.eye(6), draw.normal(size=(3, 6)), draw.normal(size=(30, 6)))
    values = [np.asarray(mobility(m)) for m in (0.0, 0.5, 2.0, 10.0)]
    assert all((later < earlier).all() for earlier, later in itertools.pairwise(values))


def test_rows_without_direction() -> None:
    """Near ones get 0, the slowest; far ones the largest of the others, so that they decide nothing."""
    A = np.array([[0.5, 0.1], [0.0, 0.0], [0.0, 0.0], [0.1, 0.2]])
    found = np.asarray(felt(np.eye(2), np.zeros((3, 2)), A, counts=[True, True, False, True])(0.0))
    np.testing.assert_allclose(found, [0.26, 0.0, 0.26, 0.05], rtol=1e-12)
    nobody = felt(np.eye(2), np.zeros((3, 2)), np.zeros((2, 2)), counts=[False, False])
    assert np.array_equal(nobody(0.0), [0.0, 0.0])


def test_speeds_and_derivatives_at_singular_postures() -> None:
    """An arm that can't give way: the slowest speed of all, the body part's own mass; finite there and in reverse mode."""

    def slowest(A, M, payload):
        J = jnp.asarray([[0.2, 0.1], [0.0, 0.3], [0.0, 0.0]])
        return jnp.sum(jnp.min(jax.vmap(pfl_speeds)(felt(M, J, A, after=2 * A)(payload)), axis=1))

    M, still = jnp.asarray([[2.0, 0.3], [0.3, 1.0]]), jnp.zeros((1, 2))
    run = jax.jit(slowest)
    assert run(still, M, 1.0) == pytest.approx(65 / np.sqrt(4.4 * 75e3), rel=1e-12)
    grads = jax.jit(jax.grad(slowest, (0, 1, 2)))
    assert all(np.isfinite(leaf).all() for leaf in grads(still, M, 1.0))
    moving = jnp.asarray([[0.4, 0.2], [0.1, -0.6]])
    assert run(moving, M, 1.0) / 2 > run(still, M, 1.0)
    check_grads(run, (moving, M, 1.0), order=1, modes=["rev"])


def test_neighbours_are_on_the_same_link() -> None:
    before, after = link_neighbours((1, 1, 1, 2, 3, 3))
    assert list(before) == [0, 0, 1, 3, 4, 4] and list(after) == [1, 2, 2, 3, 5, 5]
