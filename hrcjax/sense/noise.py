"""Noise model of a stereo depth camera: the D435i's noise, holes and flying pixels, from an exact depth image."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.sense.camera import Camera
from hrcjax.typing import Array, Bool, Float, PRNGKeyArray


class NoiseParams(eqx.Module):
    """Parameters of the noise model. Values without another source are our estimates for a D435i."""

    subpixel: float = 0.08
    """Standard deviation s of the disparity at full resolution [px]."""
    focal: float = 385.0
    """Focal length at full resolution, for any decimation [px]."""
    baseline: float = 0.05
    """Distance of the two imagers [m]."""
    step: float = 0.001
    """Quantisation step of depth [m]."""
    near: float = 0.28
    """Smallest measured depth [m]."""
    far: float = 6.0
    """Largest measured depth [m]."""
    edge: float = 0.06
    """Depth difference between neighbours that counts as an edge [m]."""
    flying: float = 0.25
    """Probability that a pixel at an edge lies somewhere between foreground and background [1]."""


def depth_deviation(depth: Float[Array, "*image"], params: NoiseParams) -> Float[Array, "*image"]:
    """Standard deviation of a measured depth [m]: sigma_z = s Z^2 / (f B)."""
    return depth * depth * (params.subpixel / (params.focal * params.baseline))


def shadow(depth: Float[Array, "height width"], camera: Camera, params: NoiseParams) -> Bool[Array, "height width"]:
    """Stereo shadow: True where the right imager does not observe a surface of the left one, the reference: left of near edges.

    Pixel u of depth Z is at u - f B / Z in the right image. It is occluded if a pixel to its right projects there, or
    further left.
    """
    column = jnp.arange(camera.width).astype(depth.dtype)
    place = column - camera.fx * params.baseline / jnp.maximum(depth, 1e-3)
    least_right = jax.lax.cummin(place, axis=1, reverse=True)
    return jnp.concatenate([least_right[:, 1:], jnp.full_like(place[:, :1], jnp.inf)], axis=1) < place


def _neighbours(depth: Float[Array, "height width"]) -> tuple[Array, Array]:
    """Smallest and largest depth of a pixel and its four neighbours."""
    padded = jnp.pad(depth, 1, mode="edge")
    around = (depth, padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:])
    least, greatest = around[0], around[0]
    for image in around[1:]:
        least, greatest = jnp.minimum(least, image), jnp.maximum(greatest, image)
    return least, greatest


def measure(
    depth: Float[Array, "height width"], camera: Camera, key: PRNGKeyArray, params: NoiseParams
) -> Float[Array, "height width"]:
    """A measured depth image from an exact one [m]; 0: no measurement, as of the sensor.

    Gaussian disparity noise, flying pixels at edges, holes in the stereo shadow, range limits, and quantisation to `step`,
    with a straight-through derivative of 1.
    """
    key_noise, key_edge = jax.random.split(key)
    finite = jnp.isfinite(depth)
    exact = jnp.where(finite, depth, params.far + 1)
    least, greatest = _neighbours(exact)
    draw = jax.random.uniform(key_edge, depth.shape, depth.dtype)
    flies = (greatest - least > params.edge) & (draw < params.flying)
    between = least + (greatest - least) * draw / params.flying  # given that it flies, draw / flying is uniform again
    seen = jnp.where(flies, between, exact)
    noisy = seen + depth_deviation(seen, params) * jax.random.normal(key_noise, depth.shape, depth.dtype)
    rounded = noisy + jax.lax.stop_gradient(jnp.round(noisy / params.step) * params.step - noisy)
    valid = finite & (rounded >= params.near) & (rounded <= params.far) & ~shadow(exact, camera, params)
    return jnp.where(valid, rounded, 0)
