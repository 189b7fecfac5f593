"""Fits of single shapes: what free rays add to points, and laws of motion."""

import jax.numpy as jnp
import numpy as np

from hrcjax.task_space.choice import best_shape
from hrcjax.task_space.evidence import POINTS, RAYS
from hrcjax.task_space.shape_fit import Evidence, FitParams, fit_shape, solid_of
from hrcjax.world.scene import BOX, COLUMN, SPHERE


def seen_of(points: np.ndarray, begin: np.ndarray, end: np.ndarray, stands: bool = True) -> Evidence:
    def padded(values: np.ndarray, count: int) -> jnp.ndarray:
        room = np.zeros((count, 3))
        room[: len(values)] = values[:count]
        return jnp.asarray(room, jnp.float32)

    lower, upper = np.percentile(points, 1, axis=0), np.percentile(points, 99, axis=0)
    return Evidence(
        padded(points, POINTS), jnp.full((POINTS,), 1e-3, jnp.float32), jnp.arange(POINTS) < len(points), padded(begin, RAYS),
        padded(end, RAYS), jnp.arange(RAYS) < len(begin), jnp.asarray(lower, jnp.float32), jnp.asarray(upper, jnp.float32), jnp.asarray(stands),
    )  # fmt: skip


def front_of_a_box(shift: np.ndarray) -> Evidence:
    """Its top and one face; behind it one ray parallel to the hidden face, 1 mm off."""
    draw = np.random.default_rng(0)
    u = draw.uniform(-1, 1, (400, 3)) * [0.05, 0.03, 0.04]
    u[:200, 2] = 0.04
    u[200:, 1] = -0.03
    line = np.linspace(-0.08, 0.08, 20)
    begin = np.stack([np.full(20, -0.1), np.full(20, 0.031), line], -1)
    end = begin * [-1, 1, 1]
    place = np.array([0.3, 0.4, 0.04]) + shift
    return seen_of(u + place, begin + place, end + place)


def test_a_box_of_which_top_and_front_are_seen() -> None:
    kind, fit, _ = best_shape(front_of_a_box(np.zeros(3)), FitParams())
    assert kind == BOX
    np.testing.assert_allclose(fit.center, [0.3, 0.4, 0.04], atol=1.5e-3)
    np.testing.assert_allclose(np.sort(np.asarray(fit.size)), [0.03, 0.04, 0.05], atol=1.5e-3)
    assert float(fit.claimed) == 0 and float(fit.residual) < 1e-3


def test_a_fit_moves_with_what_is_seen() -> None:
    shift = np.array([0.2, -0.1, 0.0])
    one, two = (fit_shape(BOX, FitParams(), front_of_a_box(s)) for s in (np.zeros(3), shift))
    np.testing.assert_allclose(two.center - one.center, shift, atol=5e-4)
    np.testing.assert_allclose(two.size, one.size, atol=5e-4)


def test_free_rays_bound_what_nobody_sees() -> None:
    """A hemisphere's upper cap could be of any larger ball; rays beside it say where it ends."""
    draw = np.random.default_rng(0)
    way = draw.normal(size=(4000, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    cap = 0.05 * way[way[:, 2] > 0.8][:300] + [0.3, 0.4, 0.3] + draw.normal(size=(300, 3)) * 1e-3
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    side = np.stack([np.cos(turn), np.sin(turn)], -1) * 0.0505
    base = np.column_stack([side, np.zeros(60)]) + np.array([0.3, 0.4, 0.3])
    rise = np.array([0.0, 0.0, 0.1])
    alone = fit_shape(SPHERE, FitParams(), seen_of(cap, base[:0], base[:0], stands=False))
    bound = fit_shape(SPHERE, FitParams(), seen_of(cap, base - rise, base + rise, stands=False))
    assert abs(float(bound.size[0]) - 0.05) < 2e-3
    assert float(bound.size_deviation[0]) <= float(alone.size_deviation[0])


def test_solids_from_free_numbers() -> None:
    center, size, yaw = solid_of(COLUMN, jnp.array([0.1, 0.2, jnp.log(0.03), 0.0, 0.2]))
    np.testing.assert_allclose(center, [0.1, 0.2, 0.1], rtol=1e-6)
    np.testing.assert_allclose(size, [0.03, 0.03, 0.1], rtol=1e-5)
    assert float(yaw) == 0
