"""The least error that any unbiased estimate of a finger's line can have (Cramer and Rao), by what its landmarks and its depths tell."""

import numpy as np
from numpy.typing import NDArray

from hrcjax.sense import NoiseParams
from hrcjax.sense.camera import Camera

from .hand import FINGER
from .watch import spread_of

DRAWS = 200
"""Draws of a line from its covariance, of each trial."""
STEP = 1e-5
"""Of central differences [m]."""
JOINTS = (1.0, 0.5, 0.22, 0.0)
"""Unknown places of the middle landmarks between tip and base, about which slopes are taken [1]."""


def line_information(
    cameras: Camera, line: NDArray, pixel: float, shared: float, images: float, depths: bool
) -> NDArray:
    """(6 6) Fisher information of tip and base of a finger [1/m^2].

    Args:
        line: (4 3) its landmarks, from base to tip [m].
        pixel: standard deviation of a landmark in a colour image [px].
        shared: share of its variance that is the same in all images [1].
        images: of each camera.
        depths: whether the depths of all pixels on the finger are known as well, as if nothing hid it. What its outline tells
            has no such bound: in a model without blur it is exact but for whole pixels.
    """
    joints = np.array([(line[-1] - x) @ (line[-1] - line[0]) for x in line]) / np.sum((line[-1] - line[0]) ** 2)
    noise = NoiseParams()
    deviation = float(spread_of(np.float64(pixel), noise)) * np.sqrt(shared + (1 - shared) / images)  # pyright: ignore[reportArgumentType]  # an array of NumPy
    N = np.zeros((8, 8))
    count = len(np.asarray(cameras.position))
    for k in range(count):
        R, eye, f, c = _numbers(cameras, k)

        def marks(x: NDArray, R: NDArray = R, eye: NDArray = eye, f: NDArray = f, c: NDArray = c) -> NDArray:
            share = np.array([1.0, x[6], x[7], 0.0])[:, None]
            own = (x[:3] + share * (x[3:6] - x[:3]) - eye) @ R
            return ((own[:, :2] / own[:, 2:]) * f + c).ravel()

        at = np.concatenate([line[-1], line[0], joints[1:3]])
        J = _slopes(marks, at)
        N += J.T @ J / deviation**2
        if depths:
            rays = _rays_on(at, R, eye, f, c)
            depth = lambda x, rays=rays, R=R, eye=eye: _depths(x, rays, R, eye)[0]  # noqa: E731
            own = _depths(at, rays, R, eye)
            J = _slopes(depth, at)[own[1]]
            sigma = own[0][own[1]] ** 2 * noise.subpixel / (noise.focal * noise.baseline)
            N += (J.T / (sigma**2 / images)) @ J
    whole = N[:6, :6] - N[:6, 6:] @ np.linalg.pinv(N[6:, 6:]) @ N[6:, :6]
    return 0.5 * (whole + whole.T)


def bound_errors(
    cameras: Camera, line: NDArray, place: NDArray, normal: NDArray, pixel: float, shared: float, images: float, depths: bool, seed: int
) -> NDArray:  # fmt: skip
    """(draw) Distances of places from the true one, of lines with the least covariance that is possible, on the plane of the surface [m]."""
    covariance = np.linalg.inv(line_information(cameras, line, pixel, shared, images, depths))
    tip, base = line[-1], line[0]
    length = np.linalg.norm(tip - base)
    u = (tip - base) / length
    flat = np.eye(3) - np.outer(u, u)
    moves = np.random.default_rng(seed).multivariate_normal(np.zeros(6), covariance, DRAWS, method="eigh")
    turned = (moves[:, :3] - moves[:, 3:]) @ flat / length
    aside = moves[:, :3] + np.linalg.norm(place - tip) * turned
    return np.linalg.norm(aside - np.outer(aside @ normal, u) / (normal @ u), axis=1)


def _numbers(cameras: Camera, k: int) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    f, c = (
        (np.asarray(a, float)[k], np.asarray(b, float)[k])
        for a, b in ((cameras.fx, cameras.fy), (cameras.cx, cameras.cy))
    )
    return np.asarray(cameras.rotation, float)[k], np.asarray(cameras.position, float)[k], np.array(f), np.array(c)


def _slopes(function, x: NDArray) -> NDArray:
    return np.stack([(function(x + e) - function(x - e)) / (2 * STEP) for e in STEP * np.eye(len(x))], axis=-1)


def _rays_on(x: NDArray, R: NDArray, eye: NDArray, f: NDArray, c: NDArray) -> NDArray:
    """(pixel 3) Rays of all pixels about a finger."""
    ends = np.stack([(x[3 * k : 3 * k + 3] - eye) @ R for k in range(2)])
    at = ends[:, :2] / ends[:, 2:] * f + c
    low, high = np.floor(at.min(axis=0)) - 8, np.ceil(at.max(axis=0)) + 8
    u, v = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
    return np.stack([(u.ravel() - c[0]) / f[0], (v.ravel() - c[1]) / f[1], np.ones(u.size)], axis=-1)


def _depths(x: NDArray, rays: NDArray, R: NDArray, eye: NDArray) -> tuple[NDArray, NDArray]:
    """Depth of the skin along rays [m], and which meet it between base and tip."""
    T, B = ((x[3 * k : 3 * k + 3] - eye) @ R for k in range(2))
    w = (B - T) / np.linalg.norm(B - T)
    d = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    # |(s d - T) across w| = r
    dw, Tw = d @ w, T @ w
    a = 1 - dw**2
    b = d @ T - dw * Tw
    root = b**2 - a * (T @ T - Tw**2 - FINGER**2)
    s = (b - np.sqrt(np.maximum(root, 0))) / a
    along = (s * dw - Tw) / np.linalg.norm(B - T)
    return s * d[:, 2], (root > 0) & (along > 0) & (along < 1)
