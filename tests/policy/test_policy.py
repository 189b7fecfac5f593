"""The whole policy: against plain NumPy, its derivatives by every number, and how it behaves."""

import inspect

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.geom.point_motion import PointMotion
from hrcjax.policy import (
    CollisionParams,
    JointLimits,
    PolicyParams,
    PostureParams,
    Repel,
    TargetParams,
    add,
    collision,
    combine,
    limit_acceleration,
    policy_acceleration,
    pull,
    pullback_points,
    repulsion,
    resolve,
    target,
)
from hrcjax.reference import policy as serial

ORDER = ("q", "qd", "tool", "goal", "goal_velocity", "goal_acceleration", "body", "d", "g", "limits", "posture")


def cell(seed, dtype=jnp.float64, points=3, joints=4):
    """All arguments but the params, drawn at random."""
    rng = np.random.default_rng(seed)

    def draw(*shape):
        return jnp.asarray(rng.normal(size=shape), dtype)

    def motion(count):
        return PointMotion(x=draw(count, 3), xd=draw(count, 3), J=draw(count, 3, joints), Jd_qd=draw(count, 3))

    limits = JointLimits(*(jnp.full(joints, v, dtype) for v in (-3.0, 3.1, 3.0, 10.0)))
    arguments = {"q": draw(joints), "qd": draw(joints), "tool": motion(3), "body": motion(points), "limits": limits}
    for name in ("goal", "goal_velocity", "goal_acceleration"):
        arguments[name] = draw(3, 3)
    return arguments | {"d": jnp.abs(draw(points)) * 0.2, "g": draw(points, 3), "posture": draw(joints)}


def singular(seed):
    """On the goal, in contact, at rest, one joint at each end, one in the posture."""
    a = cell(seed)
    a["goal"], a["goal_velocity"] = a["tool"].x, jnp.zeros_like(a["goal"])
    a["d"] = jnp.zeros_like(a["d"])
    a["qd"] = jnp.zeros_like(a["qd"])
    for part in ("tool", "body"):
        a[part] = eqx.tree_at(lambda m: m.xd, a[part], jnp.zeros_like(a[part].xd))
    a["q"] = a["q"].at[0].set(a["limits"].q_min[0]).at[1].set(a["limits"].q_max[1])
    a["posture"] = a["q"]
    return a


def fast(seed):
    """As singular, but moving near and above the top speed."""
    return singular(seed) | {"qd": jnp.array([0.01, 1.6, -1.65, 3.0])}


on = PolicyParams(posture=PostureParams(weight=0.05))


@jax.jit
def accelerate(params, arguments):
    return policy_acceleration(params, *(arguments[name] for name in ORDER))


@pytest.mark.parametrize("make", [cell, singular, fast])
def test_agrees_with_numpy(make):
    for seed in range(5):
        for params in (PolicyParams(), on, eqx.tree_at(lambda p: p.collision.isotropy, on, 0.2)):
            arguments = make(seed)
            expected = serial.policy_acceleration(params, *(arguments[name] for name in ORDER))
            np.testing.assert_allclose(accelerate(params, arguments), expected, rtol=1e-8, atol=1e-10)


def repels(seed, points=3):
    """What stands and people, drawn at random, some out of reach."""
    rng = np.random.default_rng(seed)

    def one(k_rep):
        numbers = (rng.uniform(0, 0.4, points), rng.uniform(0, 1, points), rng.uniform(-0.01, 0.3, points))
        return Repel(jnp.asarray(k_rep), *map(jnp.asarray, (*numbers, rng.normal(size=(points, 3)))))

    return one(1e-5), one(1e-4)


def test_repulsion_agrees_with_numpy_and_adds_its_own_pullback():
    run = jax.jit(lambda a, repel: policy_acceleration(on, *(a[name] for name in ORDER), repel=repel))
    sum_of = jax.jit(lambda a, repel: combine(on, *(a[name] for name in ORDER), repel=repel))

    @jax.jit
    def apart(a, repel):
        total = combine(on, *(a[name] for name in ORDER))
        for r in repel:
            leaf = jax.vmap(lambda *point, k=r.k_rep: repulsion(on.repulsion, k, *point))
            M, acceleration = leaf(r.reach, r.fade, r.d, r.g, a["body"].xd)
            total = add(total, pullback_points(a["body"].J, a["body"].Jd_qd, M, acceleration))
        return total

    for seed in range(3):
        arguments, repel = cell(seed), repels(seed)
        expected = serial.policy_acceleration(on, *(arguments[name] for name in ORDER), repel=repel)
        np.testing.assert_allclose(run(arguments, repel), expected, rtol=1e-8, atol=1e-10)
        assert np.abs(expected - accelerate(on, arguments)).max() > 1e-3
        for one, other in zip(
            jax.tree.leaves(sum_of(arguments, repel)), jax.tree.leaves(apart(arguments, repel)), strict=True
        ):
            np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)


def test_follows_dtype_even_with_params_of_another(dtype):
    arguments = cell(0, dtype)
    wide = jax.tree.map(np.float64, PolicyParams())
    got = accelerate(wide, arguments)
    assert got.dtype == dtype
    reference = accelerate(PolicyParams(), cell(0, jnp.float64))
    np.testing.assert_allclose(got, reference, rtol=2e-4 if dtype == jnp.float32 else 1e-12, atol=1e-5)


def test_batch_is_a_loop():
    batch = jax.tree.map(lambda *parts: jnp.stack(parts), *(cell(seed) for seed in range(3)))
    together = jax.vmap(accelerate, in_axes=(None, 0))(PolicyParams(), batch)
    for seed in range(3):
        np.testing.assert_allclose(together[seed], accelerate(PolicyParams(), cell(seed)), rtol=1e-9)


# A margin off 0 keeps contact off the kink at d = margin.
numbers, tree = jax.tree.flatten(eqx.tree_at(lambda p: p.collision.margin, on, 0.003))


def scalar(numbers, arguments):
    asked = policy_acceleration(jax.tree.unflatten(tree, list(numbers)), *(arguments[name] for name in ORDER))
    return jnp.dot(jnp.asarray([0.3, -0.7, 1.0, 0.2], asked.dtype), asked)


values = jax.jit(jax.vmap(scalar, in_axes=(0, None)))
reverse, forward = jax.jit(jax.grad(scalar, argnums=(0, 1))), jax.jit(jax.jacfwd(scalar))


@pytest.mark.parametrize("make", [cell, singular, fast])
def test_derivative_by_every_number(make):
    """Central differences, one number at a time, against the reverse and the forward derivative."""
    arguments, at = make(3), jnp.asarray(numbers)
    step = 1e-5 * jnp.maximum(jnp.abs(at), 1e-2)
    ends = values(jnp.concatenate([at + jnp.diag(step), at - jnp.diag(step)]), arguments)
    central = (ends[: at.size] - ends[at.size :]) / (2 * step)
    by_numbers, by_state = reverse(at, arguments)
    assert jnp.isfinite(by_numbers).all()
    np.testing.assert_allclose(by_numbers, central, rtol=2e-5, atol=1e-6 * float(jnp.abs(central).max()))
    np.testing.assert_allclose(forward(at, arguments), by_numbers, rtol=1e-9, atol=1e-9)
    for part in jax.tree.leaves(by_state):
        assert jnp.isfinite(part).all()


@pytest.mark.slow
@pytest.mark.parametrize("make", [cell, singular, fast])
def test_derivatives_are_finite_in_float32(make):
    arguments = jax.tree.map(lambda v: v.astype(jnp.float32), make(1))
    for part in jax.tree.leaves(reverse(jnp.asarray(numbers, jnp.float32), arguments)):
        assert jnp.isfinite(part).all()


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("goal", lambda v: v[:2], "tool points wants one goal"),
        ("goal_velocity", lambda v: v[:2], "tool points wants one goal"),
        ("d", lambda v: v[:2], "control points wants one distance"),
        ("g", lambda v: v[:, :2], "control points wants one distance"),
        ("q", lambda v: v[:3], "want 3 joints"),
    ],
)
def test_wrong_shapes_are_named(name, change, message):
    arguments = cell(0)
    arguments[name] = change(arguments[name])
    with pytest.raises(ValueError, match=message):
        inspect.unwrap(combine)(PolicyParams(), *(arguments[key] for key in ORDER))


# ---------------------------------------------------------------- behaviour

CENTRE, RADIUS = jnp.array([0.0, 0.02, 0.0]), 0.2


def sphere(x):
    return jnp.linalg.norm(x - CENTRE) - RADIUS


def point_mass(params, goal, x, xd, obstacle=True):
    """The acceleration of a free point: phi is the identity."""

    def to_goal(x, xd):
        return target(params.target, x, xd, goal, jnp.zeros(3), jnp.zeros(3))

    def off_sphere(x, xd):
        d, g = jax.value_and_grad(sphere)(x)
        return collision(params.collision, d, g, xd)

    pulled = pull(lambda q: q, to_goal, x, xd)
    if obstacle:
        pulled = add(pulled, pull(lambda q: q, off_sphere, x, xd))
    return resolve(params.resolve, pulled)


def fly(acceleration, x, steps=4000, dt=0.005):
    def step(state, _):
        x, xd = state
        xdd = acceleration(x, xd)
        xd = xd + dt * xdd
        x = x + dt * xd
        return (x, xd), (x, xd, xdd)

    return jax.jit(lambda x: jax.lax.scan(step, (x, jnp.zeros_like(x)), None, length=steps)[1])(x)


@pytest.mark.parametrize("isotropy", [0.05, 0.0])
def test_a_point_goes_round_a_sphere_to_its_goal(isotropy):
    params = PolicyParams(collision=CollisionParams(isotropy=isotropy))
    goal = jnp.array([0.6, 0.0, 0.0])
    x, xd, xdd = fly(lambda x, xd: point_mass(params, goal, x, xd), jnp.array([-0.6, 0.0, 0.0]))
    clearance = jnp.linalg.norm(x - CENTRE, axis=1) - RADIUS
    np.testing.assert_allclose(x[-1], goal, atol=5e-3)
    assert clearance.min() > 0.0
    assert jnp.abs(x[:, 1]).max() > RADIUS - 0.02  # it did go round
    assert jnp.linalg.norm(xd, axis=1).max() < 0.7  # kp / kd = 0.5 m/s and some push
    assert jnp.linalg.norm(jnp.diff(xdd, axis=0), axis=1).max() < 0.05  # no jumps


@pytest.mark.parametrize("speed", [0.25, 1.0])
def test_nothing_outweighs_an_obstacle_at_the_skin(speed):
    """A strong target (metric 10) inside a sphere, straight ahead: the point stops before it, without a bounce, and stays off."""
    params = PolicyParams(
        target=TargetParams(kp=4.0 * speed, kd=4.0, eps=0.02, metric_max=10.0),
        collision=CollisionParams(r_act=0.15, s_rep=0.05),
    )
    way = jnp.array([0.0, 0.0, 1.0])
    x, xd, _ = fly(lambda x, xd: point_mass(params, CENTRE, x, xd), CENTRE + 0.6 * way, steps=1000, dt=0.008)
    clearance = jnp.linalg.norm(x - CENTRE, axis=1) - RADIUS
    assert jnp.abs(xd[:, 2]).max() > 0.8 * speed, "it came at full speed"
    assert clearance.min() > 0.02 and clearance[-1] > 0.03, (clearance.min(), clearance[-1])
    np.testing.assert_allclose(xd[-1], 0.0, atol=1e-3)


def test_orientation_gives_way_before_position_and_position_before_clearance():
    """A tool point and points on two axes, one of which has something in its way: all turns rather than moves."""

    def rod(q):
        """Place and rotation vector about it, small: the tool point and points 0.5 m along x and y."""
        arms = 0.5 * jnp.eye(3)[:2]
        return jnp.concatenate([q[None, :3], q[:3] + arms + jnp.cross(q[3:], arms)])

    q, still = jnp.zeros(6), jnp.zeros((3, 3))
    limits = JointLimits(jnp.full(6, -9.0), jnp.full(6, 9.0), jnp.full(6, 9.0), jnp.full(6, 99.0))
    motion = motion_of(rod, q, q)

    @jax.jit
    def asked(share, blocked):
        params = eqx.tree_at(lambda p: p.target.orientation_weight, PolicyParams(), share)
        body = jax.tree.map(lambda v: v[blocked][None], motion)
        a = policy_acceleration(
            params, q, q, motion, rod(q), still, still, body, jnp.array([0.03]), jnp.array([[0.0, 0, 1]]), limits, q
        )  # fmt: skip
        return jnp.einsum("ptj,j->pt", motion.J, a)[:, 2]

    push = 2.0 * np.exp(-0.3)
    tip = asked(0.05, jnp.asarray(1))
    assert tip[1] > 0.9 * push > 9 * abs(tip[0]), "it turns, and the tool point stays"
    assert asked(1.0, jnp.asarray(1))[1] < tip[1]
    assert asked(0.05, jnp.asarray(0))[0] > 0.8 * push, "what is in the way of the tool point itself moves it"


def test_without_the_collision_leaf_it_goes_straight_through():
    goal = jnp.array([0.6, 0.0, 0.0])
    x, *_ = fly(lambda x, xd: point_mass(PolicyParams(), goal, x, xd, obstacle=False), jnp.array([-0.6, 0.0, 0.0]))
    np.testing.assert_allclose(x[:, 1:], 0.0, atol=1e-12)
    np.testing.assert_allclose(x[-1], goal, atol=5e-3)


def test_energy_of_the_target_leaf_does_not_grow():
    p = TargetParams()
    grid = jnp.linspace(0.0, 2.0, 20001)
    force = jnp.minimum(20 * grid, 1.0) * p.kp * grid / (grid + p.eps)
    potential = jnp.concatenate([jnp.zeros(1), jnp.cumsum((force[1:] + force[:-1]) / 2) * grid[1]])

    def acceleration(x, xd):
        return target(p, x, xd, jnp.zeros(3), jnp.zeros(3), jnp.zeros(3))[1]

    x, xd, _ = fly(acceleration, jnp.array([0.5, -0.3, 0.2]), dt=0.002)
    energy = jnp.sum(xd**2, axis=1) / 2 + jnp.interp(jnp.linalg.norm(x, axis=1), grid, potential)
    assert jnp.diff(energy).max() < 1e-6 * energy[0]
    assert energy[-1] < 0.01 * energy[0]


LENGTHS = (0.5, 0.4)


def two_links(q):
    """Elbow and tip of a planar arm, in the plane z = 0."""
    elbow = LENGTHS[0] * jnp.stack([jnp.cos(q[0]), jnp.sin(q[0]), jnp.zeros_like(q[0])])
    fore = LENGTHS[1] * jnp.stack([jnp.cos(q[0] + q[1]), jnp.sin(q[0] + q[1]), jnp.zeros_like(q[0])])
    return jnp.stack([elbow, elbow + fore / 2, elbow + fore])


def motion_of(phi, q, qd):
    (x, xd), (_, Jd_qd) = jax.jvp(lambda q: jax.jvp(phi, (q,), (qd,)), (q,), (qd,))
    return PointMotion(x, xd, jax.jacfwd(phi)(q), Jd_qd)


def two_link_acceleration(params, limits, goal, centre, q, qd, posture):
    body = motion_of(two_links, q, qd)
    tool = jax.tree.map(lambda v: v[2:], body)
    d, g = jax.vmap(jax.value_and_grad(lambda x: jnp.linalg.norm(x - centre) - 0.1))(body.x)
    still = jnp.zeros((1, 3), q.dtype)
    return policy_acceleration(params, q, qd, tool, goal[None], still, still, body, d, g, limits, posture)


@pytest.mark.parametrize("stretched", [False, True])
def test_a_planar_arm_reaches_its_goal_and_keeps_off(stretched):
    limits = JointLimits(jnp.full(2, -3.0), jnp.full(2, 3.0), jnp.full(2, 2.0), jnp.full(2, 20.0))
    goal, centre = jnp.array([0.2, 0.6, 0.0]), jnp.array([0.85, 0.6, 0.0])
    start = jnp.array([-0.6, 0.0 if stretched else 0.8])

    def step(state, _):
        q, qd = state
        asked = two_link_acceleration(PolicyParams(), limits, goal, centre, q, qd, start)
        qdd, _ = limit_acceleration(asked, q, qd, limits, 0.008)
        qd = qd + 0.008 * qdd
        q = q + 0.008 * qd
        points = two_links(q)
        return (q, qd), (q, qd, points[2], jnp.linalg.norm(points - centre, axis=1).min() - 0.1)

    run = jax.jit(lambda q: jax.lax.scan(step, (q, jnp.zeros(2)), None, length=4000)[1])
    q, qd, tip, clearance = run(start)
    np.testing.assert_allclose(tip[-1], goal, atol=5e-3)
    assert clearance.min() > 0.0
    np.testing.assert_allclose(qd[-1], 0.0, atol=1e-3)
    assert jnp.all(jnp.abs(qd) <= 2.0) and jnp.all(jnp.abs(q) <= 3.0)


def test_signs_of_the_joint_leaves():
    """With nothing else to do: off the near end, towards the posture, against the speed."""
    limits = JointLimits(jnp.full(2, -3.0), jnp.full(2, 3.0), jnp.full(2, 2.0), jnp.full(2, 20.0))
    far = jnp.array([50.0, 0.0, 0.0])

    @jax.jit
    def asked(params, q, qd, posture=(0.0, 0.0)):
        quiet = eqx.tree_at(lambda p: (p.target.metric_max, p.target.metric_min), params, (0.0, 0.0))
        q, qd, posture = (jnp.asarray(v) for v in (q, qd, posture))
        return two_link_acceleration(quiet, limits, far, far, q, qd, posture)

    push = asked(PolicyParams(), [2.999, -2.999], [0.0, 0.0])
    assert push[0] < -1.0 and push[1] > 1.0
    drag = asked(PolicyParams(), [0.0, 0.0], [0.5, -0.5])
    assert drag[0] < -0.1 and drag[1] > 0.1
    brake = asked(PolicyParams(), [0.0, 0.0], [1.75, -1.75])
    assert brake[0] < -0.1 and brake[1] > 0.1
    pull = asked(on, [0.0, 0.0], [0.0, 0.0], [0.3, -0.3])
    assert pull[0] > 1.0 and pull[1] < -1.0
