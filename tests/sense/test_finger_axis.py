"""The axis of a finger: exact images give it back, noise within what is told, and what is no finger is left alone."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import chi2, norm

from hrcjax.geom.capsules import Capsules
from hrcjax.hand import Line
from hrcjax.sense import d435i
from hrcjax.sense.camera import Camera, render_capsules
from hrcjax.sense.finger_axis import Seen, chi_square, finger_line
from hrcjax.sense.noise import NoiseParams, measure
from hrcjax.sense.rig import stack_cameras
from hrcjax.sense.still_depth import still_depth

EYES = ((1.2, -0.7, 1.5), (-1.2, -0.7, 1.4))
TIP = np.array([0.05, 0.1, 0.2], np.float32)
U = np.array([0.3, 0.2, -0.93], np.float32)
U /= np.linalg.norm(U)
LENGTH, RADIUS, SPREAD = 0.085, 0.008, 1.0
IMAGES = 8


@pytest.fixture(scope="module")
def cameras():
    """Of each the part of the image about the finger."""
    size, found = np.array([96, 96]), []
    for eye in EYES:
        camera = d435i(jnp.asarray(eye, jnp.float32), jnp.zeros(3, jnp.float32), 1)
        own = (TIP - np.asarray(camera.position)) @ np.asarray(camera.rotation)
        at = own[:2] / own[2] * float(camera.fx) + np.array([camera.cx, camera.cy])
        cx, cy = (
            jnp.float32(float(c) - o) for c, o in zip((camera.cx, camera.cy), np.round(at - size / 2), strict=True)
        )
        found.append(Camera(camera.rotation, camera.position, camera.fx, camera.fy, cx, cy, *map(int, size)))
    return stack_cameras(found)


@pytest.fixture(scope="module")
def exact(cameras):
    """Depth images of a finger before a wall."""
    capsule = Capsules(*(jnp.asarray(x, jnp.float32) for x in ((TIP - LENGTH * U)[None], TIP[None], [RADIUS])))
    wall = jnp.full((96, 96), 3.0, jnp.float32)
    return jnp.stack([render_capsules(jax.tree.map(lambda a, k=k: a[k], cameras), capsule, wall) for k in range(2)])


@pytest.fixture(scope="module")
def pixels(cameras) -> np.ndarray:
    """Of the landmarks."""
    return marks_at(cameras, TIP)


def marks_at(cameras, tip) -> np.ndarray:
    """Columns and rows of the landmarks of a finger, in NumPy."""
    marks, found = tip - np.array([1.0, 0.5, 0.22, 0.0])[:, None] * LENGTH * U, []
    for R, eye, f, cx, cy in zip(cameras.rotation, cameras.position, cameras.fx, cameras.cx, cameras.cy, strict=True):
        own = (marks - np.asarray(eye)) @ np.asarray(R)
        found.append(own[:, :2] / own[:, 2:] * float(f) + np.array([cx, cy]))
    return np.asarray(found, np.float32)


@pytest.fixture(scope="module")
def line_of(cameras):
    """The line found, of landmarks, depths and a start that is off."""
    far = jnp.eye(6, dtype=jnp.float32) * 1e-3

    @jax.jit
    def run(pixels, depth, count, tip, u, there):
        seen = Seen(pixels, jnp.full(2, SPREAD, jnp.float32), there, depth, count)
        return finger_line(cameras, seen, Line(tip, u / jnp.linalg.norm(u), far), jnp.float32(0.09))

    def line(pixels, depth, count=None, off=0.0, turn=0.0, there=(True, True)):
        count = jnp.full(depth.shape, float(IMAGES), jnp.float32) if count is None else count
        start = jnp.asarray(TIP + off), jnp.asarray(U + turn)
        return jax.tree.map(np.asarray, run(jnp.asarray(pixels), depth, count, *start, jnp.asarray(there)))

    return line


def angle(u) -> float:
    return float(np.degrees(np.arccos(min(float(u @ U), 1.0))))


def test_a_finger_of_exact_images_is_found_from_a_start_that_is_off(line_of, exact, pixels) -> None:
    move = np.array([0.004, -0.003, 0.003], np.float32)
    found = line_of(pixels, exact, off=move, turn=np.array([0.05, -0.04, 0.0], np.float32))
    assert angle(found.direction) < 1.0 and np.abs(found.tip - TIP).max() < 2e-3
    assert np.linalg.norm(found.direction) == pytest.approx(1.0, abs=1e-5)


def test_without_depth_the_landmarks_give_the_line(line_of, exact, pixels) -> None:
    found = line_of(pixels, jnp.zeros_like(exact), off=np.float32(0.003))
    np.testing.assert_allclose(found.tip, TIP, atol=1e-3)
    assert angle(found.direction) < 0.5  # the finger is shorter than expected
    with_depth = line_of(pixels, exact)
    told, less = (np.degrees(np.sqrt(np.trace(f.covariance[3:, 3:]) / 2)) for f in (found, with_depth))
    assert less < 0.5 * told


def test_errors_are_as_told_and_less_than_by_landmarks(line_of, cameras, exact, pixels) -> None:
    """Fingers of noisy images and landmarks: normalised errors of the direction have a mean of about 1."""
    rng = np.random.default_rng(0)
    noisy = jax.jit(
        lambda keys: jax.vmap(
            lambda own: jax.vmap(lambda z, c, k: measure(z, c, k, NoiseParams()))(exact, cameras, own)
        )(keys)
    )
    across = np.linalg.svd(U[None].astype(float))[2][1:]
    angles, bare, squares = [], [], []
    for k in range(24):
        images = noisy(jax.random.split(jax.random.key(k), (IMAGES, 2)))
        marks = (pixels + SPREAD * rng.normal(size=pixels.shape)).astype(np.float32)
        found = line_of(marks, *still_depth(images, jnp.ones(IMAGES, bool)))
        alone = line_of(marks, jnp.zeros_like(exact))
        e, C = across @ (found.direction - U), across @ found.covariance[3:, 3:] @ across.T
        squares.append(e @ np.linalg.solve(C, e) / 2)
        angles.append(angle(found.direction))
        bare.append(angle(alone.direction))
    assert np.median(angles) < 0.5 * np.median(bare) and np.max(angles) < 4
    assert 0.2 < np.mean(squares) < 1.6


def test_what_contradicts_the_landmarks_is_not_taken(line_of, exact, pixels) -> None:
    """Another finger a centimetre and a half beside: the start comes back as it was."""
    found = line_of(pixels + np.float32(4.5), exact, turn=np.array([0.1, 0.0, 0.0], np.float32))
    assert angle(found.direction) > 4 and float(found.covariance[0, 0]) == pytest.approx(1e-3)
    nothing = line_of(np.full_like(pixels, np.nan), jnp.zeros_like(exact))
    assert np.isfinite(nothing.tip).all()


def test_landmarks_that_are_no_numbers_are_as_those_of_no_hand(line_of, exact, pixels) -> None:
    """Of one camera: those that are left are eight numbers, which err less by chance than sixteen; so that the line is refused sooner."""
    aside = np.array([[-1.0, 1.0], [1.0, -1.0]], np.float32)[:, None] * np.float32(0.7071)
    turn = np.array([0.1, 0.0, 0.0], np.float32)
    for far, kept in ((1.5, True), (2.75, False)):
        off = pixels + np.float32(far) * aside
        lost = np.concatenate([off[:1], np.full_like(off[1:], np.nan)])
        line, same = line_of(lost, exact, turn=turn), line_of(off, exact, turn=turn, there=(True, False))
        np.testing.assert_array_equal(line.direction, same.direction)
        assert (float(line.covariance[0, 0]) < 5e-4) == kept


def test_landmarks_that_err_more_than_told_do_not_refuse_the_pixels(line_of, cameras, exact, pixels) -> None:
    """By half more than told: the least squares of a finger of their own say so. A finger 4 cm beside is still refused."""
    rng, turn = np.random.default_rng(3), np.array([0.1, 0.0, 0.0], np.float32)
    noise = 1.5 * SPREAD * rng.normal(size=(8, *pixels.shape))
    found = [line_of((pixels + e).astype(np.float32), exact, turn=turn) for e in noise]
    assert all(float(line.covariance[0, 0]) < 5e-4 for line in found)
    assert np.median([angle(line.direction) for line in found]) < 1.5
    other = marks_at(cameras, TIP + np.array([0.0, 0.04, 0.0]))
    beside = [line_of((other + e).astype(np.float32), exact, turn=turn) for e in noise[:3]]
    assert all(float(line.covariance[0, 0]) == pytest.approx(1e-3) for line in beside)


def test_of_cameras_that_see_something_else_only_landmarks_count(line_of, cameras, exact, pixels) -> None:
    """A forearm beside the finger hides it, of its depth, with a border aslant over where it should be."""
    images = []
    for k in range(2):
        out = np.cross(U, np.asarray(cameras.rotation[k, :, 2]))
        out /= np.linalg.norm(out)
        middle, aslant = TIP - 0.5 * LENGTH * U - 0.04 * out, U + 0.25 * out
        ends = np.stack([middle - 0.3 * aslant, middle + 0.3 * aslant])[:, None]
        arm = Capsules(*(jnp.asarray(x, jnp.float32) for x in (*ends, [0.04])))
        images.append(render_capsules(jax.tree.map(lambda a, k=k: a[k], cameras), arm, exact[k]))
    for shown in (jnp.stack(images), exact.at[1].set(images[1])):
        found = line_of(pixels + np.float32(0.7), shown, turn=np.array([0.05, -0.04, 0.0], np.float32))
        left = jnp.where((shown == exact).all((1, 2), keepdims=True), exact, 0.0)
        alone = line_of(pixels + np.float32(0.7), left)
        np.testing.assert_allclose(found.direction, alone.direction, atol=2e-3)
        np.testing.assert_allclose(found.covariance, alone.covariance, atol=1e-6)


@pytest.mark.parametrize("freedom", [4.0, 12.0, 20.0])
def test_the_limit_of_disagreement_is_the_quantile_for_any_number_of_cameras(freedom: float) -> None:
    told = float(chi_square(jnp.float32(freedom), float(norm.ppf(0.999))))
    assert told == pytest.approx(chi2.ppf(0.999, freedom), rel=0.02)
