import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from plan_scenes import GOAL, PRINTED, START, scene

from hrcjax.plan import PotentialParams, damped_step, force, potential_path, time_to_goal, unit_step

# (obstacles, radii [cm], K_att, K_rep [cm^2], zeta, printed time [s]) of tables I, II, III, V, VI, VII
TABLES = {
    "I": [(k, [3.0] * 4, 0.03, 0.1, 4.0, 4.70) for k in (1, 2, 3, 4)],
    "II": [(4, [r] * 4, 0.03, 0.1, 4.0, t) for r, t in ((2.0, 4.68), (2.5, 4.69), (3.0, 4.70), (3.5, 4.72))],
    "III": [
        (4, [2.0, 2.5, 3.0, 3.5], 0.03, 0.1, 4.0, 4.69),
        (4, [2.5, 2.0, 3.0, 3.5], 0.03, 0.1, 4.0, 4.68),
        (4, [3.0, 3.5, 2.0, 2.5], 0.03, 0.1, 4.0, 4.72),
        (4, [3.5, 3.0, 2.5, 2.0], 0.03, 0.1, 4.0, 4.70),
    ],
    "V": [(4, [3.0] * 4, k, 0.1, 4.0, t) for k, t in ((0.03, 4.70), (0.04, 3.51), (0.05, 2.79))],
    "VI": [(4, [3.0] * 4, 0.04, k, 4.0, t) for k, t in ((0.1, 3.51), (0.2, 3.51), (0.3, 3.52))],
    "VII": [(4, [3.0] * 4, 0.03, 0.1, z, t) for z, t in ((4.0, 4.70), (5.0, 4.72), (6.0, 4.74))],
}


@jax.jit
def paper_time(params, present, radius):
    s = scene(radius=radius)
    return time_to_goal(params, s.start, s.goal, lambda x: jnp.where(present, s.distances(x), 10.0), s.radius, 200)


def test_printed_times_to_goal():
    error = {}
    for table, rows in TABLES.items():
        for count, radius, k_att, k_rep, zeta, printed in rows:
            params = jax.tree.map(jnp.asarray, PotentialParams(k_att=k_att, k_rep=k_rep * 0.01**2, zeta=zeta))
            time = paper_time(params, jnp.arange(4) < count, jnp.asarray(radius) / 100)
            error.setdefault(table, []).append(float(time) - printed)
    rms = {table: np.sqrt(np.mean(np.square(e))) for table, e in error.items()}
    assert np.sqrt(np.mean(np.square(np.concatenate(list(error.values()))))) < 0.0125
    for table, bound in {"I": 0.001, "II": 0.011, "III": 0.0135, "V": 0.0035, "VI": 0.004, "VII": 0.026}.items():
        assert rms[table] < bound, table


def test_repulsion_delays_as_printed():
    """Table VI: three times the repulsion costs a hundredth of a second; a wrong unit of K_rep costs none, or much."""
    times = [
        float(
            paper_time(
                jax.tree.map(jnp.asarray, PotentialParams(k_att=0.04, k_rep=k)), jnp.full(4, True), jnp.full(4, 0.03)
            )
        )
        for k in (1e-5, 3e-5)
    ]
    np.testing.assert_allclose(times[1] - times[0], 0.0115, atol=0.001)


@pytest.mark.parametrize(("k_att", "printed"), [(0.03, 4.692), (0.04, 3.501), (0.05, 2.787)])
def test_free_time_is_that_of_a_geometric_series(k_att, printed, dtype):
    s = scene(centers=np.full((1, 3), 9.0), dtype=dtype)

    def time(k):
        p = jax.tree.map(lambda x: jnp.asarray(x, dtype), PotentialParams())
        p = eqx.tree_at(lambda p: p.k_att, p, k)
        return time_to_goal(p, s.start, s.goal, s.distances, s.radius, 200)

    def closed(k):
        return np.log(np.linalg.norm(START - GOAL) / 0.01) / -np.log1p(-k) / 30

    value, slope = jax.value_and_grad(time)(jnp.asarray(k_att, dtype))
    assert value.dtype == dtype
    np.testing.assert_allclose(value, closed(k_att), rtol=1e-4)
    np.testing.assert_allclose(value, printed, atol=6e-4)
    np.testing.assert_allclose(slope, (closed(k_att + 1e-6) - closed(k_att - 1e-6)) / 2e-6, rtol=2e-3)


def test_time_is_infinite_if_steps_do_not_suffice_and_zero_at_the_goal():
    s = scene()
    assert np.isinf(time_to_goal(PotentialParams(), s.start, s.goal, s.distances, s.radius, 100))
    assert float(time_to_goal(PotentialParams(), s.goal, s.goal, s.distances, s.radius, 10)) == 0.0


def test_status_and_arrival():
    s = scene(centers=np.full((1, 3), 9.0))
    path = potential_path(PotentialParams(), s.start, s.goal, s.distances, s.radius, 150, unit_step)
    far = np.linalg.norm(np.asarray(path.waypoints) - GOAL, axis=1)
    assert path.waypoints.shape == (151, 3)
    assert bool(path.reached) and int(path.arrival) == int(np.argmax(far < 0.01)) == 141
    np.testing.assert_allclose(far[1:] / far[:-1], 0.97, rtol=1e-9)
    short = potential_path(PotentialParams(), s.start, s.goal, s.distances, s.radius, 140, unit_step)
    assert not bool(short.reached) and int(short.arrival) == 140


def test_no_step_is_longer_than_allowed():
    s = scene("columns")
    for step in (unit_step, damped_step):
        p = PotentialParams(step_max=0.004)
        path = potential_path(p, s.start, s.goal, s.distances, s.radius, 100, step)
        assert np.linalg.norm(np.diff(path.waypoints, axis=0), axis=1).max() <= 0.004 * (1 + 1e-9)


def test_damped_step_is_the_unit_step_where_repulsion_is_soft():
    s = scene()
    q = jnp.asarray([0.25, 0.6, 0.13])
    p = PotentialParams(k_rep=1e-8)
    np.testing.assert_allclose(
        damped_step(p, q, s.goal, s.distances, s.radius), unit_step(p, q, s.goal, s.distances, s.radius), rtol=1e-3
    )


def test_damped_step_solves_the_implicit_system():
    s = scene()
    p = PotentialParams(step_max=10.0, k_rep=3e-5)
    q = jnp.asarray(PRINTED[0] + np.array([0.0, 0.06, 0.01]))
    rho = np.asarray(s.distances(q))
    normals = np.asarray(jax.jacfwd(s.distances)(q))
    d = np.linalg.norm(np.asarray(q) - GOAL)
    stiffness = np.where(rho < 0.12, 3e-5 * d**2 * (3 / rho**4 - 2 / (0.12 * rho**3)), 0)
    system = np.eye(3) + (normals.T * stiffness) @ normals
    expected = np.linalg.solve(system, np.asarray(force(p, q, s.goal, s.distances, s.radius)))
    np.testing.assert_allclose(damped_step(p, q, s.goal, s.distances, s.radius), expected, rtol=1e-9)


def test_damped_path_does_not_swing_where_the_unit_path_does():
    s = scene("columns")
    p = PotentialParams(k_rep=1e-4, zeta=2.0)

    def reversals(step):
        moves = np.diff(potential_path(p, s.start, s.goal, s.distances, s.radius, 200, step).waypoints, axis=0)
        return int(np.sum(np.sum(moves[1:] * moves[:-1], axis=1) < 0))

    assert reversals(damped_step) <= 1  # where it first meets the obstacle
    assert reversals(unit_step) > 8


def test_path_keeps_out_and_gradient_is_finite():
    s = scene("columns")

    def end(params):
        path = potential_path(params, s.start, s.goal, s.distances, s.radius, 200)
        return jnp.sum(path.waypoints[60]), path

    params = jax.tree.map(jnp.asarray, PotentialParams())
    grads, path = jax.grad(end, has_aux=True)(params)
    assert float(jnp.min(jax.vmap(s.distances)(path.waypoints))) > 0.02
    assert bool(path.reached)
    assert all(np.isfinite(g) for g in jax.tree.leaves(grads)) and float(grads.k_rep) != 0.0


def test_steps_must_be_positive():
    s = scene()
    with pytest.raises(ValueError, match="steps"):
        potential_path(PotentialParams(), s.start, s.goal, s.distances, s.radius, 0)
