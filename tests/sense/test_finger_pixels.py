"""Pixels of a finger: where rays pass it, slopes of their likelihood, and whether a camera sees it at all."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import norm

from hrcjax.geom.capsules import Capsules
from hrcjax.sense.camera import Camera, render_capsules
from hrcjax.sense.finger_pixels import (  # fmt: skip
    Axis,
    Evidence,
    Patch,
    PixelParams,
    Place,
    patch_of,
    pixel_evidence,
    place_of,
    sees_finger,
)
from hrcjax.sense.noise import NoiseParams, depth_deviation

RADIUS, LENGTH = 0.008, 0.09
TIP = np.array([0.01, -0.02, 2.0])
U = np.array([0.5, 0.8, -0.33]) / np.linalg.norm([0.5, 0.8, -0.33])
PARAMS, NOISE = PixelParams(), NoiseParams()
SIDE = np.cross(U, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(U, [0.0, 0.0, 1.0]))


@pytest.fixture(scope="module")
def camera() -> Camera:
    """At the origin, along z; the finger is in the middle of its image."""
    f = jnp.float32(385.0)
    return Camera(jnp.eye(3, dtype=f.dtype), jnp.zeros(3, f.dtype), f, f, jnp.float32(48.0), jnp.float32(48.0), 96, 96)


@pytest.fixture(scope="module")
def axis() -> Axis:
    joints = jnp.asarray([0.5, 0.2], jnp.float32)
    return Axis(
        jnp.asarray(TIP, jnp.float32), jnp.asarray(LENGTH * U, jnp.float32), joints, jnp.float32(RADIUS), jnp.float32(0)
    )


def image(camera: Camera, behind: float, *more: tuple[np.ndarray, np.ndarray, float]) -> jax.Array:
    """Depth of the finger, and of more capsules, before a wall."""
    ends = [(TIP - LENGTH * U, TIP, RADIUS), *more]
    a, b, r = (jnp.asarray(np.array([end[k] for end in ends]), jnp.float32) for k in range(3))
    return render_capsules(camera, Capsules(a, b, r), jnp.full((96, 96), behind, jnp.float32))


def test_rays_within_the_outline_are_those_that_meet_the_finger(camera, axis) -> None:
    depth = image(camera, jnp.inf)
    patch = patch_of(camera, jnp.where(jnp.isfinite(depth), depth, 0.0), jnp.ones_like(depth), axis, PARAMS)
    place = place_of(camera, patch.rays, axis)
    rows = np.asarray((place.along > 0.02) & (place.along < 0.98) & (jnp.abs(place.inside) > 0.02))
    meets, inside = np.asarray(patch.depth > 0)[rows], np.asarray(place.inside > 0)[rows]
    assert meets.sum() > 30
    np.testing.assert_array_equal(inside, meets)
    middle = np.asarray((place.near < 0.5) & (patch.depth > 0)) & rows
    np.testing.assert_allclose(np.asarray(place.skin)[middle], np.asarray(patch.depth)[middle], atol=5e-4)
    pixel = TIP[2] / 385.0
    step = place_of(camera, patch.rays, axis._replace(radius=axis.radius + jnp.float32(0.001)))
    np.testing.assert_allclose(np.asarray(step.inside - place.inside)[rows], 0.001 / pixel, rtol=0.05)


def test_slopes_are_those_of_the_likelihood() -> None:
    """By central differences of the mixture in NumPy and SciPy; without depth, in front and far behind, too."""
    random, blur = np.random.default_rng(0), 0.4
    inside = random.uniform(-1.5, 1.5, (9, 9))
    depth = 2.0 + random.choice([0.0, 0.01, 0.3], (9, 9)) + 0.003 * random.normal(size=(9, 9))
    depth[0], depth[1] = 0.0, 1.7
    skin, n = np.full((9, 9), 2.0), np.full((9, 9), 8.0)
    sigma = np.sqrt(1.4 * np.asarray(depth_deviation(jnp.asarray(depth), NOISE)) ** 2 / n + PARAMS.skin**2) * (1 + blur)

    def likelihood(inside, skin):
        p = 1 / (1 + np.exp(-inside / blur))
        of_skin = (1 - PARAMS.lost) * norm.pdf(depth, skin, sigma) * PARAMS.other + PARAMS.lost
        ratio = np.where(depth == 0, PARAMS.hole, np.where(depth < 1.9, 1.0, of_skin))
        return np.log(1 - p + p * ratio)

    place = Place(*(jnp.asarray(x, jnp.float32) for x in (inside, skin, np.full((9, 9), 0.5), np.ones((9, 9)))))
    patch = Patch(jnp.zeros((9, 9, 3), jnp.float32), jnp.asarray(depth, jnp.float32), jnp.asarray(n, jnp.float32))
    found: Evidence = pixel_evidence(patch, place, PARAMS, NOISE, blur)
    h = 1e-5
    np.testing.assert_allclose(found.push, (likelihood(inside + h, skin) - likelihood(inside - h, skin)) / (2 * h), rtol=2e-3, atol=1e-4)  # fmt: skip
    slope = (likelihood(inside, skin + h) - likelihood(inside, skin - h)) / (2 * h)
    np.testing.assert_allclose(found.lag, slope, rtol=2e-3, atol=0.05)
    assert (np.asarray(found.edge) >= 0).all() and (np.asarray(found.deep) >= 0).all()
    beyond = pixel_evidence(patch, place._replace(along=jnp.full((9, 9), -0.1, jnp.float32)), PARAMS, NOISE, blur)
    assert all(not np.any(np.asarray(a)) for a in beyond)


def test_a_finger_is_seen_where_it_stands_out(camera, axis) -> None:
    ask = jax.jit(lambda depth: sees_finger(patch := patch_of(camera, depth, jnp.full_like(depth, 8.0), axis, PARAMS), place_of(camera, patch.rays, axis), PARAMS, NOISE))  # fmt: skip
    alone = image(camera, 3.0)
    assert bool(ask(alone))
    beside = (TIP - 0.1 * U + 0.022 * SIDE, TIP - 0.05 * U + 0.022 * SIDE, RADIUS)
    assert bool(ask(image(camera, 3.0, beside))), "half of another finger beside it"
    palm = (TIP - 0.2 * U, TIP + 0.1 * U, 0.06)
    assert not bool(ask(image(camera, 3.0, palm))), "before it"
    level = jnp.where(alone < 2.5, alone, 2.03)
    assert not bool(ask(level)), "of a depth with what is behind"
    assert not bool(ask(jnp.full_like(alone, 1.5))) and not bool(ask(jnp.zeros_like(alone)))
    assert not bool(ask(jnp.full_like(alone, 3.0)))


@pytest.mark.parametrize("shape", [(47, 96), (96, 47), (20, 20)])
def test_an_image_that_is_too_small_is_refused_in_one_line(camera, axis, shape: tuple[int, int]) -> None:
    small = jnp.full(shape, 2.0, jnp.float32)
    with pytest.raises(ValueError, match=f"depth image of {shape[0]} x {shape[1]} .*48 x 48; accepted are") as told:
        patch_of(camera, small, small, axis, PARAMS)
    assert "\n" not in str(told.value)
    whole = jnp.full((48, 48), 2.0, jnp.float32)
    assert patch_of(camera, whole, whole, axis, PARAMS).depth.shape == (48, 48)
