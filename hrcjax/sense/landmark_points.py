"""Landmarks found in images as points in space: by the rays through their pixels, and by the depth measured there."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.numerics import solve_spd
from hrcjax.sense.camera import Camera, in_image
from hrcjax.sense.noise import NoiseParams, depth_deviation
from hrcjax.sense.points import valid_depth
from hrcjax.typing import Array, Bool, Float, Matrix3, Vector3

NO_INFORMATION = 1e-2
"""Information along every axis before anything is measured: ten metres [1/m^2]."""
ROUNDS = 6


class LandmarkParams(eqx.Module):
    """How well landmarks are known."""

    pixel: float = 2.5
    """Standard deviation of a landmark along each axis of the image, at full resolution [px]."""
    shared: float = 0.3
    """Share of its variance that is the same in all images of a hand that is held, so that no mean lessens it [1]."""
    window: int = eqx.field(static=True, default=3)
    """Pixels to each side of a landmark among which depth is read."""
    front: float = 0.02
    """How far behind the nearest depth in the window another may be and belong to the same surface [m]."""
    below: float = 0.007
    """How far landmarks are below the skin: half the thickness of a finger [m]."""
    doubt: float = 0.03
    """Differences of depth over this weigh little: something else was seen there [m]."""
    depth_error: float = 0.004
    """Standard deviation of depth besides the camera's noise, the same in all images: the landmark may be at the edge of a finger [m]."""


class Located(NamedTuple):
    """A point and how well it is known."""

    point: Vector3
    """[m]."""
    information: Matrix3
    """Inverse of the covariance [1/m^2]."""
    common: Matrix3
    """Part of the covariance that is the same in all images of a hand that is held [m^2]."""


def depth_at(
    depth: Float[Array, "height width"], pixel: Float[Array, "2"], params: LandmarkParams
) -> tuple[Float[Array, ""], Bool[Array, ""]]:
    """Depth of the nearest surface about a pixel, a mean of what lies at most `front` behind the nearest depth [m], and whether there is any.

    Args:
        depth: a measured image; 0 or not finite: none [m].
        pixel: column and row.
    """
    width = 2 * params.window + 1
    inside = (pixel >= 0) & (pixel <= jnp.asarray([depth.shape[1] - 1, depth.shape[0] - 1], pixel.dtype))
    place = jnp.round(jnp.where(inside, pixel, 0)).astype(jnp.int32)
    padded = jnp.pad(depth, params.window)
    patch = jax.lax.dynamic_slice(padded, (place[1], place[0]), (width, width))
    seen = valid_depth(patch)
    nearest = jnp.min(jnp.where(seen, patch, jnp.inf))
    same = seen & (patch <= nearest + params.front)
    some = jnp.any(same) & jnp.all(inside)
    mean = jnp.sum(jnp.where(same, patch, 0)) / jnp.maximum(jnp.sum(same.astype(depth.dtype)), 1)
    return jnp.where(some, mean, 0.0), some


def locate_landmark(
    cameras: Camera,
    pixels: Float[Array, "camera 2"],
    depth: Float[Array, "camera"],
    seen: Bool[Array, "camera"],
    measured: Bool[Array, "camera"],
    params: LandmarkParams,
    noise: NoiseParams,
) -> Located:
    """A landmark in the world by least squares: its pixel in every camera that saw it, and the depth there.

    A depth that disagrees counts little (Cauchy's weights): a landmark that a hand hides from a camera is put into the image by
    its detector all the same, and the depth there is that of the hand. Of one camera the ray and the depth remain.

    Args:
        cameras: stacked.
        pixels: column and row of the landmark in every camera's image.
        depth: measured there, `depth_at` [m].
        seen: which cameras see the landmark.
        measured: which have a depth there.

    Returns:
        Point [m], information [1/m^2] and common covariance [m^2]; nobody sees it: the information is nearly 0.
    """
    dtype = pixels.dtype
    measured = measured & seen
    z = jnp.where(measured, depth, 1.0) + params.below
    rays = jnp.stack(
        [(pixels[:, 0] - cameras.cx) / cameras.fx, (pixels[:, 1] - cameras.cy) / cameras.fy, jnp.ones_like(z)], axis=-1
    )
    guesses = cameras.position + jnp.einsum("cij,cj->ci", cameras.rotation, rays * z[:, None])
    spread = params.pixel * cameras.fx / noise.focal  # in pixels of this image
    deep = jnp.sqrt(depth_deviation(z, noise) ** 2 + params.depth_error**2)

    def rows(x: Array) -> tuple[Array, Array, Array]:
        """Residuals over their deviations (camera 3), their slopes, and weights."""

        def residual(x: Array) -> Array:
            at, own = jax.vmap(in_image, in_axes=(0, None))(cameras, x)
            return jnp.concatenate([(at - pixels) / jnp.expand_dims(spread, 1), ((own - z) / deep)[:, None]], axis=-1)

        e = residual(x)
        doubtful = 1.0 / (1.0 + (e[:, 2] * deep / params.doubt) ** 2)
        weight = jnp.stack([seen.astype(dtype), seen.astype(dtype), measured.astype(dtype) * doubtful], axis=-1)
        return e, jax.jacfwd(residual)(x), weight

    def normal(x: Array) -> tuple[Array, Array]:
        e, J, w = rows(x)
        information = jnp.einsum("ck,cki,ckj->ij", w, J, J) + NO_INFORMATION * jnp.eye(3, dtype=dtype)
        return information, jnp.einsum("ck,cki,ck->i", w, J, e)

    def refined(start: Array) -> tuple[Array, Array]:
        def step(x: Array, _: None) -> tuple[Array, None]:
            information, slope = normal(x)
            return x - solve_spd(information, slope), None

        x, _ = jax.lax.scan(step, start, length=ROUNDS)
        e, _, _ = rows(x)
        # of several starts the one in which most agrees, by Cauchy's cost
        depth_cost = (params.doubt / deep) ** 2 * jnp.log1p((e[:, 2] * deep / params.doubt) ** 2)
        return x, jnp.sum(jnp.where(seen, e[:, 0] ** 2 + e[:, 1] ** 2, 0) + jnp.where(measured, depth_cost, 0))

    found, cost = jax.vmap(refined)(guesses)
    best = found[jnp.argmin(jnp.where(seen & jnp.isfinite(cost), cost, jnp.inf))]
    _, J, w = rows(best)
    information = normal(best)[0]
    alike = jnp.ones_like(w).at[:, :2].set(params.shared).at[:, 2].set((params.depth_error / deep) ** 2)
    gain = jnp.linalg.inv(information)
    common = gain @ jnp.einsum("ck,cki,ckj->ij", w * w * alike, J, J) @ gain
    return Located(best, information, common)


def locate_landmarks(
    cameras: Camera,
    images: Float[Array, "camera height width"],
    pixels: Float[Array, "camera landmark 2"],
    seen: Bool[Array, "camera"],
    params: LandmarkParams | None = None,
    noise: NoiseParams | None = None,
) -> Located:
    """The landmarks of one hand in the world: `locate_landmark` for each; every field has a row for each landmark.

    Args:
        cameras: stacked; images are in their resolution.
        images: measured depth [m].
        pixels: columns and rows; not finite: the landmark is not in that image.
        seen: which cameras' detectors found the hand.
    """
    params, noise = params or LandmarkParams(), noise or NoiseParams()
    there = jnp.all(jnp.isfinite(pixels), axis=-1) & seen[:, None]
    pixels = jnp.where(there[..., None], pixels, 0)
    depth, some = jax.vmap(jax.vmap(depth_at, in_axes=(None, 0, None)), in_axes=(0, 0, None))(images, pixels, params)
    return jax.vmap(locate_landmark, in_axes=(None, 1, 1, 1, 1, None, None))(
        cameras, pixels, depth, there, some, params, noise
    )
