"""The least change of a command: against an exact solution, its laws, a retreat that is always possible, and missing numbers."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from hrcjax.reference import safety as serial
from hrcjax.safety import APPROACH_TOLERANCE, SafetyParams, approach_rows, governed, least_change, path_speed
from hrcjax.safety import separation_distance as S_p
from hrcjax.safety.least_change import EFFORT

few = settings(max_examples=40, deadline=None)
change = jax.jit(least_change, static_argnames="iterations")
seeds = st.integers(0, 2**31 - 1)
ROWS = 60


def problem(seed, dtype=np.float64, stop=0.3):
    """Rows of an arm-like set: points along a line that turns about six axes, several people; some limits are 0."""
    rng = np.random.default_rng(seed)
    axes, through = rng.normal(size=(6, 3)), rng.normal(size=(6, 3)) * 0.3
    points = np.outer(np.linspace(0.2, 1.0, ROWS // 3), rng.normal(size=3))
    J = np.stack([np.cross(axis, points - base) for axis, base in zip(axes, through, strict=True)], axis=2)
    away = points[:, None] - rng.uniform(-1.5, 1.5, (1, 3, 3))
    d = np.linalg.norm(away, axis=2)
    A = -np.einsum("psi,pij->psj", away / d[..., None], J).reshape(ROWS, 6)
    limit = np.where(rng.uniform() < stop, 0.0, np.clip(d - 0.5, 0.0, 0.4)).ravel()
    return tuple(np.asarray(v, dtype) for v in (rng.normal(size=6), A, limit))


def exact(qd, A, limit):
    return serial.least_change(qd, A, limit)


def test_the_exact_solution_is_that_of_a_general_solver() -> None:
    """The oracle of the other tests, by nonnegative least squares, against sequential quadratic programming."""
    for seed in range(6):
        qd, A, limit = problem(seed, stop=0.0)
        rule = {"type": "ineq", "fun": lambda x, A=A, b=limit: b - A @ x, "jac": lambda x, A=A: -A}
        found = minimize(
            lambda x, q=qd: 0.5 * np.sum((x - q) ** 2), 0 * qd, jac=lambda x, q=qd: x - q, constraints=rule,
            method="SLSQP", options={"ftol": 1e-14, "maxiter": 500},
        )  # fmt: skip
        np.testing.assert_allclose(exact(qd, A, limit), found.x, atol=2e-6)


def test_it_is_the_exact_solution() -> None:
    """Over 400 problems. Rows that hardly differ from dependent ones leave some digits less."""
    batch = [np.stack(column) for column in zip(*map(problem, range(400)), strict=True)]
    got = jax.jit(jax.vmap(least_change))(*map(jnp.asarray, batch))
    error = np.abs(np.asarray(got) - [exact(*one) for one in zip(*batch, strict=True)]).max(axis=1)
    assert np.quantile(error, 0.9) < 1e-12 and np.quantile(error, 0.99) < 1e-8 and error.max() < 1e-6


@few
@given(seeds, st.sampled_from([1, 2, 24]), st.sampled_from([np.float32, np.float64]))
def test_no_limit_is_passed_whatever_the_iterations(seed: int, iterations: int, dtype) -> None:
    qd, A, limit = problem(seed, dtype)
    got = np.asarray(change(jnp.asarray(3 * qd), jnp.asarray(A), jnp.asarray(limit), iterations=iterations))
    assert got.dtype == dtype
    assert (A.astype(np.float64) @ got - limit).max() <= APPROACH_TOLERANCE * (1 + 1e-4)


@few
@given(seeds)
def test_what_keeps_its_limits_is_unchanged_bit_for_bit_and_a_second_time_changes_nothing(seed: int) -> None:
    qd, A, limit = problem(seed)
    room = jnp.asarray(np.maximum(A @ qd, 0.0) + 1e-12)
    np.testing.assert_array_equal(change(jnp.asarray(qd), jnp.asarray(A), room), qd)
    once = change(jnp.asarray(qd), jnp.asarray(A), jnp.asarray(limit))
    np.testing.assert_allclose(change(once, jnp.asarray(A), jnp.asarray(limit)), once, atol=1e-7)
    # nearer than any other command that keeps them: that of scaling, and standing still
    asked = A @ qd
    scale = min(1.0, (limit[asked > 0] / asked[asked > 0]).min(initial=1.0))
    for other in (scale * qd, 0 * qd):
        assert np.linalg.norm(once - qd) <= np.linalg.norm(other - qd) + 1e-9


def test_a_retreat_passes_though_another_point_approaches_a_little(dtype) -> None:
    """All 20 points are stopped; the nearest one retreats at 0.2 m/s, another approaches at 1e-5 m/s."""
    rng = np.random.default_rng(4)
    A = rng.normal(size=(20, 6)) * 0.4
    qd = np.linalg.lstsq(A[:2], np.array([-0.2, 1e-5]), rcond=None)[0]
    A = np.where((A @ qd > 0)[:, None], -A, A)
    A[1] *= -1  # the one that approaches
    got = np.asarray(change(jnp.asarray(qd, dtype), jnp.asarray(A, dtype), jnp.zeros(20, dtype)))
    np.testing.assert_allclose(A[1] @ qd, 1e-5)
    assert (A @ got).max() < (1e-7 if dtype == jnp.float64 else 2e-5)
    assert A[0] @ got < -0.2 * 0.999
    np.testing.assert_allclose(got, qd, atol=1e-4)


def test_in_a_stop_all_that_can_retreat_does() -> None:
    """The change of a cone's projection is orthogonal to what remains: nothing that could retreat is taken away."""
    qd, A, limit = (np.stack(column) for column in zip(*map(problem, range(400)), strict=True))
    got = np.asarray(jax.jit(jax.vmap(least_change))(*map(jnp.asarray, (qd, A, 0 * limit))))
    assert np.einsum("brj,bj->br", A, got).max() < 1e-6
    assert np.quantile(np.abs(np.sum(got * (qd - got), axis=1)), 0.99) < 1e-7
    assert (np.linalg.norm(got, axis=1) > 1e-3).mean() > 0.3, "many must be able to"


def test_the_tolerance_in_terms_of_separation() -> None:
    """S_p at the worst speeds grows by as much as the docstring says."""
    ssm = SafetyParams().ssm
    grown = [float(S_p(ssm, v + APPROACH_TOLERANCE, ssm.v_h_near) - S_p(ssm, v, ssm.v_h_near)) for v in (0.0, 1.0)]
    assert max(grown) < 0.0023, grown


def test_a_retreat_is_as_fast_as_the_others_allow() -> None:
    """Of 100 stops with one or two points that are asked to retreat: min |x - qd|^2 + EFFORT^2 s^2, by a general solver."""
    rng, some = np.random.default_rng(1), 0
    for seed in range(100):
        qd, A, limit = problem(seed, stop=1.0)
        asked = rng.choice(ROWS, 2, replace=False)
        limit[asked] = -rng.uniform(0.02, 0.2, 2)
        got = np.asarray(change(*map(jnp.asarray, (0.3 * qd, A, limit))))
        rule = {
            "type": "ineq", "fun": lambda x, A=A, b=limit: np.where(b < 0, (1 - x[6]) * b, b) - A @ x[:6],
            "jac": lambda x, A=A, b=limit: -np.column_stack([A, np.minimum(b, 0)]),
        }  # fmt: skip
        found = minimize(
            lambda x, q=0.3 * qd: np.sum((x[:6] - q) ** 2) + (EFFORT * x[6]) ** 2, np.append(0 * qd, 1.0), constraints=rule,
            bounds=[(None, None)] * 6 + [(0, 1)], method="SLSQP", options={"ftol": 1e-13, "maxiter": 500},
        )  # fmt: skip
        np.testing.assert_allclose(got, found.x[:6], atol=2e-5)
        some += bool((A[asked] @ got < -1e-3).all())
        assert (A @ got).max() < 1e-6 and np.linalg.norm(got) <= np.linalg.norm(0.3 * qd) + EFFORT
    assert some > 10


def test_a_retreat_is_given_up_once_and_not_turned_round() -> None:
    """Asked to approach at 100 rad/s: the whole retreat is given up, not more, and the other joint is not slowed for that."""
    got = change(jnp.asarray([100.0, 0.3]), jnp.asarray([[1.0, 0.0]]), jnp.asarray([-0.1]))
    np.testing.assert_allclose(got, [0.0, 0.3], atol=1e-7)


def test_a_row_of_zeros_gives_no_retreat_up() -> None:
    A = jnp.asarray([[0.5, 0.0], [0.0, 0.0]])
    got = change(jnp.zeros(2), A, jnp.asarray([-0.1, -0.1]))
    np.testing.assert_array_equal(got, change(jnp.zeros(2), A[:1], jnp.asarray([-0.1])))
    assert got[0] < -0.1


def test_a_retreat_that_nothing_hinders_is_nearly_the_whole() -> None:
    """In one joint at 0.5 m/rad: the share given up is (v / 0.5)^2 / ((v / 0.5)^2 + EFFORT^2)."""
    A = jnp.asarray([[0.5, 0.0]])
    turn = 0.1 / 0.5
    given_up = turn**2 / (turn**2 + EFFORT**2)
    np.testing.assert_allclose(change(jnp.zeros(2), A, jnp.asarray([-0.1])), [-turn * (1 - given_up), 0], atol=1e-9)


@pytest.mark.parametrize("place", ["qd", "A", "limit"])
def test_missing_numbers_stand_still(place: str) -> None:
    names: tuple[str, ...] = ("qd", "A", "limit")
    arguments = dict(zip(names, map(jnp.asarray, problem(0)), strict=True))
    arguments[place] = arguments[place].at[(3,) * arguments[place].ndim].set(jnp.nan)
    np.testing.assert_array_equal(change(**arguments), 0.0)


def test_rows_of_zeros_and_infinite_limits_limit_nothing() -> None:
    qd, A, limit = map(jnp.asarray, problem(1))
    np.testing.assert_array_equal(change(qd, 0 * A, 0 * limit), qd)
    np.testing.assert_array_equal(change(qd, A, jnp.full(ROWS, jnp.inf)), qd)


def test_derivatives_are_those_of_finite_differences() -> None:
    """By the command, the rows and the limits, with several rows active; and finite where all coincide."""
    direction = np.random.default_rng(0).normal(size=6)
    f = jax.jit(lambda qd, A, limit: jnp.dot(least_change(qd, A, limit), jnp.asarray(direction)))
    slope = jax.jit(jax.grad(f, argnums=(0, 1, 2)))
    for seed in (0, 3, 5):
        at = [jnp.asarray(v) for v in problem(seed, stop=0.0)]
        found = slope(*at)
        rng, h = np.random.default_rng(seed), 1e-6
        for k in range(3):
            way = jnp.asarray(rng.normal(size=at[k].shape))
            ends = [f(*(v + s * h * way if i == k else v for i, v in enumerate(at))) for s in (1, -1)]
            np.testing.assert_allclose(jnp.sum(found[k] * way), (ends[0] - ends[1]) / (2 * h), rtol=1e-4, atol=1e-6)
        assert float(jnp.abs(found[2]).max()) > 0.05, "a limit must count"
    qd, A, limit = (jnp.asarray(v) for v in problem(0))
    for arguments in ((0 * qd, A, 0 * limit), (qd, 0 * A, limit), (qd, A.at[:].set(A[0]), 0 * limit)):
        assert all(bool(jnp.isfinite(v).all()) for v in slope(*arguments))


def test_points_without_direction_are_scaled_and_gradients_made_unit(dtype) -> None:
    J = jnp.broadcast_to(jnp.eye(3, dtype=dtype), (1, 3, 3))
    g = jnp.asarray([[[0.6, 0.0, 0.0], [0.0, 0.0, 0.1]]], dtype)
    run = jax.jit(governed)
    limit = jnp.asarray([[0.1, jnp.inf]], dtype)
    got = run(jnp.asarray([-1.0, 0.5, 0.0], dtype), J, g, limit)
    np.testing.assert_allclose(got, [-0.1, 0.5, 0.0], rtol=1e-5)  # a short gradient would allow 0.1 / 0.6
    got = run(jnp.asarray([-1.0, 0.0, 1.0], dtype), J, g, limit.at[0, 1].set(0.05))
    np.testing.assert_allclose(jnp.linalg.norm(got), 0.05, rtol=1e-5)
    np.testing.assert_array_equal(run(jnp.asarray([-1.0, 0.0, 1.0], dtype), J, g.at[0, 1].set(jnp.nan), limit), 0.0)


@few
@given(seeds)
def test_the_serial_governor_does_the_same(seed: int) -> None:
    rng = np.random.default_rng(seed)
    J, g, qd = rng.normal(size=(6, 3, 6)), rng.normal(size=(6, 2, 3)), rng.normal(size=6)
    g[0] *= 0.2 / np.linalg.norm(g[0], axis=1, keepdims=True)
    limit = np.where(rng.uniform(size=(6, 2)) < 0.3, np.inf, rng.uniform(0, 0.5, (6, 2)))
    ours = jax.jit(governed)(*map(jnp.asarray, (qd, J, g, limit)))
    np.testing.assert_allclose(ours, serial.governed(qd, J, g, limit), atol=1e-7)


@few
@given(seeds)
def test_speed_along_a_path(seed: int) -> None:
    qd, A, limit = problem(seed, stop=0.0)
    v = float(path_speed(*map(jnp.asarray, (qd, A, limit))))
    np.testing.assert_allclose(v, serial.path_speed(qd, A, limit))
    slope = A @ qd
    assert np.isfinite(v) == (slope > 0).any()
    if np.isfinite(v):
        assert (v * slope <= limit + 1e-12).all() and (1.001 * v * slope + 1e-12 > limit).any()
    assert path_speed(jnp.asarray(qd), jnp.asarray(-np.abs(A) * np.sign(qd)), jnp.asarray(0 * limit)) == jnp.inf
    assert path_speed(jnp.asarray(qd), jnp.asarray(A), jnp.asarray(0 * limit)) == (0 if np.isfinite(v) else np.inf)
    assert path_speed(jnp.asarray(qd), jnp.asarray(A).at[0, 0].set(jnp.nan), jnp.asarray(limit)) == 0
    assert bool(jnp.isfinite(jax.grad(path_speed)(jnp.asarray(qd), jnp.asarray(A), jnp.asarray(limit))).all())


def test_a_second_person_behind_the_arm_is_met_by_its_own_limit() -> None:
    """Walls at 0.30 and 0.36 m on both sides: what the nearer one alone lets pass, the rows of both do not."""
    J = jnp.broadcast_to(jnp.eye(3), (1, 3, 3))
    g = jnp.asarray([[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]])
    limit, towards_second = jnp.asarray([[0.0, 0.05]]), jnp.asarray([1.0, 0.0, 0.0])
    run = jax.jit(governed)
    np.testing.assert_array_equal(run(towards_second, J, g[:, :1], limit[:, :1]), towards_second)
    np.testing.assert_allclose(run(towards_second, J, g, limit), [0.05, 0.0, 0.0], rtol=1e-6)
    assert approach_rows(J, g).shape == (2, 3)
