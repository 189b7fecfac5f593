"""Fits of single shapes: what free rays add to points, and laws of motion."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import least_squares

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
    spread = np.asarray(
        fit.center_deviation
    )  # nothing touches the ends along x: known as well as is assumed, and no worse
    assert np.all((spread > 0) & (spread < 1.01 * FitParams().size)) and spread[0] > 0.5 * FitParams().size


def test_a_fit_moves_with_what_is_seen() -> None:
    shift = np.array([0.2, -0.1, 0.0])
    one, two = (fit_shape(BOX, FitParams(), front_of_a_box(s)) for s in (np.zeros(3), shift))
    np.testing.assert_allclose(two.center - one.center, shift, atol=5e-4)
    np.testing.assert_allclose(two.size, one.size, atol=5e-4)


def a_cap(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Points on the uppermost tenth of a ball of 5 cm, off by 1 mm, and a ring of places half a millimetre beside its equator [m]."""
    draw = np.random.default_rng(seed)
    way = draw.normal(size=(4000, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    middle = np.array([0.3, 0.4, 0.3])
    cap = 0.05 * way[way[:, 2] > 0.8][:300] + middle + draw.normal(size=(300, 3)) * 1e-3
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    return cap, np.column_stack([0.0505 * np.cos(turn), 0.0505 * np.sin(turn), np.zeros(60)]) + middle


def radius_by_scipy(cap: np.ndarray, ring: np.ndarray) -> float:
    """Of the ball by least squares: distances of points, and how deep upright lines pass through, over their deviations."""
    spread = np.hypot(1e-3, FitParams().model)

    def residuals(v: np.ndarray) -> np.ndarray:
        on = (np.linalg.norm(cap - v[:3], axis=1) - v[3]) / spread
        return np.concatenate([on, np.maximum(v[3] - np.hypot(*(ring - v[:3])[:, :2].T), 0) / FitParams().ray])

    return float(least_squares(residuals, [0.3, 0.4, 0.3, 0.05], xtol=1e-12, ftol=1e-12).x[3])


@pytest.mark.parametrize(("seed", "presses"), [(0, False), (4, True), (9, True)])
def test_free_rays_bound_what_nobody_sees(seed: int, presses: bool) -> None:
    """A cap could be of a larger ball; upright rays beside it say where that ends, and nothing where the cap makes it smaller. Noise of
    1 mm leaves the radius of a cap alone 1 mm and more off, so that what the fit does is compared with scipy's from the same noise."""
    cap, ring = a_cap(seed)
    rise = np.array([0.0, 0.0, 0.1])
    plain = FitParams(size=10.0, robust=100.0)  # as scipy: nothing assumed of the size, no residual counts less
    alone = fit_shape(SPHERE, plain, seen_of(cap, ring[:0], ring[:0], stands=False))
    bound = fit_shape(SPHERE, plain, seen_of(cap, ring - rise, ring + rise, stands=False))
    assert float(alone.size[0]) == pytest.approx(radius_by_scipy(cap, ring[:0]), abs=1e-4)
    assert float(bound.size[0]) == pytest.approx(radius_by_scipy(cap, ring), abs=1e-4)
    if presses:
        assert float(alone.size[0]) > 0.051 and abs(float(bound.size[0]) - 0.05) < 1e-3
        assert float(bound.size_deviation[0]) < 0.5 * float(alone.size_deviation[0])
    else:
        assert float(bound.size[0]) == float(alone.size[0]) < 0.0505
        assert abs(float(alone.size[0]) - 0.05) < float(alone.size_deviation[0])


@pytest.mark.parametrize("beside", [0.029, 0.034])
def test_a_hidden_side_lies_between_the_outermost_point_and_the_rays(beside: float) -> None:
    """Where they press it, it is known to a millimetre; where they keep off, nothing draws it towards them."""
    draw = np.random.default_rng(0)
    u = draw.uniform(-1, 1, (400, 3)) * [0.05, 0.03, 0.04]
    u[:200, 2] = 0.04 + 2e-4 * draw.normal(size=200)
    u[200:, 1] = -0.03 + 2e-4 * draw.normal(size=200)
    line = np.linspace(-0.08, 0.08, 20)
    begin = np.stack([np.full(20, -0.1), np.full(20, beside), line], -1)
    place = np.array([0.3, 0.4, 0.04])
    fit = fit_shape(BOX, FitParams(), seen_of(u + place, begin + place, begin * [-1, 1, 1] + place))
    c, s = abs(np.cos(float(fit.yaw))), abs(np.sin(float(fit.yaw)))
    half = s * float(fit.size[0]) + c * float(fit.size[1])
    off, outermost = float(fit.center[1]) - place[1], u[:, 1].max()
    assert off - half == pytest.approx(-0.03, abs=3e-4)  # the front is seen
    assert min(beside, outermost) - 1e-4 <= off + half <= max(beside, outermost)
    if beside > outermost:
        assert off + half == pytest.approx(outermost, abs=3e-4)  # nothing draws it towards the rays
    spread = np.asarray(fit.center_deviation)
    assert np.all((spread > 0) & (spread < 1.05 * FitParams().size))
    assert spread[1] < 1e-3 if beside < outermost else abs(off) < 3 * spread[1]


def test_solids_from_free_numbers() -> None:
    center, size, yaw = solid_of(COLUMN, jnp.array([0.1, 0.2, jnp.log(0.03), 0.0, 0.2]))
    np.testing.assert_allclose(center, [0.1, 0.2, 0.1], rtol=1e-6)
    np.testing.assert_allclose(size, [0.03, 0.03, 0.1], rtol=1e-5)
    assert float(yaw) == 0
