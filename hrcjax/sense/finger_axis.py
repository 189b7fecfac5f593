"""The axis of a finger from all depth pixels on it, in several cameras, joined with its landmarks.

Four landmarks that err by some pixels give the direction of a finger of 9 cm badly. The finger is some pixels wide and some dozen long in
a depth image: their middle, row by row, is known to a fraction of a pixel, and their depths tell the slope.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree

from hrcjax.hand.pointing import Line, line_along
from hrcjax.numerics import safe_divide, safe_norm, safe_sqrt
from hrcjax.sense.camera import Camera
from hrcjax.sense.noise import NoiseParams, depth_deviation
from hrcjax.sense.points import valid_depth
from hrcjax.typing import Array, Bool, Float, Vector3


class FingerParams(eqx.Module):
    """What is known of fingers before they are seen, and how pixels are chosen. Values are our estimates."""

    radius: float = 0.008
    """Half the thickness of an index finger [m]."""
    radius_spread: float = 0.0015
    """Its standard deviation among people [m]."""
    length: float = 0.09
    """From the base of the finger to its tip [m]."""
    length_spread: float = 0.01
    """[m]"""
    middle: float = 0.5
    """Place of the middle joint between tip (0) and base (1) [1]."""
    last: float = 0.22
    """Place of the last joint [1]."""
    joint_spread: float = 0.05
    """Standard deviation of these places [1]."""
    clear: float = 0.75
    """From tip (0) to base (1), the part of the finger that no other hides or touches [1]."""
    beside: float = 1.7
    """Pixels count up to this distance from the axis, over the radius, in the last rounds [1]."""
    gate: float = 2.5
    """And up to so many standard deviations of depth [1]."""
    skin: float = 0.003
    """Standard deviation of the depth of the skin besides noise [m]."""
    outline: float = 1.3
    """Factor on the standard deviation of the middle of a row of pixels: the finger's borders are cut by whole pixels [1]."""
    wide: float = 1.8
    """How much wider both are in the first round [1]."""
    patch: int = eqx.field(static=True, default=48)
    """Columns and rows of the image that are searched [px]."""
    agree: float = 21.0
    """Sum of squares of the landmarks' errors, over their variances, above which pixels of something else were taken: 95 % of 12 degrees of freedom [1]."""
    step: float = 0.006
    """The longest step of an end of the finger along an axis [m]."""
    rounds: int = eqx.field(static=True, default=14)
    """Gauss-Newton steps."""


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


class Seen(NamedTuple):
    """What one camera saw of a finger that was held still; cameras are stacked."""

    pixels: Float[Array, "*camera 4 2"]
    """Mean columns and rows of the landmarks, from the base to the tip."""
    spread: Float[Array, "*camera"]
    """Their standard deviation [px]."""
    found: Bool[Array, "*camera"]
    """Whether its detector found the hand."""
    depth: Float[Array, "*camera height width"]
    """Median of the images [m]; 0: none."""
    images: Float[Array, "*camera height width"]
    """How many images have a depth there [1]."""


def still_depth(
    images: Float[Array, "image *camera height width"], used: Bool[Array, "image"]
) -> tuple[Float[Array, "*camera height width"], Float[Array, "*camera height width"]]:
    """Median of each pixel's depth over the images of a hand that is held still [m], and how many have one; 0 where less than half have."""
    there = valid_depth(images) & used.reshape(-1, *(1,) * (images.ndim - 1))
    count = jnp.sum(there, axis=0)
    order = jnp.sort(jnp.where(there, images, jnp.inf), axis=0)
    pick = lambda k: jnp.take_along_axis(order, k[None], axis=0)[0]  # noqa: E731
    low, high = pick(jnp.maximum(count - 1, 0) // 2), pick(count // 2)
    enough = 2 * count >= jnp.maximum(jnp.sum(used), 1)
    return jnp.where(enough & (count > 0), 0.5 * (low + high), 0.0), count.astype(images.dtype)


def finger_line(
    cameras: Camera,
    seen: Seen,
    start: Line,
    length: Float[Array, ""],
    params: FingerParams | None = None,
    noise: NoiseParams | None = None,
) -> Line:
    """The line of a straight finger by least squares over its landmarks and all depth pixels on it.

    A pixel is of the finger if its ray passes the axis near enough and its depth is that of the skin there. For these two
    residuals count: the distance of the ray from the axis, whose mean over a row of pixels is 0, and the depth.

    Where the result contradicts the landmarks, they alone count.

    Args:
        cameras: stacked; the images are in their resolution.
        start: by the landmarks alone, as of `held_line`.
        length: of the finger by these [m].
    """
    params, noise = params or FingerParams(), noise or NoiseParams()
    dtype = start.tip.dtype
    joints = jnp.asarray([params.middle, params.last], dtype)
    first = Axis(start.tip, length * start.direction, joints, jnp.asarray(params.radius, dtype))
    patches = jax.vmap(_patch, in_axes=(0, 0, None, None))(cameras, seen, first, params)
    wide = jnp.maximum(
        jnp.linspace(params.wide, 0.7, params.rounds, dtype=dtype), 1.0
    )  # a start that is off must not lose one border of the finger
    flat, shape = ravel_pytree(first)
    cut = jax.lax.stop_gradient

    def rows(x: Array, wide: Array) -> tuple[Array, Array]:
        """Residuals over their deviations, and their weights."""
        axis = shape(x)
        pixels = jax.vmap(lambda c, s, p: _pixel_rows(c, p, axis, params, noise, wide))(cameras, seen, patches)
        marks = jax.vmap(lambda c, s: _landmark_rows(c, s, axis))(cameras, seen)
        prior = jnp.concatenate([
            (axis.joints - joints) / params.joint_spread, (axis.radius - params.radius)[None] / params.radius_spread,
            (safe_norm(axis.along) - params.length)[None] / params.length_spread,
        ])  # fmt: skip
        parts = [*pixels, marks, (prior, jnp.ones_like(prior))]
        return jnp.concatenate([e.ravel() for e, _ in parts]), cut(jnp.concatenate([w.ravel() for _, w in parts]))

    def normal(x: Array, wide: Array) -> tuple[Array, Array]:
        e, w = rows(x, wide)
        J = jax.jacfwd(lambda x: rows(x, wide)[0])(x)
        return (J * w[:, None]).T @ J, J.T @ (w * e)

    def step(x: Array, wide: Array) -> tuple[Array, None]:
        N, slope = normal(x, wide)
        move = _solved(N, slope)
        # no further than landmarks may err: what a step finds beyond it may be another finger
        longest = jnp.max(jnp.abs(move[:6]))
        return x - move * jnp.minimum(1.0, params.step / jnp.maximum(longest, 1e-9)), None

    x, _ = jax.lax.scan(step, flat, wide)
    N, _ = normal(x, jnp.ones((), dtype))
    scale = _scale(N)
    covariance = scale[:, None] * jnp.linalg.inv(scale[:, None] * N * scale) * scale
    axis = shape(x)
    line = line_along(axis.tip, axis.along, covariance[:6, :6])
    e, there = jax.vmap(lambda c, s: _landmark_rows(c, s, axis))(cameras, seen)
    finite = jnp.all(jnp.isfinite(x)) & jnp.all(jnp.isfinite(line.covariance))
    good = finite & (jnp.sum(there * e * e) <= params.agree)
    return jax.tree.map(lambda new, old: jnp.where(good, new, old), line, start)


def _scale(N: Array) -> Array:
    return 1.0 / jnp.sqrt(jnp.maximum(jnp.diag(N), 1e-12))


def _solved(N: Array, slope: Array) -> Array:
    """N^-1 slope, scaled to a unit diagonal: lengths and shares differ by orders."""
    scale = _scale(N)
    return scale * jnp.linalg.solve(scale[:, None] * N * scale + 1e-6 * jnp.eye(len(N), dtype=N.dtype), scale * slope)


class _Patch(NamedTuple):
    rays: Array
    """(row column 3) of pixels, in the camera, of depth 1."""
    depth: Array
    images: Array


def _patch(camera: Camera, seen: Seen, axis: Axis, params: FingerParams) -> _Patch:
    """The pixels about the middle of a finger."""
    size = params.patch
    own = (axis.tip - 0.5 * axis.along - camera.position) @ camera.rotation
    focal, middle = jnp.stack([camera.fx, camera.fy]), jnp.stack([camera.cx, camera.cy])
    at = own[:2] / jnp.maximum(own[2], 0.05) * focal + middle
    most = jnp.asarray([seen.depth.shape[1] - size, seen.depth.shape[0] - size], at.dtype)
    corner = jnp.clip(jnp.round(at - size / 2), 0, jnp.maximum(most, 0)).astype(jnp.int32)
    cut = lambda a: jax.lax.dynamic_slice(a, (corner[1], corner[0]), (size, size))  # noqa: E731
    steps = jnp.arange(size, dtype=corner.dtype)
    u, v = jnp.meshgrid(corner[0] + steps, corner[1] + steps)
    x = (u.astype(at.dtype) - camera.cx) / camera.fx
    y = (v.astype(at.dtype) - camera.cy) / camera.fy
    return _Patch(jnp.stack([x, y, jnp.ones_like(x)], axis=-1), cut(seen.depth), cut(seen.images))


def _pixel_rows(
    camera: Camera, patch: _Patch, axis: Axis, params: FingerParams, noise: NoiseParams, wide: Array
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Distances of rays from the axis, and depths, each as residuals over deviations with weights."""
    cut = jax.lax.stop_gradient
    T = (axis.tip - camera.position) @ camera.rotation
    w = -(axis.along @ camera.rotation)  # from the tip to the base
    rays = patch.rays
    # nearest points of ray s d and axis T + m w
    across = jnp.cross(rays, jnp.broadcast_to(w, rays.shape))
    size = safe_norm(across)
    aside = safe_divide(across @ T, size)
    dd, dw, ww = jnp.sum(rays * rays, axis=-1), rays @ w, w @ w
    m = safe_divide(dw * (rays @ T) - dd * (w @ T), dd * ww - dw * dw)
    sine = safe_divide(size, safe_sqrt(dd * ww))
    axis_depth = T[2] + m * w[2]
    # the radius that is fitted moves the skin alone; which pixels are looked at does not change with it
    bulge = safe_sqrt(jnp.maximum(1.0 - cut(aside / params.radius) ** 2, 0.25))
    skin = axis_depth - safe_divide(axis.radius * bulge, cut(jnp.maximum(sine, 0.2) * jnp.sqrt(dd)))

    n = jnp.maximum(patch.images, 1.0)
    z = jnp.maximum(patch.depth, noise.near)
    own = depth_deviation(z, noise)
    deep = jnp.sqrt(1.57 * own**2 / n + params.skin**2)  # of a median
    e = (patch.depth - skin) / deep
    there = (patch.depth > 0) & (m > 0) & (m < params.clear)
    of_finger = jax.nn.sigmoid((params.gate * wide - jnp.abs(e)) / 0.25)
    near = jax.nn.sigmoid((params.beside * wide * params.radius - jnp.abs(aside)) / (0.1 * params.radius))
    weight = jnp.where(there, of_finger * near, 0.0)
    # a row of 2 r / p pixels of size p whose middle is known to p / sqrt(24), as both borders are cut by whole pixels
    pixel = z / camera.fx
    side = params.outline * jnp.sqrt(2 * params.radius * pixel / 24.0)
    inner = jnp.where(jnp.abs(aside) < 0.9 * params.radius, weight, 0.0)
    return (aside / cut(side), cut(weight)), (e, cut(inner))


def _landmark_rows(camera: Camera, seen: Seen, axis: Axis) -> tuple[Array, Array]:
    """Landmarks beside where the finger has them."""
    share = jnp.concatenate([jnp.ones(1, axis.joints.dtype), axis.joints, jnp.zeros(1, axis.joints.dtype)])
    own = (axis.tip - share[:, None] * axis.along - camera.position) @ camera.rotation
    focal, middle = jnp.stack([camera.fx, camera.fy]), jnp.stack([camera.cx, camera.cy])
    at = own[:, :2] / jnp.maximum(own[:, 2:], 0.05) * focal + middle
    there = seen.found & jnp.all(jnp.isfinite(seen.pixels), axis=-1, keepdims=True)
    e = (at - jnp.where(there, seen.pixels, 0)) / seen.spread
    return e, jnp.broadcast_to(there, e.shape).astype(e.dtype)
