"""Queries of a map against one Gaussian process over all its points, and what must hold between its levels."""

import inspect

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial import cKDTree

from hrcjax.field import FAR, FieldParams, distance, fit
from hrcjax.geom.cloud import Cloud
from hrcjax.geom.sphere_trace import sphere_trace
from hrcjax.map import (
    MapParams,
    View,
    distance_function,
    empty_map,
    local_field,
    map_distance,
    map_distance_and_gradient,
    map_distances_and_gradients,
)
from hrcjax.sense import d435i

PARAMS = MapParams()
SCALE = PARAMS.ratio * 0.025


@pytest.fixture(scope="module")
def surface() -> np.ndarray:
    """A ball of 15 cm over a square of 1 m, about a point every 2.5 cm, shaken a little."""
    random = np.random.default_rng(0)
    i = np.arange(450) + 0.5
    polar, azimuth = np.arccos(1 - 2 * i / 450), np.pi * (1 + 5**0.5) * i
    ball = np.stack([np.cos(azimuth) * np.sin(polar), np.sin(azimuth) * np.sin(polar), np.cos(polar)], axis=1)
    a, b = np.meshgrid(*[np.arange(-0.49, 0.5, 0.025)] * 2)
    square = np.stack([a.ravel(), b.ravel(), np.full(a.size, -0.111)], axis=1)
    points = np.concatenate([0.15 * ball + [0.05, -0.02, 0.24], square])
    return (points + random.normal(scale=0.001, size=points.shape)).astype(np.float32)


@pytest.fixture(scope="module")
def levels(layout, points_program, surface):
    camera = d435i(jnp.asarray([0.0, -1.4, 1.4], jnp.float32), jnp.zeros(3, jnp.float32), 1)
    count = len(surface)
    view = View(
        jnp.asarray(surface), jnp.ones(count, bool), jnp.full(count, 1e-6, jnp.float32), jnp.zeros((4, 4), jnp.float32)
    )
    state, report = points_program(empty_map(layout), camera, view)
    assert int(report.lost) == int(report.outside) == int(report.waiting) == 0
    for _ in range(2):
        state, _ = points_program(state, camera, view)
    return state.levels


@pytest.fixture(scope="module")
def kept(levels) -> np.ndarray:
    rows = np.asarray(levels[0].rows)
    return np.moveaxis(rows[:, :3], 1, 2)[rows[:, 3] > 0]


@pytest.fixture(scope="module")
def read(layout, levels):
    """Plain distances and their derivatives."""
    how = {"corrected": False, "oriented": False}
    return jax.jit(jax.vmap(lambda x: map_distance_and_gradient(layout, levels, PARAMS.ratio, x, **how)))


@pytest.fixture(scope="module")
def read_one(layout):
    """(levels, place) -> distance and gradient as they are by default, of both readings of a single place."""
    return (
        jax.jit(lambda levels, x: map_distance_and_gradient(layout, levels, PARAMS.ratio, x)),
        jax.jit(lambda levels, x: jax.value_and_grad(lambda x: map_distance(layout, levels, PARAMS.ratio, x))(x)),
    )


def queries(kept: np.ndarray, near: float, far: float, count: int = 400) -> np.ndarray:
    x = np.random.default_rng(1).uniform([-0.55, -0.55, -0.15], [0.55, 0.55, 0.55], (20 * count, 3)).astype(np.float32)
    d = cKDTree(kept).query(x)[0]
    return x[(d > near) & (d < far)][:count]


def test_near_surfaces_it_is_the_field_of_all_points(read, kept) -> None:
    """Cutting the process into blocks, and the kernel off at two voxels, costs less than a tenth of a millimetre."""
    whole = fit(Cloud(jnp.asarray(kept), jnp.ones(len(kept), bool)), FieldParams(SCALE, PARAMS.noise))
    x = queries(kept, 0.002, 0.28)
    expected, slope = jax.jit(jax.vmap(jax.value_and_grad(lambda x: distance(whole, x))))(x)
    d, g = (np.asarray(v) for v in read(x))
    known = np.asarray(expected) > 0.3 * SCALE  # nearer both are bent, the map's not down to 0
    assert known.mean() > 0.95
    np.testing.assert_allclose(d[known], expected[known], atol=2e-4)
    np.testing.assert_allclose(g[known], slope[known], atol=0.03)
    assert (d > 0).all() and (d[~known] < 0.4 * SCALE).all()


def test_local_field_is_a_field_like_any_other(layout, levels, read, kept) -> None:
    x = queries(kept, 0.01, 0.25, 20)
    local = jax.jit(jax.vmap(lambda x: distance(local_field(layout, 0, levels[0], x, PARAMS.ratio, 16), x)))
    d, known = np.asarray(local(x)), np.asarray(local(x)) > 0.3 * SCALE
    assert known.sum() > 15
    np.testing.assert_allclose(d[known], np.asarray(read(x)[0])[known], atol=2e-4)


def test_gradient_is_that_of_the_distance(layout, levels, read, kept) -> None:
    x = np.concatenate([queries(kept, 0.0, 0.2, 50), queries(kept, 0.3, 0.39, 50)])
    program = jax.jit(jax.vmap(jax.grad(lambda x: map_distance(layout, levels, PARAMS.ratio, x, corrected=False))))
    np.testing.assert_allclose(read(x)[1], program(x), atol=2e-4)


@pytest.mark.slow
def test_no_jumps_through_the_borders_of_blocks_and_levels(layout, levels) -> None:
    """Along random lines, 0.2 mm a step: where the value changes most, steps of 1/64 of that change it ever less."""
    random, count = np.random.default_rng(2), 4096

    def plain_and_corrected(x):
        return jnp.stack([map_distance(layout, levels, PARAMS.ratio, x, corrected) for corrected in (False, True)])

    program, rows = jax.jit(jax.vmap(plain_and_corrected)), 128
    for _ in range(4):
        a, b = random.uniform([-0.8, -0.8, -0.1], [0.8, 0.8, 0.9], (2, 3))
        b = a + 2e-4 * count * (b - a) / np.linalg.norm(b - a)

        def along(t, a=a, b=b):
            x = (a + t[:, None] * (b - a)).astype(np.float32)
            return np.concatenate([program(some) for some in x.reshape(-1, rows, 3)])

        t = np.linspace(0, 1, count)
        worst = np.argmax(np.abs(np.diff(along(t), axis=0)), axis=0)
        finer = np.concatenate([np.linspace(t[i], t[i + 1], rows // 2) for i in worst])
        for which, values in enumerate(np.split(along(finer), 2)):
            assert np.abs(np.diff(values[:, which])).max() < 3e-5


def test_far_away_it_is_finite_and_points_away(read, kept) -> None:
    directions = np.random.default_rng(3).normal(size=(60, 3))
    directions[:, 2] = np.abs(directions[:, 2])
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    tree = cKDTree(kept)
    for radius in (0.9, 2.0, 8.0):
        x = (radius * directions).astype(np.float32)
        d, g = (np.asarray(v) for v in read(x))
        truth, index = tree.query(x)
        np.testing.assert_allclose(d, truth, rtol=0.15)
        away = (x - kept[index]) / truth[:, None]
        assert (np.sum(g * away, axis=1) > 0.9 * np.linalg.norm(g, axis=1)).all()
        np.testing.assert_allclose(np.linalg.norm(g, axis=1), 1.0, atol=0.6)  # the length is off where levels blend


def test_all_readings_agree_and_are_corrected_by_default(layout, levels, kept) -> None:
    """One keyword, one default, whichever function of the family is asked."""
    x = jnp.asarray(kept[::400] + np.array([0.02, 0.03, 0.08]), jnp.float32)
    one = {
        "map_distance": lambda x, **how: jax.value_and_grad(lambda p: map_distance(layout, levels, 0.7, p, **how))(x),
        "map_distance_and_gradient": lambda x, **how: map_distance_and_gradient(layout, levels, 0.7, x, **how),
    }
    for function in (map_distance, map_distance_and_gradient, map_distances_and_gradients):
        assert inspect.signature(function).parameters["corrected"].default is True
    for how in ({"corrected": False}, {"corrected": True}):
        found = {name: jax.jit(jax.vmap(lambda x, f=f, how=how: f(x, **how)))(x) for name, f in one.items()}
        found["many"] = jax.jit(lambda x, how=how: map_distances_and_gradients(layout, levels, 0.7, x, **how))(x)
        d, g = found["map_distance"]
        for name, (value, slope) in found.items():
            np.testing.assert_allclose(value, d, atol=1e-5, err_msg=f"{name} {how}")
            np.testing.assert_allclose(slope, g, atol=1e-3, err_msg=f"{name} {how}")
        if how.get("corrected") is False:
            plain = d
    assert np.abs(plain - d).max() > 1e-3  # the corrected ones are not the plain ones


def test_curvature_is_corrected(layout, levels, kept, read) -> None:
    """Over the ball the plain field reads too much, the unsafe side; the corrected one is right to a millimetre."""
    directions = np.random.default_rng(4).normal(size=(100, 3))
    directions[:, 2] = np.abs(directions[:, 2]) + 0.5
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    x = jnp.asarray(np.array([0.05, -0.02, 0.24]) + (0.15 + 0.12) * directions, jnp.float32)
    plain = np.asarray(read(x)[0]) - 0.12
    corrected = np.asarray(jax.jit(jax.vmap(lambda x: map_distance(layout, levels, PARAMS.ratio, x)))(x)) - 0.12
    assert plain.mean() > 0.001 and np.abs(corrected.mean()) < 3e-4
    assert np.abs(corrected).max() < 0.004


def test_empty_map(layout, read_one) -> None:
    d, g = read_one[0](empty_map(layout).levels, jnp.asarray([0.1, 0.2, 0.3], jnp.float32))
    assert float(d) == FAR and not np.any(g)


def test_a_query_that_is_not_a_number_is_not_free_space(layout, read, levels) -> None:
    x = jnp.asarray([[jnp.nan, 0.0, 0.3], [0.1, jnp.nan, 0.3]], jnp.float32)
    corrected = jax.jit(jax.vmap(lambda x: map_distance(layout, levels, PARAMS.ratio, x)))
    assert not np.isfinite(read(x)[0]).any() and not np.isfinite(corrected(x)).any()


def test_far_away_and_nowhere(levels, read_one) -> None:
    """Beyond a kilometre the distance is still that; at no place there is none."""
    far = jnp.asarray([3e3, 0.0, 0.0], jnp.float32)
    for read in read_one:
        d, g = read(levels, far)
        np.testing.assert_allclose(d, 3e3, rtol=1e-3)
        np.testing.assert_allclose(g, [1, 0, 0], atol=1e-2)
        for nowhere in (np.inf, -np.inf, np.nan):
            d, g = read(levels, far.at[1].set(nowhere))
            assert np.isnan(d) and np.isnan(g).all()


def test_as_a_function_its_gradient_is_that_of_both(layout, levels, kept) -> None:
    distance = distance_function(layout, levels, PARAMS.ratio)
    x = jnp.asarray(np.concatenate([queries(kept, 0.0, 0.02, 20), queries(kept, 0.05, 0.3, 20)]))
    d, g = jax.jit(jax.vmap(jax.value_and_grad(distance)))(x)
    expected, towards = jax.jit(jax.vmap(lambda x: map_distance_and_gradient(layout, levels, PARAMS.ratio, x)))(x)
    np.testing.assert_allclose(d, expected, atol=1e-6)
    np.testing.assert_allclose(g, towards, atol=1e-6)
    np.testing.assert_allclose(jax.jit(distance)(x[0]), map_distance(layout, levels, PARAMS.ratio, x[0]), atol=1e-6)


def test_rays_meet_the_mapped_ball_and_square(layout, levels) -> None:
    """By closed form; near the ball's outline a ray may pass by, and is left out."""
    distance = distance_function(layout, levels, PARAMS.ratio)
    random = np.random.default_rng(3)
    origin = np.array([0.3, -0.8, 0.9]) + random.uniform(-0.2, 0.2, (40, 3))
    centre, aim = np.array([0.05, -0.02, 0.24]), random.uniform([-0.35, -0.35, -0.111], [0.35, 0.35, 0.3], (40, 3))
    u = (aim - origin) / np.linalg.norm(aim - origin, axis=1, keepdims=True)
    b, c = np.sum((origin - centre) * u, axis=1), np.sum((origin - centre) ** 2, axis=1)
    beside = np.sqrt(np.maximum(c - b * b, 0.0))
    ball = np.where(beside < 0.15, -b - np.sqrt(np.maximum(0.15**2 - beside**2, 0.0)), np.inf)
    t = np.minimum(ball, (-0.111 - origin[:, 2]) / u[:, 2])
    on = np.abs((origin + t[:, None] * u)[:, :2]).max(axis=1) < 0.45
    clear = (np.abs(beside - 0.15) > 0.03) & (on | (ball < np.inf))
    trace = jax.jit(jax.vmap(lambda o, u: sphere_trace(distance, o, u, 3.0, 0.012)))
    hit = trace(jnp.asarray(origin, jnp.float32), jnp.asarray(u, jnp.float32))
    assert clear.sum() > 20 and bool(hit.found[clear].all())
    assert np.median(np.abs(np.asarray(hit.t) - t)[clear]) < 0.004
    assert np.abs(np.asarray(hit.t) - t)[clear].max() < 0.03
