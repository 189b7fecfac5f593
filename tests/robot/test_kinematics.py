"""Links and points against MuJoCo, and the geometric derivatives against those of JAX."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from jax.test_util import check_grads
from quick import quick_jit
from random_chain import random_model

from hrcjax.robot import chain_from_mujoco, link_frames, point_jacobians, point_motion, points_on_links

LINKS = (5, 2, -1, 0, 5, 3)
OFFSETS = np.random.default_rng(7).normal(size=(6, 3)) * 0.2


def states(n: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    return rng.uniform(-np.pi, np.pi, (count, n)), rng.uniform(-3, 3, (count, n))


def test_frames_against_mujoco(arm, dtype):
    Q, _ = states(6, 1000)
    R, p = quick_jit(jax.vmap(lambda q: link_frames(arm.chain, q)))(jnp.asarray(Q, dtype))
    assert R.dtype == p.dtype == dtype
    data = mujoco.MjData(arm.model)
    xpos, xmat = [], []
    for q in np.asarray(jnp.asarray(Q, dtype), np.float64):
        data.qpos[:] = q
        mujoco.mj_kinematics(arm.model, data)
        xpos.append(data.xpos[1:].copy())
        xmat.append(data.xmat[1:].reshape(6, 3, 3).copy())
    atol = 1e-6 if dtype == jnp.float32 else 1e-12
    np.testing.assert_allclose(p, np.array(xpos), rtol=0, atol=atol)
    np.testing.assert_allclose(R, np.array(xmat), rtol=0, atol=2 * atol)


@pytest.mark.parametrize("joints", [3, 4, 5, 6, 7])
def test_random_chains_against_mujoco(joints):
    model = random_model(joints, seed=joints)
    chain = chain_from_mujoco(model)
    data = mujoco.MjData(model)
    links = (joints - 1, 0, 1)
    Q, QD = states(joints, 5)
    both = jax.vmap(lambda q, qd: (link_frames(chain, q), point_motion(chain, q, qd, links, OFFSETS[:3])))
    out = both(jnp.asarray(Q), jnp.asarray(QD))
    for k, (q, qd) in enumerate(zip(Q, QD, strict=True)):
        data.qpos[:], data.qvel[:] = q, qd
        mujoco.mj_forward(model, data)
        (R, p), motion = jax.tree.map(lambda a, k=k: a[k], out)
        bodies = model.jnt_bodyid
        last = [i for i in range(joints) if i + 1 == joints or bodies[i + 1] != bodies[i]]
        for i in last:
            np.testing.assert_allclose(p[i], data.xpos[bodies[i]], atol=1e-10)
            np.testing.assert_allclose(R[i], data.xmat[bodies[i]].reshape(3, 3), atol=1e-10)
        for k, link in enumerate(links):
            if link not in last:
                continue
            body = int(bodies[link])
            x = data.xpos[body] + data.xmat[body].reshape(3, 3) @ OFFSETS[k]
            J, Jdot = np.zeros((3, joints)), np.zeros((3, joints))
            mujoco.mj_jac(model, data, J, None, x, body)
            mujoco.mj_jacDot(model, data, Jdot, None, x, body)
            np.testing.assert_allclose(motion.x[k], x, atol=1e-10)
            np.testing.assert_allclose(motion.J[k], J, atol=1e-10)
            np.testing.assert_allclose(motion.xd[k], J @ qd, atol=1e-10)
            np.testing.assert_allclose(motion.Jd_qd[k], Jdot @ qd, atol=1e-9)


def test_motion_against_derivatives(arm):
    chain = arm.chain
    Q, QD = states(6, 8)

    def place(q):
        return points_on_links(chain, q, LINKS, OFFSETS)

    def by_derivatives(q, qd):
        velocity = lambda q: jax.jvp(place, (q,), (qd,))[1]  # noqa: E731
        return place(q), velocity(q), jax.jacfwd(place)(q), jax.jvp(velocity, (q,), (qd,))[1]

    q, qd = jnp.asarray(Q), jnp.asarray(QD)
    expected = quick_jit(jax.vmap(by_derivatives))(q, qd)
    motion = quick_jit(jax.vmap(lambda q, qd: point_motion(chain, q, qd, LINKS, OFFSETS)))(q, qd)
    for name, value in zip(("x", "xd", "J", "Jd_qd"), expected, strict=True):
        np.testing.assert_allclose(getattr(motion, name), value, atol=1e-12, err_msg=name)
    J = quick_jit(jax.vmap(lambda q: point_jacobians(chain, q, LINKS, OFFSETS)))(q)
    np.testing.assert_allclose(J, expected[2], atol=1e-12)


def test_motion_follows_the_dtype(ur5, dtype):
    q = jnp.asarray(ur5.home, dtype)
    motion = point_motion(ur5.chain, q, q, LINKS, OFFSETS)
    assert {leaf.dtype for leaf in jax.tree.leaves(motion)} == {dtype}
    assert point_jacobians(ur5.chain, q, LINKS, OFFSETS).dtype == dtype


def test_a_point_of_the_world_does_not_move(ur5):
    q = jnp.asarray(ur5.home)
    motion = point_motion(ur5.chain, q, q, (-1,), np.array([[0.1, 0.2, 0.3]]))
    np.testing.assert_allclose(motion.x, [[0.1, 0.2, 0.3]])
    assert not jnp.any(motion.J)
    assert not jnp.any(motion.xd)
    assert not jnp.any(motion.Jd_qd)


def test_only_the_links_in_use_are_computed(ur5):
    text = str(
        jax.make_jaxpr(lambda q: points_on_links(ur5.chain, q, (1,), np.zeros((1, 3))))(jnp.zeros(6, jnp.float32))
    )
    assert text.count(" sin ") <= 2


@pytest.mark.parametrize("mode", ["fwd", "rev"])
def test_motion_is_differentiable_at_the_singular_arm(ur5, mode):
    q = jnp.zeros(6)  # stretched out, wrist axes in line

    def total(q, qd):
        motion = point_motion(ur5.chain, jnp.asarray(q), jnp.asarray(qd), LINKS, OFFSETS)
        return sum(jnp.sum(jnp.sin(leaf)) for leaf in jax.tree.leaves(motion))

    check_grads(total, (q, 0.3 + q), order=1, modes=(mode,), rtol=1e-4)


def test_wrong_arguments(ur5):
    q = jnp.zeros(6)
    with pytest.raises(ValueError, match=r"q has shape \(5,\); accepted: \(6,\)"):
        points_on_links(ur5.chain, q[:5], (0,), np.zeros((1, 3)))
    with pytest.raises(ValueError, match=r"accepted: -1 \(world\) to 5"):
        point_motion(ur5.chain, q, q, (6,), np.zeros((1, 3)))
    with pytest.raises(ValueError, match=r"offsets have shape \(2, 3\); accepted: \(1, 3\)"):
        point_jacobians(ur5.chain, q, (0,), np.zeros((2, 3)))
    with pytest.raises(ValueError, match="q has shape"):
        link_frames(ur5.chain, q[:3])


def test_no_points(ur5):
    q = jnp.zeros(6)
    motion = point_motion(ur5.chain, q, q, (), np.zeros((0, 3)))
    assert motion.J.shape == (0, 3, 6)
    assert motion.x.shape == motion.xd.shape == motion.Jd_qd.shape == (0, 3)
