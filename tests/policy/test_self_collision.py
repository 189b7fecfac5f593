"""Self-collision and goals on a moving frame, against what is not our code."""

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

from hrcjax.geom.point_motion import PointMotion
from hrcjax.policy import (
    CollisionParams,
    MovingFrame,
    ResolveParams,
    add,
    frame_at_rest,
    pairs_apart,
    pull,
    pullback_joints,
    resolve,
    riding,
    self_collision,
)
from hrcjax.policy.collision import collision
from hrcjax.robot import load_arm, point_motion

PARAMS = CollisionParams(r_act=0.2)


def test_pairs_are_those_of_links_that_are_no_neighbours() -> None:
    first, second = pairs_apart((0, 0, 1, 2, 4))
    assert set(zip(first.tolist(), second.tolist(), strict=True)) == {(0, 3), (1, 3), (0, 4), (1, 4), (2, 4), (3, 4)}


def test_the_pullback_is_that_of_the_relative_position() -> None:
    """Against the general pullback, by automatic differentiation of the difference of two points."""
    arm = load_arm("ur5e")
    links, offsets, radii = arm.control_links, arm.control_offsets, jnp.asarray(arm.control_radii)
    rng = np.random.default_rng(0)
    q, qd = jnp.asarray([0.2, -1.2, 2.6, -1.0, -1.5, 0.1]), jnp.asarray(rng.normal(size=6))
    first, second = pairs_apart(links)
    motion = point_motion(arm.chain, q, qd, links, offsets)
    nearest = np.argsort(np.linalg.norm(motion.x[first] - motion.x[second], axis=1))[:3]
    first, second = first[nearest], second[nearest]
    found = self_collision(PARAMS, motion, radii, first, second)

    def leaf(i: int, j: int):
        def of(x, xd):
            size = jnp.linalg.norm(x)
            return collision(PARAMS, size - radii[i] - radii[j], x / size, xd)

        return of

    total = pullback_joints(jnp.zeros(6), jnp.zeros(6))
    for i, j in zip(first.tolist(), second.tolist(), strict=True):
        position = lambda q, i=i, j=j: (lambda x: x[i] - x[j])(point_motion(arm.chain, q, qd, links, offsets).x)  # noqa: E731
        total = add(total, pull(position, leaf(i, j), q, qd))
    assert np.abs(total.f).max() > 1e-3, "something is near"
    np.testing.assert_allclose(found.M, total.M, atol=1e-9)
    np.testing.assert_allclose(found.f, total.f, atol=1e-8)


def fold(on: bool) -> float:
    """Least gap of two spheres that an elbow drives into each other, both links 0.4 m long."""

    def body(q, qd):
        def places(q):
            inner = 0.02 * jnp.stack([jnp.cos(q[0]), jnp.sin(q[0]), jnp.zeros_like(q[0])])
            elbow = 0.4 * jnp.stack([jnp.cos(q[0]), jnp.sin(q[0]), jnp.zeros_like(q[0])])
            end = elbow + 0.4 * jnp.stack([jnp.cos(q[0] + q[1]), jnp.sin(q[0] + q[1]), jnp.zeros_like(q[0])])
            return jnp.stack([inner, end])

        def speed(q):
            return jax.jvp(places, (q,), (qd,))

        (x, xd), (_, Jd_qd) = jax.jvp(speed, (q,), (qd,))
        return PointMotion(x, xd, jax.jacfwd(places)(q), Jd_qd)

    radii, pair = jnp.full(2, 0.05), (np.array([0]), np.array([1]))

    def step(state, _):
        q, qd = state
        motion = body(q, qd)
        drive = pullback_joints(jnp.full(2, 0.05), jnp.asarray([0.0, 2.0]) - 1.0 * qd)
        total = add(drive, self_collision(PARAMS, motion, radii, *pair)) if on else drive
        qdd = resolve(ResolveParams(), total)
        qd = qd + 0.004 * qdd
        return (q + 0.004 * qd, qd), jnp.linalg.norm(motion.x[0] - motion.x[1]) - 0.1

    return float(jnp.min(jax.lax.scan(step, (jnp.zeros(2), jnp.zeros(2)), None, length=1000)[1]))


def test_two_links_do_not_fold_into_each_other() -> None:
    assert fold(on=False) < -0.05 and fold(on=True) > 0.0


def test_centres_that_coincide_give_finite_values() -> None:
    here = jnp.zeros((2, 3))
    body = PointMotion(here, here, jnp.ones((2, 3, 2)), here)
    found = jax.jacfwd(lambda x: self_collision(
        PARAMS, PointMotion(x, here, body.J, here), jnp.full(2, 0.1), np.array([0]), np.array([1])
    ).f)(here)  # fmt: skip
    assert np.isfinite(found).all()


def test_points_that_ride_on_a_frame_move_as_it_does() -> None:
    """Against differences of a motion in closed form: a screw with growing spin."""
    axis = np.array([0.6, 0.0, 0.8])
    offsets = np.array([[0.1, 0.2, -0.3], [0.0, 0.0, 0.0]])

    def place(t: float) -> np.ndarray:
        R = Rotation.from_rotvec(axis * (0.4 + 1.5 * t + 0.7 * t**2)).as_matrix()
        return np.array([np.sin(t), t**2, 0.3 * t]) + offsets @ R.T

    t, h = 0.3, 1e-4
    R = Rotation.from_rotvec(axis * (0.4 + 1.5 * t + 0.7 * t**2)).as_matrix()
    frame = MovingFrame(*map(jnp.asarray, (
        R, [np.sin(t), t**2, 0.3 * t], [np.cos(t), 2 * t, 0.3], axis * (1.5 + 1.4 * t), [-np.sin(t), 2.0, 0.0], axis * 1.4
    )))  # fmt: skip
    x, v, a = riding(frame, jnp.asarray(offsets))
    np.testing.assert_allclose(x, place(t), atol=1e-12)
    np.testing.assert_allclose(v, (place(t + h) - place(t - h)) / (2 * h), atol=1e-7)
    np.testing.assert_allclose(a, (place(t + h) - 2 * place(t) + place(t - h)) / h**2, atol=1e-6)
    still = riding(frame_at_rest(jnp.asarray(R), jnp.zeros(3)), jnp.asarray(offsets))
    np.testing.assert_allclose(still[0], offsets @ R.T)
    assert not np.any(still[1]) and not np.any(still[2])
