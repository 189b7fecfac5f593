"""Landmarks as points: exact ones are found, what hides them from a camera is not believed, and the covariance is that of draws."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.sense import d435i
from hrcjax.sense.landmark_points import LandmarkParams, locate_landmark, locate_landmarks
from hrcjax.sense.noise import NoiseParams, depth_deviation
from hrcjax.sense.rig import stack_cameras

PLACE = np.array([0.1, 0.2, 0.3])
EYES = ((1.2, -0.7, 1.5), (-1.2, -0.7, 1.4))
PARAMS = LandmarkParams(below=0.0)


@pytest.fixture(scope="module")
def cameras():
    return stack_cameras([d435i(jnp.asarray(eye), jnp.zeros(3), 1) for eye in EYES])


def seen_at(cameras, x):
    """Columns, rows and depths of a point, in NumPy."""
    own = [np.asarray(R).T @ (x - np.asarray(p)) for R, p in zip(cameras.rotation, cameras.position, strict=True)]
    f, c = np.asarray(cameras.fx), np.stack([cameras.cx, cameras.cy], -1)
    return np.stack([v[:2] / v[2] * f[k] + c[k] for k, v in enumerate(own)]), np.array([v[2] for v in own])


def located(cameras, pixels, depth, seen=(True, True), measured=(True, True)):
    given = (jnp.asarray(x) for x in (pixels, depth, seen, measured))
    return locate_landmark(cameras, *given, PARAMS, NoiseParams())


def test_an_exact_landmark_is_found_by_one_camera_and_by_two(cameras) -> None:
    pixels, depth = seen_at(cameras, PLACE)
    for seen in ((True, True), (True, False), (False, True)):
        np.testing.assert_allclose(located(cameras, pixels, depth, seen).point, PLACE, atol=1e-4)
    rays_alone = located(cameras, pixels, depth, measured=(False, False))
    np.testing.assert_allclose(rays_alone.point, PLACE, atol=1e-4)
    nobody = located(cameras, pixels, depth, (False, False))
    assert np.trace(nobody.information) < 1


def test_the_depth_of_what_hides_a_landmark_is_not_believed(cameras) -> None:
    pixels, depth = seen_at(cameras, PLACE)
    for hidden in (0, 1):
        front = depth - 0.25 * (np.arange(2) == hidden)
        np.testing.assert_allclose(located(cameras, pixels, front).point, PLACE, atol=0.012)


def test_the_information_is_that_of_many_draws(cameras) -> None:
    rng = np.random.default_rng(0)
    pixels, depth = seen_at(cameras, PLACE)
    deviation = np.sqrt(np.asarray(depth_deviation(jnp.asarray(depth), NoiseParams())) ** 2 + PARAMS.depth_error**2)
    many = jnp.asarray(pixels + rng.normal(0, PARAMS.pixel, (500, 2, 2)))
    depths, sure = jnp.asarray(depth + rng.normal(0, deviation, (500, 2))), jnp.ones(2, bool)
    one = lambda p, z: locate_landmark(cameras, p, z, sure, sure, PARAMS, NoiseParams())  # noqa: E731
    found = jax.jit(jax.vmap(one))(many, depths)
    drawn, told = np.cov(np.asarray(found.point).T), np.linalg.inv(np.asarray(found.information).mean(axis=0))
    np.testing.assert_allclose(np.sqrt(np.diag(drawn) / np.diag(told)), 1.0, atol=0.25)


def test_depth_is_read_from_the_front_and_a_missing_landmark_counts_nothing(cameras) -> None:
    pixels, depth = seen_at(cameras, PLACE)
    images = np.full((2, 480, 640), 3.0)  # a wall behind
    for k, (u, v) in enumerate(np.round(pixels).astype(int)):
        images[k, v - 1 : v + 2, u - 1 : u + 2] = depth[k]
    two = np.stack([pixels, np.full_like(pixels, np.nan)], axis=1)
    points, information, _ = locate_landmarks(cameras, jnp.asarray(images), jnp.asarray(two), jnp.ones(2, bool), PARAMS)
    np.testing.assert_allclose(points[0], PLACE, atol=0.003)
    assert np.trace(information[0]) > 1e4 and np.trace(information[1]) < 1


def test_the_common_covariance_is_that_of_errors_that_stay(cameras) -> None:
    """Draws of the shared part of the pixels' errors and of the skin's depth alone; without both there is none."""
    rng = np.random.default_rng(0)
    pixels, depth = seen_at(cameras, PLACE)
    share, sure = PARAMS.shared, jnp.ones(2, bool)
    many = jnp.asarray(pixels + rng.normal(0, PARAMS.pixel * share**0.5, (500, 2, 2)))
    depths = jnp.asarray(depth + rng.normal(0, PARAMS.depth_error, (500, 2)))
    one = lambda p, z: locate_landmark(cameras, p, z, sure, sure, PARAMS, NoiseParams())  # noqa: E731
    found = jax.jit(jax.vmap(one))(many, depths)
    drawn, told = np.cov(np.asarray(found.point).T), np.asarray(found.common).mean(axis=0)
    np.testing.assert_allclose(np.sqrt(np.diag(drawn) / np.diag(told)), 1.0, atol=0.2)
    none = LandmarkParams(below=0.0, shared=0.0, depth_error=0.0)
    assert np.abs(locate_landmark(cameras, many[0], depths[0], sure, sure, none, NoiseParams()).common).max() < 1e-12
