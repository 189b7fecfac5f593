"""The paper's score: table X to its last printed figure, and every component by hand."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.metrics import (
    ScoreParams,
    collision_risk,
    efficiency_score,
    joint_smoothness,
    obstacle_proximity,
    overall_score,
    power_score,
    relative_score,
    safe_navigation,
    safety_score,
    task_time_score,
    time_to_collision,
    trajectory_smoothness,
)

# Compiled once a shape, not operation by operation.
joint_smoothness = jax.jit(joint_smoothness)
obstacle_proximity = jax.jit(obstacle_proximity)
power_score = jax.jit(power_score)
safe_navigation = jax.jit(safe_navigation)
time_to_collision = jax.jit(time_to_collision)
collision_risk = jax.jit(collision_risk)
trajectory_smoothness = jax.jit(trajectory_smoothness)

PARAMS = ScoreParams()
TABLE_X = {
    "with zones": ((73.51, 61.20, 44.04), (67.66, 48.43, 47.31, 53.14), (60.976, 55.500, 59.881)),
    "without": ((100.0, 69.07, 40.18), (100.0, 50.67, 47.41, 53.14), (72.775, 65.884, 71.397)),
}


@pytest.mark.parametrize("run", TABLE_X)
def test_table_x(run: str) -> None:
    safety_parts, efficiency_parts, (safety, efficiency, overall) = TABLE_X[run]
    np.testing.assert_allclose(safety_score(PARAMS, *safety_parts), safety, atol=5.1e-4)
    np.testing.assert_allclose(efficiency_score(PARAMS, *efficiency_parts), efficiency, atol=5.1e-4)
    np.testing.assert_allclose(overall_score(PARAMS, safety, efficiency), overall, atol=7e-4)


def test_the_83_per_cent_is_a_ratio() -> None:
    overall = []
    for safety_parts, efficiency_parts, _ in TABLE_X.values():
        safety, efficiency = safety_score(PARAMS, *safety_parts), efficiency_score(PARAMS, *efficiency_parts)
        overall.append(overall_score(PARAMS, safety, efficiency))
    np.testing.assert_allclose(relative_score(*overall), 83.8704, atol=5e-5)


def test_every_weight_counts() -> None:
    params = ScoreParams(*(float(k) for k in range(1, 11)))
    assert safety_score(params, 1.0, 10.0, 100.0) == 1 + 20 + 300
    assert efficiency_score(params, 1.0, 10.0, 100.0, 1000.0) == 4 + 50 + 600 + 7000
    assert overall_score(params, 1.0, 10.0) == 8 + 90


MASK = jnp.array([True, True, True, False])


def test_time_and_power() -> None:
    assert task_time_score(3.0, 4.0) == 75
    tau = jnp.array([[1.0, -1.0], [2.0, 0.0], [3.0, 1.0], [50.0, 50.0]])
    qd = jnp.array([[1.0, 1.0], [-2.0, 1.0], [1.0, 1.0], [1.0, 1.0]])  # powers 2, 4, 4, 100
    np.testing.assert_allclose(power_score(tau, qd), 27.5)
    np.testing.assert_allclose(power_score(tau, qd, MASK), 100 * 10 / 12)
    np.testing.assert_allclose(power_score(tau, qd, MASK, 8.0), 100 * 10 / 24)
    assert power_score(0 * tau, qd) == 0


def test_trajectory_smoothness() -> None:
    """Sums of changes 1, 3, 5 become 1, 50.5, 100; and a run ten times rougher scores the same."""
    qdd = jnp.array([[0.0, 0.0, 0.0], [1.0, 1.0, -2.0], [1.0, -1.0, 1.0]])
    np.testing.assert_allclose(trajectory_smoothness(qdd), (1 + 50.5 + 100) / 3, rtol=1e-12)
    np.testing.assert_allclose(trajectory_smoothness(10 * qdd), trajectory_smoothness(qdd), rtol=1e-12)
    two = jnp.array([True, True, False])  # changes 1, 1, 2
    np.testing.assert_allclose(trajectory_smoothness(qdd, two), (1 + 1 + 100) / 3, rtol=1e-12)
    assert trajectory_smoothness(jnp.ones((4, 3))) == 1


def test_joint_smoothness() -> None:
    """Travels 4, 2, 0 over two steps of 0.5 s: speeds 4, 2, 0 rad/s, mean 2 of largest 4."""
    q = jnp.array([[0.0, 0.0, 1.0], [2.0, -1.0, 1.0], [0.0, -2.0, 1.0], [90.0, 90.0, 90.0]])
    mask = jnp.array([True, True, True, False])
    np.testing.assert_allclose(joint_smoothness(q, 0.5, mask), 50.0)
    np.testing.assert_allclose(joint_smoothness(q, 0.5, mask, 8.0), 25.0)
    assert joint_smoothness(jnp.ones((4, 3)), 0.5) == 0
    np.testing.assert_allclose(joint_smoothness(q[:3], 0.5), 50.0)


def test_safe_navigation() -> None:
    d = jnp.array([0.1, 0.5, 0.2, 0.05])
    assert safe_navigation(d, 0.2) == 50
    np.testing.assert_allclose(safe_navigation(d, 0.2, MASK), 100 - 100 / 3)


def test_obstacle_proximity() -> None:
    d = jnp.array([1.0, 2.0, 3.0, 100.0])
    obstacles = jnp.array([[1.0, 1.0], [0.0, 1.0], [1.0, 0.0], [9.0, 9.0]])  # sums 3, 3, 4
    np.testing.assert_allclose(obstacle_proximity(d, obstacles, MASK), 100 * 10 / 12)
    np.testing.assert_allclose(obstacle_proximity(d, obstacles, MASK, 20.0), 100 / 6)
    np.testing.assert_allclose(obstacle_proximity(d[:3], obstacles[:3]), 100 * 10 / 12)


def test_time_to_collision(dtype: jnp.dtype) -> None:
    """Approaching, far, standing, retreating, in contact, in contact and retreating."""
    d = jnp.asarray([1.0, 9.0, 1.0, 1.0, 0.0, -0.1], dtype)
    closing = jnp.asarray([0.5, 0.5, 0.0, -1.0, 1.0, -1.0], dtype)
    times = time_to_collision(d, closing, 5.0)
    assert times.dtype == dtype
    np.testing.assert_allclose(times, [2.0, 5.0, 5.0, 5.0, 0.0, 0.0])
    np.testing.assert_allclose(collision_risk(d, closing, 5.0), 100 * 17 / 30, rtol=1e-6)
    np.testing.assert_allclose(collision_risk(d, closing, 5.0, jnp.arange(6) < 2), 70.0, rtol=1e-6)
    slope = jax.jit(jax.jacobian(lambda c: time_to_collision(d, c, 5.0)))(closing)
    assert jnp.all(jnp.isfinite(slope))
    np.testing.assert_allclose(slope[0, 0], -4.0, rtol=1e-6)
