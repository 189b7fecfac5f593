"""Between two control points of a rigid link: dense points of its axis, at random motions, towards people of any place."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.robot import load_arm, with_tool
from hrcjax.safety import between_factor, half_gaps


def motions(count, seed=0):
    """A link from p0 to p1 [m] in rigid motion, and a person at a point about it."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        h = rng.uniform(0.02, 0.06)
        p = np.array([[-h, 0, 0], [h, 0, 0]])
        y = rng.normal(size=3)
        y *= rng.uniform(1.05, 5) * h / np.linalg.norm(y)
        omega, v = rng.normal(size=3) * rng.choice([0, 1, 10]), rng.normal(size=3)
        s = np.linspace(0, 1, 41)[:, None]
        x = (1 - s) * p[0] + s * p[1]
        away = x - y
        D = np.linalg.norm(away, axis=1)
        approach = -(away * (v + np.cross(omega, x))).sum(axis=1) / D
        yield h, D, approach


def test_the_factor_covers_all_points_between() -> None:
    worst, all_ends = 0.0, []
    for h, D, approach in motions(4000):
        ends = np.asarray([D[0], D[-1]])
        factor = np.sqrt(np.maximum(1 - (h / ends) ** 2, 0.0))
        if (ends <= h).any():
            continue
        v = max((approach[[0, -1]] / factor).max(), 0.0)  # both ends keep factor times v
        worst = max(worst, (approach / v).max() if v > 0 else (1.0 if approach.max() <= 1e-12 else np.inf))
        all_ends.append((ends, h, factor))
    ends, h, factor = (np.array(column) for column in zip(*all_ends, strict=True))
    np.testing.assert_allclose(between_factor(jnp.asarray(ends), jnp.asarray(h)[:, None]), factor, rtol=1e-6)
    assert 0.98 < worst <= 1 + 1e-9, "never more, and no factor nearer to 1 would do"


def test_without_it_a_point_midway_is_faster_than_both_ends() -> None:
    """Straight at a person beside the middle: faster by D_end / D_middle."""
    h, D = 0.05, 0.06
    end = np.hypot(h, D)
    np.testing.assert_allclose(1 / between_factor(jnp.asarray(end), jnp.asarray(h)), end / D)


def test_singular_points(dtype) -> None:
    f = jax.vmap(jax.grad(lambda D: between_factor(D, jnp.asarray(0.05, dtype))))
    D = jnp.asarray([-0.1, 0.0, 0.05, 0.051, 10.0], dtype)
    assert bool(jnp.isfinite(f(D)).all())
    np.testing.assert_array_equal(between_factor(D, jnp.asarray(0.05, dtype))[:3], 0.0)
    assert bool(jnp.isnan(between_factor(jnp.asarray(jnp.nan, dtype), jnp.asarray(0.05, dtype))))


def test_gaps_of_the_arm() -> None:
    arm = with_tool(load_arm("ur5"), 0.12, 0.03)
    gaps = half_gaps(arm.control_links, arm.control_offsets)
    assert gaps.shape == arm.control_radii.shape and gaps.max() < 0.06
    np.testing.assert_allclose(gaps[-1], 0.03)  # of the two spheres of the tool, 6 cm apart


@pytest.mark.parametrize("length, radius", [(0.12, 0.03), (0.3, 0.02)])
def test_no_capsule_ends_beyond_the_control_points(length: float, radius: float) -> None:
    """The factor speaks of points between two control points; beyond the last one a turning link approaches faster than both."""
    arm = with_tool(load_arm("ur5"), length, radius)
    links, offsets = np.array(arm.control_links), np.asarray(arm.control_offsets)
    for link, *ends in zip(arm.capsule_links, arm.capsule_a, arm.capsule_b, strict=True):
        if link < 1:
            continue
        for end in ends:
            assert np.linalg.norm(offsets[links == link] - end, axis=1).min() < 0.061, (link, end)
    tip = np.asarray(arm.capsule_b[-1])
    assert np.linalg.norm(offsets[links == arm.tool_link] - tip, axis=1).min() < 1e-9
