import jax
import jax.numpy as jnp
import numpy as np
import pytest
from plan_scenes import scene

from hrcjax.plan import ArmPathParams, ArmPlanSizes, PotentialParams, arm_body, point_body
from hrcjax.plan.arm_optimise import path_cost, polished, ramped, samples_of
from hrcjax.plan.arm_task import arm_task
from hrcjax.plan.guesses import straight_guess
from hrcjax.robot import load_arm

SIZES = ArmPlanSizes(control=7, samples=13, iterations=8, polish=25)
COARSE = arm_body(load_arm("ur5"), 0.03, floor=0.0)
STIFF = 300.0
"""Of the penalties in the comparison of derivatives: soft enough that all parts of the cost show."""


def params(kind):
    path = ArmPathParams() if kind == "arm" else ArmPathParams(joint_weight=0.0)
    return [jax.tree.map(jnp.float64, p) for p in (path, PotentialParams(k_rep=1e-4, zeta=3.0))]


def task(kind, s=None):
    s = scene("columns") if s is None else s
    if kind == "point":
        return arm_task(*params(kind), point_body(), s.start, s.goal, s.distances, s.radius, s.lower, s.upper)
    q_start, q_goal = (
        jnp.asarray([-1.87, -1.02, 1.27, -1.82, -1.57, 0.07]),
        jnp.asarray([-2.88, -0.81, 1.18, -1.95, -1.57, 6.3]),
    )
    upper = jnp.asarray([0.5, 0.8, 0.3])
    return arm_task(*params(kind), COARSE, q_start, q_goal, s.distances, s.radius, -upper, upper)


def bent(t, size=0.3):
    inner = straight_guess(t, SIZES)
    return inner + size * jnp.asarray(np.random.default_rng(4).normal(size=inner.shape))


@pytest.mark.parametrize("kind", ["point", "arm"])
def test_gradient_is_that_of_the_cost_and_the_matrix_is_positive(kind):
    """The arm also beyond a joint's range, below the floor, out of bounds and in itself."""
    t = task(kind)
    inner = bent(t, 0.3 if kind == "point" else 0.9)
    found = jax.jit(lambda x: path_cost(t, x, STIFF, SIZES.samples))(inner)

    def cost(x):
        return path_cost(t, x, STIFF, SIZES.samples, curved=False)

    true = jax.jit(jax.grad(lambda x: cost(x).cost))(inner)
    np.testing.assert_allclose(found.gradient, true, atol=1e-10 * np.abs(true).max())
    np.testing.assert_allclose(found.matrix, found.matrix.T, rtol=1e-9, atol=1e-9 * np.abs(found.matrix).max())
    assert np.linalg.eigvalsh(found.matrix)[0] > 0
    assert float(found.violation) > (0.001 if kind == "point" else 0.05)
    assert cost(inner).matrix.size == 0


def test_matrix_is_the_hessian_of_a_straight_path_in_free_space():
    """There the curvature of length and bending energy is all there is, but along the path and for the bending's length."""
    t = task("point", scene("spheres", centers=[[5.0, 5, 5]]))
    inner = straight_guess(t, SIZES)
    exact = jax.jit(jax.jacfwd(lambda x: path_cost(t, x, STIFF, SIZES.samples, curved=False).gradient))(inner)
    mine = jax.jit(lambda x: path_cost(t, x, STIFF, SIZES.samples).matrix)(inner)
    across = np.cross(np.asarray(t.goal - t.q_start), [0, 0, 1.0])
    P = np.kron(np.eye(len(inner)), across[:, None] / np.linalg.norm(across))
    np.testing.assert_allclose(
        P.T @ np.asarray(mine) @ P, P.T @ np.asarray(exact).reshape(mine.shape) @ P, rtol=1e-8, atol=1e-8
    )


def test_shortest_way_round_a_ball():
    """Two tangents and an arc, in closed form; the distance (zeta - 1) radius is kept."""
    r, R = 0.1, 0.3  # zeta 3
    s = scene("spheres", centers=[[0.0, 0, 0.01]], radius=r, start=np.array([-1.0, 0, 0]), goal=np.array([1.0, 0, 0]))
    t = task("point", s)
    path = ArmPathParams(joint_weight=0.0, omega2=1e-5, omega3=0.0)
    sizes = ArmPlanSizes(control=16, samples=60, iterations=12, polish=25)
    t = t._replace(path=jax.tree.map(jnp.float64, path))

    @jax.jit
    def solved():
        inner = polished(t, ramped(t, straight_guess(t, sizes), sizes), sizes)
        found = path_cost(t, inner, t.path.penalty, sizes.samples)
        return samples_of(t, inner, 400), found.gradient, found.violation

    points, gradient, violation = solved()
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    tangents = 2 * np.sqrt(1 - R * R) + R * (np.pi - 2 * np.arccos(R))
    np.testing.assert_allclose(length, tangents, rtol=4e-3)
    assert abs(float(violation)) < 1.2e-3
    assert np.abs(gradient).max() < 1e-6
