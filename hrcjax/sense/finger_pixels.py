"""What the pixels of a depth image say of a finger: which it covers, and how deep its skin is there."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.numerics import safe_divide, safe_norm, safe_sqrt
from hrcjax.sense.camera import Camera, in_image
from hrcjax.sense.noise import NoiseParams, depth_deviation
from hrcjax.typing import Array, Float, Scalar, Vector3

MEAN_LOSS = 1.4
"""Variance of `still_depth` at an edge, where one depth in four flies, over that of a mean of as many as agree [1]."""
IN_FRONT = 3.0
"""A pixel nearer than the skin by so many standard deviations tells nothing: something hides the finger [1]."""
RING = (0.5, 2.5)
"""Pixels so far outside the outline should lie behind the finger [px]."""


class Axis(NamedTuple):
    """Unknowns of a finger."""

    tip: Vector3
    """[m]"""
    along: Vector3
    """From the base to the tip [m]."""
    joints: Float[Array, "2"]
    """Places of middle and last joint between tip (0) and base (1) [1]."""
    radius: Float[Array, ""]
    """[m]"""
    swell: Float[Array, ""]
    """How much wider its outline is to each side: a stereo camera matches windows of pixels [px]."""


class PixelParams(eqx.Module):
    """How pixels are read. Values are our choice, made on trials that are not those of the page of pointing."""

    clear: float = 0.82
    """From tip (0) to base (1), the part of a finger in front of its knuckle [1]."""
    beside: float = 3.5
    """Pixels count up to this distance from the axis, over the radius [1]."""
    skin: float = 0.003
    """Standard deviation of the depth of the skin besides noise [m]."""
    blur: float = 0.08
    """How sharp the outline is: the width of a logistic step [px]. Whole pixels make it that of a line to a fraction of one."""
    wide: float = 1.0
    """The same in the first round: a start that is off must find the outline [px]."""
    other: float = 0.5
    """Something else may be anywhere over this range of depth [m]."""
    lost: float = 0.05
    """Share of pixels that say the opposite of what is there [1]."""
    hole: float = 0.2
    """How likely a pixel without depth is on a finger, over how likely it is beside it [1]."""
    covered: float = 0.65
    """A camera sees the finger if this share of the pixels within its outline is as deep as its skin [1]."""
    behind: float = 0.65
    """And this share of those in a ring about it is behind [1]."""
    least: float = 8.0
    """And if so many pixels are on it [1]."""
    patch: int = eqx.field(static=True, default=48)
    """Columns and rows of the image that are searched [px]."""


class Patch(NamedTuple):
    """The part of a camera's image about a finger."""

    rays: Float[Array, "*camera row column 3"]
    """Of pixels, in the camera, of depth 1."""
    depth: Float[Array, "*camera row column"]
    """[m]; 0: none."""
    images: Float[Array, "*camera row column"]
    """How many agree on it [1]."""


class Place(NamedTuple):
    """Where the rays of pixels pass a finger."""

    inside: Float[Array, "row column"]
    """How far the ray is within the outline [px]."""
    skin: Float[Array, "row column"]
    """Depth of the skin there; beside the finger that of its border [m]."""
    along: Float[Array, "row column"]
    """Place of the ray between tip (0) and base (1) [1]; without a derivative."""
    near: Float[Array, "row column"]
    """Distance of the ray from the axis over the radius [1]; without a derivative."""


class Evidence(NamedTuple):
    """Slopes of the logarithm of the likelihood of a finger's pixels, and their information."""

    push: Float[Array, "row column"]
    """By `Place.inside` [1/px]."""
    edge: Float[Array, "row column"]
    """Information on it [1/px^2]."""
    lag: Float[Array, "row column"]
    """By `Place.skin` [1/m]."""
    deep: Float[Array, "row column"]
    """Information on it [1/m^2]."""


def patch_of(
    camera: Camera, depth: Float[Array, "height width"], images: Float[Array, "height width"], axis: Axis, params: PixelParams
) -> Patch:  # fmt: skip
    """The pixels about the middle of a finger; at a border of the image those next to it.

    Raises:
        ValueError: an image smaller than the part that is searched.
    """
    size = params.patch
    if min(depth.shape) < size:
        raise ValueError(
            f"depth image of {depth.shape[0]} x {depth.shape[1]} (rows x columns): a finger is searched in {size} x {size}; "
            f"accepted are images of at least this size, or a smaller PixelParams.patch"
        )
    at, _ = in_image(camera, axis.tip - 0.5 * axis.along)
    most = jnp.asarray([depth.shape[1] - size, depth.shape[0] - size], at.dtype)
    corner = jnp.clip(jnp.round(at - size / 2), 0, most).astype(jnp.int32)
    cut = lambda a: jax.lax.dynamic_slice(a, (corner[1], corner[0]), (size, size))  # noqa: E731
    steps = jnp.arange(size, dtype=corner.dtype)
    u, v = jnp.meshgrid(corner[0] + steps, corner[1] + steps)
    x = (u.astype(at.dtype) - camera.cx) / camera.fx
    y = (v.astype(at.dtype) - camera.cy) / camera.fy
    return Patch(jnp.stack([x, y, jnp.ones_like(x)], axis=-1), cut(depth), cut(images))


def place_of(camera: Camera, rays: Float[Array, "row column 3"], axis: Axis) -> Place:
    """Where rays pass a finger: a straight one of one radius. What lies past its tip is not asked: it may be what the finger touches."""
    cut = jax.lax.stop_gradient
    T = (axis.tip - camera.position) @ camera.rotation
    w = -(axis.along @ camera.rotation)  # from the tip to the base
    # nearest points of ray s d and axis T + m w
    dd, dw, ww = jnp.sum(rays * rays, axis=-1), rays @ w, w @ w
    m = safe_divide(dw * (rays @ T) - dd * (w @ T), dd * ww - dw * dw)
    nearest = T + m[..., None] * w
    aside = safe_norm(nearest - safe_divide(jnp.sum(rays * nearest, axis=-1), dd)[..., None] * rays)
    size = safe_norm(jnp.cross(rays, jnp.broadcast_to(w, rays.shape)))
    sine = jnp.maximum(safe_divide(size, safe_sqrt(dd * ww)), 0.2)
    # the bulge over the axis is a constant to slopes, but for the radius
    bulge = safe_sqrt(jnp.maximum(1.0 - safe_divide(aside, axis.radius) ** 2, 0.25))
    skin = nearest[..., 2] - axis.radius * cut(safe_divide(bulge, sine * jnp.sqrt(dd)))
    pixel = cut(jnp.maximum(nearest[..., 2], 0.05) / camera.fx)
    return Place((axis.radius - aside) / pixel + axis.swell, skin, cut(m), cut(safe_divide(aside, axis.radius)))


class _Depths(NamedTuple):
    there: Array
    depth: Array
    """1 where there is none [m]."""
    deviation: Array
    """[m]"""


def _depths(patch: Patch, params: PixelParams, noise: NoiseParams) -> _Depths:
    there = patch.depth > 0
    z = jnp.where(there, patch.depth, 1.0)
    own = MEAN_LOSS * depth_deviation(z, noise) ** 2 / jnp.maximum(patch.images, 1.0)
    return _Depths(there, z, jnp.sqrt(own + params.skin**2))


def pixel_evidence(patch: Patch, place: Place, params: PixelParams, noise: NoiseParams, blur: Scalar) -> Evidence:
    """What every pixel says of a finger.

    A pixel sees the finger with the probability p, a logistic step at the outline, and its depth is then that of the skin, but for
    noise; else something else, anywhere. The likelihood of both over that of something else is 1 + p (rho - 1), with rho that of the two depths.

    Args:
        blur: width of the step [px].
    """
    z = _depths(patch, params, noise)
    deviation = z.deviation * (1.0 + blur)  # a start is off in depth, too
    e = (z.depth - place.skin) / deviation
    depth_ratio = (1.0 - params.lost) * params.other / (2.5066 * deviation) * jnp.exp(-0.5 * e * e)
    seen = z.there & (e >= -IN_FRONT)
    rho = jnp.where(seen, depth_ratio + params.lost, jnp.where(z.there, 1.0, params.hole))
    p = jax.nn.sigmoid(place.inside / blur)
    either = 1.0 + p * (rho - 1.0)
    counts = (place.along > 0) & (place.along < params.clear) & (place.near < params.beside)
    weight = counts.astype(p.dtype)
    own = jnp.where(seen, p * safe_divide(depth_ratio, either), 0.0)  # how likely the depth is that of the skin
    step = weight * p * (1.0 - p)
    return Evidence(
        step * safe_divide(rho - 1.0, either) / blur, step * jnp.abs(rho - 1.0) / (rho + 1.0) / blur**2,
        weight * own * e / deviation, weight * own / deviation**2,
    )  # fmt: skip


def sees_finger(patch: Patch, place: Place, params: PixelParams, noise: NoiseParams) -> Array:
    """Whether a finger stands out in an image: pixels within its outline are as deep as it, and those about it are behind.

    A finger that a hand hides, or that lies before other parts of it, is refused: what is fitted there is something else.
    """
    z = _depths(patch, params, noise)
    e = (z.depth - place.skin) / z.deviation
    rows = (place.along > 0) & (place.along < params.clear)
    within, ring = rows & (place.inside > 0), rows & (place.inside < -RING[0]) & (place.inside > -RING[1])
    count = lambda a: jnp.sum(a.astype(z.depth.dtype))  # noqa: E731
    on, behind = count(within & z.there & (jnp.abs(e) < 3.0)), count(ring & (~z.there | (e > 3.0)))
    return (
        (on > params.least)
        & (on > params.covered * count(within))
        & (behind > params.behind * jnp.maximum(count(ring), 1.0))
    )
