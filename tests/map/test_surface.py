"""Normals and curvatures against spheres, cylinders, tori and planes, seen from both sides, and what is refused."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.geom.cloud import Cloud
from hrcjax.map import Surface, View, describe_surface, empty_map, fit_surface, map_surface
from hrcjax.map.surface import AMBIGUOUS, CURVED, FEW, OFF, ROUGH
from hrcjax.sense import d435i

SPACING, SCALE = 0.025, 0.05
SAMPLES, CAPACITY = 60_000, 4096


def _turned(kind: str, size: tuple[float, ...], random: np.random.Generator):
    """Dense points on a body about the origin, outward normals, and principal curvatures seen from outside."""
    a, b = random.uniform(0, 2 * np.pi, (2, SAMPLES))
    c = random.uniform(-0.3, 0.3, SAMPLES)
    zero = np.zeros(SAMPLES)
    if kind == "sphere":
        n = random.normal(size=(SAMPLES, 3))
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        return size[0] * n, n, np.full((SAMPLES, 2), 1 / size[0])
    if kind == "cylinder":
        n = np.stack([np.cos(a), np.sin(a), zero], axis=1)
        return size[0] * n + np.stack([zero, zero, c], axis=1), n, np.tile([1 / size[0], 0.0], (SAMPLES, 1))
    if kind == "plane":
        p = np.stack([random.uniform(-0.3, 0.3, SAMPLES), c, zero], axis=1)
        return p, np.tile([0.0, 0.0, 1.0], (SAMPLES, 1)), np.zeros((SAMPLES, 2))
    ring, tube = size
    n = np.stack([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)], axis=1)
    p = tube * n + ring * np.stack([np.cos(a), np.sin(a), zero], axis=1)
    curvatures = np.stack([np.full(SAMPLES, 1 / tube), np.cos(b) / (ring + tube * np.cos(b))], axis=1)
    return p, n, curvatures


def sample(kind: str, size: tuple[float, ...], noise: float, seed: int = 0):
    """One point in each voxel: float32 points, exact normals and curvatures there."""
    random = np.random.default_rng(seed)
    p, n, k = _turned(kind, size, random)
    p = p + 0.0123
    voxel = np.floor(p / SPACING).astype(int) @ np.array([1 << 20, 1 << 10, 1])
    _, first = np.unique(voxel, return_index=True)
    p, n, k = p[first], n[first], k[first]
    p = p + noise * random.normal(size=p.shape)
    return p.astype(np.float32), n.astype(np.float32), k


@jax.jit
def surfaces(points: jax.Array, mask: jax.Array, x: jax.Array, viewpoint: jax.Array, scale: jax.Array) -> Surface:
    def one(pair):
        x, viewpoint = pair
        r2 = jnp.where(mask, jnp.sum((points - x) ** 2, axis=1), jnp.inf)
        _, best = jax.lax.top_k(-r2, 128)
        return fit_surface(Cloud(points[best], mask[best]), x, viewpoint, scale)

    return jax.lax.map(one, (x, viewpoint), batch_size=32)


def ask(points, x, viewpoint, scale: float = SCALE) -> Surface:
    """All at one size, so that one program is compiled."""
    full = np.zeros((CAPACITY, 3), np.float32)
    full[: len(points)] = points
    count = len(x)
    x, viewpoint = (np.resize(v, (128, 3)).astype(np.float32) for v in (x, viewpoint))
    got = surfaces(jnp.asarray(full), jnp.arange(CAPACITY) < len(points), x, viewpoint, jnp.float32(scale))
    return jax.tree.map(lambda v: np.asarray(v)[:count], got)


def chosen(points: np.ndarray, count: int = 128) -> np.ndarray:
    """Some points that are not at the end of what was sampled of a cylinder, or of a plane."""
    flat = np.ptp(points[:, 2]) < 0.01
    inside = np.nonzero(np.max(np.abs(points[:, :2] if flat else points[:, 2:]), axis=1) < (0.13 if flat else 0.2))[0]
    return np.random.default_rng(1).permutation(inside)[:count]


BODIES = [
    ("sphere", (0.1,)), ("sphere", (0.2,)), ("cylinder", (0.1,)), ("cylinder", (0.2,)), ("torus", (0.2, 0.1)), ("torus", (0.25, 0.12)),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "size"), BODIES)
@pytest.mark.parametrize("noise", [0.0, 0.002])
def test_normals_and_curvatures_from_both_sides(kind, size, noise):
    points, normals, curvatures = sample(kind, size, noise)
    index = chosen(points)
    x, n, k = points[index], normals[index], curvatures[index]
    for side in (1.0, -1.0):
        got = ask(points, x, x + side * 0.5 * n)
        assert np.mean(got.reasons == 0) > 0.98, [describe_surface(r) for r in np.unique(got.reasons)]
        ok = got.reasons == 0
        angle = np.degrees(np.arccos(np.clip(np.sum(side * n * got.normal, axis=1), -1, 1)))[ok]
        assert np.median(angle) < 2.5 and np.percentile(angle, 95) < 8
        want = np.sort(side * k, axis=1)[:, ::-1]
        error = np.abs(got.curvatures - want)[ok] / np.max(np.abs(k), axis=1)[ok, None]
        assert np.percentile(error, 95) < 0.1
        assert np.median(error) < 0.03


def test_planes_are_flat_and_the_height_is_signed():
    points, _, _ = sample("plane", (), 0.0)
    x = points[chosen(points, 16)] + np.asarray([0, 0, 0.004], np.float32)  # the plane is at 0.0123
    got = ask(points, x, x + np.asarray([0.3, 0.2, 1.0], np.float32))
    assert np.all(got.reasons == 0)
    np.testing.assert_allclose(got.normal, np.tile([0, 0, 1.0], (16, 1)), atol=1e-3)
    np.testing.assert_allclose(got.curvatures, 0, atol=0.02)
    assert np.min(got.planarity) > 0.75  # the points are not spread evenly, and end 3 length scales away
    np.testing.assert_allclose(got.height, 0.004, atol=1e-4)
    below = ask(points, x, x - np.asarray([0.3, 0.2, 1.0], np.float32))
    np.testing.assert_allclose(below.height, -0.004, atol=1e-4)


def test_planarity_of_a_sphere():
    points, normals, _ = sample("sphere", (0.2,), 0.0)
    index = chosen(points, 64)
    got = ask(points, points[index], points[index] + 0.5 * normals[index], 0.04)
    np.testing.assert_allclose(np.mean(got.planarity), 1 - 2 * (0.04 / 0.2) ** 2, atol=0.015)


def test_refusals():
    for kind, radius, bit in (("sphere", 0.06, AMBIGUOUS), ("cylinder", 0.075, CURVED)):  # l > R / sqrt(3)
        points, normals, _ = sample(kind, (radius,), 0.0)
        index = chosen(points, 32)
        assert np.all(ask(points, points[index], points[index] + 0.5 * normals[index]).reasons & bit)
    x, up = np.zeros((1, 3), np.float32), np.asarray([[0, 0, 1.0]], np.float32)
    flat, _, _ = sample("plane", (), 0.0)
    x = x + np.asarray([0, 0, 0.0123], np.float32)
    few = flat[np.argsort(np.sum(flat**2, axis=1))[:5]]
    assert ask(few, x, up).reasons[0] & FEW
    nothing = ask(np.zeros((0, 3), np.float32), x, up)
    assert nothing.reasons[0] & FEW and np.isfinite(nothing.normal).all() and np.isfinite(nothing.curvatures).all()
    assert ask(flat, x + np.asarray([0, 0, 0.045], np.float32), up).reasons[0] & OFF
    assert (
        ask(flat, flat[chosen(flat, 1)], flat[chosen(flat, 1)] + np.asarray([[0.5, 0, 0.001]])).reasons[0] & AMBIGUOUS
    )
    line = np.stack([np.linspace(-0.3, 0.3, 200), np.zeros(200), np.zeros(200)], axis=1)
    assert ask(line, x, up).reasons[0] & AMBIGUOUS
    board = np.concatenate([flat, flat - np.asarray([0, 0, 0.03], np.float32)])  # both sides of 3 cm
    assert np.all(ask(board, board[:1] * 0 + flat[chosen(flat, 1)], up).reasons != 0)
    with_words = describe_surface(FEW | ROUGH)
    assert "too few points" in with_words and "smooth" in with_words and describe_surface(0) == "none"


def test_derivatives_are_finite(dtype):
    points, normals, _ = sample("sphere", (0.15,), 0.001)
    near = np.argsort(np.sum((points - points[40]) ** 2, axis=1))[:128]
    x, view = (jnp.asarray(v, dtype) for v in (points[40], points[40] + normals[40]))
    flat = np.stack([*np.meshgrid(*2 * [np.arange(-5, 6) * 0.025]), np.zeros((11, 11))], axis=-1).reshape(-1, 3)

    def numbers(points, x, scale):
        got = fit_surface(Cloud(points, jnp.ones(len(points), bool)), x, view, scale)
        return jnp.concatenate([got.normal, got.curvatures, got.planarity[None], got.height[None]])

    slopes = jax.jit(jax.jacrev(numbers, argnums=(0, 1, 2)))
    for cloud, at in ((points[near], x), (flat, jnp.zeros(3, dtype))):  # the plane's tangential eigenvalues coincide
        for slope in slopes(jnp.asarray(cloud, dtype), at, jnp.asarray(SCALE, dtype)):
            assert slope.dtype == dtype and np.isfinite(slope).all()


def test_on_a_map(layout, points_program):
    """A ball of 15 cm as points of a map: what it says from outside."""
    points, normals, _ = sample("sphere", (0.15,), 0.0005)
    camera = d435i(jnp.asarray([0.0, -1.0, 0.8], jnp.float32), jnp.zeros(3, jnp.float32), 1)
    view = View(
        jnp.asarray(points),
        jnp.ones(len(points), bool),
        jnp.full(len(points), 1e-6),
        jnp.zeros((120, 160), jnp.float32),
    )
    state, _ = points_program(empty_map(layout), camera, view)
    at = jax.jit(jax.vmap(lambda x, v: map_surface(layout, state.levels, x, v)))
    seen = np.nonzero(normals @ np.asarray([0.0, -0.78, 0.62]) > 0.6)[0][:32]
    got = jax.tree.map(np.asarray, at(points[seen], points[seen] + normals[seen]))
    assert np.all(got.reasons == 0)
    assert np.min(np.sum(got.normal * normals[seen], axis=1)) > np.cos(np.radians(4))
    np.testing.assert_allclose(got.curvatures, 1 / 0.15, rtol=0.1)
