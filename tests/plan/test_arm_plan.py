import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import TypeCheckError
from plan_scenes import scene

from hrcjax.geom.shape import box_distance
from hrcjax.plan import ArmPathParams, ArmPlanSizes, PotentialParams, arm_body, plan_arm, point_body
from hrcjax.plan.arm_plan import best_guess
from hrcjax.plan.arm_task import arm_task
from hrcjax.plan.guesses import straight_guess
from hrcjax.robot import load_arm

POINT = ArmPlanSizes(control=10, samples=32, iterations=10, polish=10, guesses=7, descent=80)
ARM_SIZES = ArmPlanSizes(control=8, samples=24, iterations=10, polish=8, guesses=9, waypoints=30, descent=60)
COARSE = arm_body(load_arm("ur5"), 0.03, floor=0.0)
Q_START, Q_GOAL = [-1.868, -1.015, 1.268, -1.823, -1.571, 0.066], [-2.881, -0.807, 1.182, -1.946, -1.571, 0.077]


def cast(tree, dtype=jnp.float64):
    return jax.tree.map(lambda x: jnp.asarray(x, dtype), tree)


def point_plan(potential, s, sizes=POINT):
    path = cast(ArmPathParams(joint_weight=0.0), s.start.dtype)
    return plan_arm(path, potential, point_body(), s.start, s.goal, s.distances, s.radius, s.lower, s.upper, sizes)


@jax.jit
def arm_among_boxes(potential, q_start, q_goal, center, half):
    wide = jnp.full(3, jnp.inf, q_start.dtype)

    def distances(x):
        return jax.vmap(box_distance, in_axes=(None, 0, 0))(x, center, half)

    radius = jnp.full(center.shape[0], 0.03, q_start.dtype)
    return plan_arm(
        cast(ArmPathParams(), q_start.dtype),
        potential,
        COARSE,
        q_start,
        q_goal,
        distances,
        radius,
        -wide,
        wide,
        ARM_SIZES,
    )


def boxes(*rows):
    """Three boxes: middle and half extents; those not named are far away."""
    far = ((9.0, 9.0, 9.0), (0.1, 0.1, 0.1))
    center, half = zip(*(*rows, *[far] * (3 - len(rows))), strict=True)
    return jnp.asarray(center), jnp.asarray(half)


def knobs(k_rep, zeta):
    return eqx.tree_at(lambda p: (p.k_rep, p.zeta), cast(PotentialParams(), k_rep.dtype), (k_rep, zeta))


def in_columns(k_rep, zeta):
    return point_plan(knobs(k_rep, zeta), scene("columns", k_rep.dtype))


@pytest.mark.slow
def test_many_settings_at_once_agree_with_one_and_all_say_what_they_are():
    k, zeta = jnp.asarray([1e-6, 1e-3, 1e-5, 1e-5]), jnp.asarray([1.5, 1.5, 4.0, 8.0])
    many = jax.jit(jax.vmap(in_columns))(k, zeta)
    assert (many.status[:3] & 14 == 14).all(), many.status
    np.testing.assert_allclose(many.violation[:3], 0, atol=5e-4)
    np.testing.assert_allclose(many.joints, many.tool)
    # K_rep = 1e-3 bends the path, and keeps it farther away than zeta asks for; zeta alone sets the distance of the others
    assert float(many.clearance[0]) < 0.02 < float(many.clearance[1]) - 0.01
    assert 0.0895 < float(many.clearance[2]) < 0.1
    assert float(many.length[0]) < float(many.length[1])
    # the goal itself is 15 cm from a column, of which 21 cm are asked: it opens from there as far as it can be
    assert float(many.clearance[3]) < 0.16
    assert np.isfinite(many.joints).all()
    one = jax.jit(in_columns)(k[1], zeta[1])
    np.testing.assert_allclose(one.joints, many.joints[1], atol=1e-6)
    steps = np.linalg.norm(np.diff(many.joints[:3], axis=1), axis=-1)
    np.testing.assert_allclose(steps, np.broadcast_to(steps.mean(1, keepdims=True), steps.shape), rtol=0.02)
    single = jax.jit(in_columns)(jnp.float32(1e-3), jnp.float32(1.5))
    assert {x.dtype.name for x in jax.tree.leaves(single)} == {"float32", "bool", "int32"}
    np.testing.assert_allclose(single.joints, one.joints, atol=1e-3)


def test_u_shaped_trap_is_noticed_and_left():
    """Open towards the start, the goal behind its bottom: attraction leads into it."""
    walls = jnp.asarray([[0.0, 0.3, 0], [0.0, -0.3, 0], [0.3, 0.0, 0]])
    half = jnp.asarray([[0.3, 0.03, 0.4], [0.3, 0.03, 0.4], [0.03, 0.33, 0.4]])
    wide = jnp.full(3, 3.0)

    def run(k_rep):
        def distances(x):
            return jax.vmap(box_distance, in_axes=(None, 0, 0))(x, walls, half)

        start, goal = jnp.asarray([-0.1, 0.01, 0.02]), jnp.asarray([0.8, 0.0, 0.0])
        path = cast(ArmPathParams(joint_weight=0.0))
        potential = cast(PotentialParams(zeta=2.0, k_rep=0.0))
        potential = eqx.tree_at(lambda p: p.k_rep, potential, k_rep)
        return plan_arm(path, potential, point_body(), start, goal, distances, jnp.full(3, 0.03), -wide, wide, POINT)

    found = jax.jit(run)(jnp.asarray(1e-4))
    assert not bool(found.reached)
    assert int(found.status) == 14 and int(found.guess) != 1
    assert float(found.clearance) > 0.029
    straight = 0.9
    assert 1.1 * straight < float(found.length) < 2.5 * straight


@pytest.mark.slow
def test_arm_leaves_a_u_shaped_trap():
    """The tool stands in a U of three walls, the goal is behind its bottom."""
    start, goal = jnp.asarray(Q_START), jnp.asarray(Q_GOAL)
    a, b = COARSE.places(start).tool, COARSE.places(goal).tool
    x, y = 0.5 * a[0] + 0.5 * b[0], 0.5 * a[1] + 0.5 * b[1]
    bottom = ((float(x), float(y), 0.16), (0.02, 0.14, 0.16))
    arms = [((float(x) - 0.16, float(y) + dy, 0.05), (0.16, 0.02, 0.05)) for dy in (-0.12, 0.30)]
    potential = cast(PotentialParams(zeta=1.5))
    found = arm_among_boxes(potential, start, goal, *boxes(bottom, *arms))
    free = arm_among_boxes(potential, start, goal, *boxes())
    assert int(free.status) == 15 and int(free.guess) == 0
    assert int(found.status) & 14 == 14, (found.status, found.violation)
    assert not bool(found.reached) or int(found.guess) != 1
    assert float(found.clearance) > 0.0145
    assert float(found.length) > float(free.length) + 0.05
    np.testing.assert_array_equal(found.joints[0], start)
    np.testing.assert_array_equal(found.joints[-1], goal)


def test_best_guess_keeps_its_distances_first_then_costs_least_and_ties_go_to_the_first():
    s = scene("spheres", centers=[[0.4, 0.5, 0.1]], radius=0.03)
    path = cast(ArmPathParams(joint_weight=0.0, omega3=0.0))
    t = arm_task(
        path, cast(PotentialParams(zeta=2.0)), point_body(), s.start, s.goal, s.distances, s.radius, s.lower, s.upper
    )
    straight = straight_guess(t, POINT)
    hump = jnp.sin(jnp.linspace(0.3, 2.8, len(straight)))[:, None] * jnp.asarray([0.0, 0, 1])
    through, low, high = straight, straight + 0.2 * hump, straight + 0.4 * hump

    @jax.jit
    def pick(*found):
        return best_guess(t, jnp.stack(found), POINT)

    assert int(pick(through, high, low)) == 2
    assert int(pick(high, low, low)) == 1
    assert int(pick(low + 1e-12, low, high)) == 0
    assert int(pick(jnp.full_like(low, jnp.nan), through, through)) == 1


def test_wrong_shapes_and_sizes_are_refused():
    s = scene()
    with pytest.raises((ValueError, TypeCheckError), match="q_goal"):
        plan_arm(
            ArmPathParams(),
            PotentialParams(),
            point_body(),
            s.start,
            jnp.zeros(6),
            s.distances,
            s.radius,
            s.lower,
            s.upper,
            POINT,
        )
    for wrong in ({"control": 4}, {"samples": 2}, {"guesses": 0}, {"waypoints": 3}, {"descent": 0}):
        with pytest.raises(ValueError, match="accepted"):
            ArmPlanSizes(**wrong)
