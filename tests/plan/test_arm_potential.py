from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from plan_scenes import scene

from hrcjax.geom.rotation import rotation_vector
from hrcjax.plan import PotentialParams, arm_body, arm_force, arm_potential, point_body, potential, repulsion_ratio
from hrcjax.robot import load_arm, tool_frame
from hrcjax.robot.ik import LEVER

ARM = load_arm("ur5")


def params(dtype=jnp.float64):
    return jax.tree.map(lambda x: jnp.asarray(x, dtype), PotentialParams())


def _arm(p, body, rest, x):
    return arm_potential(p, body, x, *rest)


def _point(p, rest, x):
    return potential(p, x, *rest)


@pytest.mark.parametrize("kind", ["spheres", "columns"])
def test_a_point_has_the_potential_of_the_point_robot(kind, dtype):
    s, body = scene(kind, dtype), point_body()
    places = jnp.asarray(np.random.default_rng(0).uniform(0, 0.8, (40, 3)), dtype)
    for scaled in (True, False):
        rest = (s.goal, s.distances, s.radius, scaled)
        mine = jax.vmap(partial(_arm, params(dtype), body, rest))(places)
        theirs = jax.vmap(partial(_point, params(dtype), rest))(places)
        np.testing.assert_array_equal(mine, theirs)
        assert mine.dtype == dtype


def test_repulsion_does_not_depend_on_how_densely_links_are_covered():
    q = jnp.asarray(ARM.home) + 0.2
    middle = arm_body(ARM, 0.001).places(q).points[12]
    goal, radius = jnp.asarray([0.6, 0.2, 0.2]), jnp.asarray([0.03])

    def ball(x):
        return (jnp.linalg.norm(x - middle - jnp.asarray([0.1, 0.1, 0])) - 0.03)[None]

    bodies = [arm_body(ARM, inflation) for inflation in (0.0005, 0.005)]
    ratio = [float(repulsion_ratio(params(), body, q, goal, ball, radius)) for body in bodies]
    assert ratio[0] > 1e-4
    np.testing.assert_allclose(ratio[1], ratio[0], rtol=0.35)


def test_force_moves_the_tool_towards_the_goal_and_the_arm_from_obstacles():
    body = arm_body(ARM, 0.02)
    q = jnp.asarray(ARM.home)
    goal = body.places(q).tool + jnp.asarray([0.05, 0.02, -0.03])

    def far(x):
        return jnp.linalg.norm(x - jnp.asarray([5.0, 0, 0]))[None]

    F = jax.jit(lambda q: arm_force(params(), body, q, goal, far, jnp.asarray([0.03])))(q)
    J = body.motion(q).J_tool
    np.testing.assert_allclose(
        F, 0.03 * J.T @ (goal - body.places(q).tool), atol=1e-12
    )  # eq. 2c, by the principle of work
    elbow = body.places(q).points[10]

    def near(x):
        return (jnp.linalg.norm(x - elbow - jnp.asarray([0.12, 0, 0])) - 0.03)[None]

    push = jax.jit(lambda q: arm_force(params(), body, q, goal, near, jnp.asarray([0.03])))(q) - F
    assert float((body.motion(q).J[10] @ push)[0]) < 0


def test_orientation_attracts_as_from_the_lever():
    body = arm_body(ARM, 0.02)
    q = jnp.asarray(ARM.home) + 0.1
    R, p = tool_frame(ARM, q)

    def far(x):
        return jnp.asarray([9.0])

    def U(axes):
        return arm_potential(params(), body, q, p, far, jnp.asarray([0.03]), True, axes)

    np.testing.assert_allclose(U(R), 0, atol=1e-15)
    turned = rotation_vector(jnp.asarray([0.0, 0.3, 0.4])) @ R
    np.testing.assert_allclose(U(turned), 0.03 / 2 * (LEVER * 0.5) ** 2, rtol=1e-9)
    with pytest.raises(ValueError, match="no axes"):
        arm_potential(params(), point_body(), p, p, far, jnp.asarray([0.03]), True, R)


def test_ratio_is_finite_at_the_goal_and_on_obstacles_and_scales_with_k_rep_over_k_att():
    s, body = scene("spheres"), point_body()

    def at(p, x):
        return repulsion_ratio(p, body, x, s.goal, s.distances, s.radius)

    assert float(at(params(), s.goal)) == 0
    inside = jnp.asarray([0.30, 0.55, 0.20])
    value, slope = jax.value_and_grad(at, argnums=1)(params(), inside)
    assert float(value) > 1 and np.isfinite(slope).all()
    assert np.isfinite(jax.grad(at, argnums=1)(params(), s.goal)).all()
    near = inside + jnp.asarray([0.05, 0, 0])
    double = jax.tree.map(lambda x: x, PotentialParams(k_att=0.06, k_rep=2e-5))
    np.testing.assert_allclose(at(double, near), at(PotentialParams(), near), rtol=1e-12)
