"""The axis of a finger from all depth pixels about it, in several cameras, joined with its landmarks.

Four landmarks that err by some pixels give the direction of a finger of 9 cm badly. The finger is some pixels wide and some dozen long in
a depth image: its outline tells where it is to a fraction of a pixel, and its depths tell the slope.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree

from hrcjax.hand.pointing import Line, line_along
from hrcjax.numerics import safe_norm
from hrcjax.sense.camera import Camera, in_image
from hrcjax.sense.finger_pixels import (
    Axis,
    Evidence,
    Patch,
    PixelParams,
    patch_of,
    pixel_evidence,
    place_of,
    sees_finger,
)
from hrcjax.sense.noise import NoiseParams
from hrcjax.typing import Array, Bool, Float, Scalar

DAMPING = 1e-3
"""Of the steps, over a unit diagonal [1]."""


class FingerParams(eqx.Module):
    """What is known of fingers before they are seen. Values are our estimates."""

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
    swell_spread: float = 1.0
    """Standard deviation of how much wider its outline is [px]."""
    agree: float = 3.09
    """Quantile, as a standard normal number, of the landmarks' squared errors above which pixels of something else were taken: one in a thousand, if they err as told or by the ratio below [1]."""
    worse: float = 2.25
    """Landmarks' squared errors may be so many times as large as told, if they fit a finger of their own that badly: errors that are half larger [1]."""
    step: float = 0.006
    """The longest step of an end of the finger along an axis [m]."""
    rounds: int = eqx.field(static=True, default=8)
    """Steps with an outline that becomes sharp."""
    last_rounds: int = eqx.field(static=True, default=4)
    """Steps with a sharp one."""
    pixels: PixelParams = PixelParams()


class Seen(NamedTuple):
    """What one camera saw of a finger that was held still; cameras are stacked."""

    pixels: Float[Array, "*camera 4 2"]
    """Mean columns and rows of the landmarks, from the base to the tip; not finite: the landmark is not in that image."""
    spread: Float[Array, "*camera"]
    """Their standard deviation [px]."""
    found: Bool[Array, "*camera"]
    """Whether its detector found the hand."""
    depth: Float[Array, "*camera height width"]
    """Of all images together, `still_depth` [m]; 0: none."""
    images: Float[Array, "*camera height width"]
    """How many images agree on it [1]."""


def finger_line(
    cameras: Camera,
    seen: Seen,
    start: Line,
    length: Float[Array, ""],
    params: FingerParams | None = None,
    noise: NoiseParams | None = None,
) -> Line:
    """The most likely line of a straight finger, by its landmarks and all depth pixels about it.

    The logarithm of the likelihood of the pixels (`pixel_evidence`), landmarks, and what is known of fingers is maximised by scoring
    steps: gradient over Fisher's information. The outline is blurred at first, and becomes sharp. Each camera is first asked
    alone whether it sees the finger at all (`sees_finger`); of one that does not, only landmarks count. The information
    is that of the covariance.

    Where the result contradicts the landmarks, they alone count: if their squared errors about it are more than those of chance. Chance is
    taken from what is told of the landmarks, or from how badly they fit a finger of their own, whichever is more, up to `worse` (Birge's
    ratio): landmarks that err more than told contradict every finger, and not that of the pixels.

    Args:
        cameras: stacked; the images are in their resolution.
        start: by the landmarks alone, as of `held_line`.
        length: of the finger by these [m].

    Raises:
        ValueError: images smaller than the part that is searched.
    """
    params, noise = params or FingerParams(), noise or NoiseParams()
    dtype, count = start.tip.dtype, len(seen.spread)
    joints = jnp.asarray([params.middle, params.last], dtype)
    zero = jnp.zeros((), dtype)
    first = Axis(start.tip, length * start.direction, joints, jnp.asarray(params.radius, dtype), zero)
    patches = jax.vmap(lambda c, s: patch_of(c, s.depth, s.images, first, params.pixels))(cameras, seen)
    flat, shape = ravel_pytree(first)

    def places(x: Array) -> tuple[Array, Array]:
        at = jax.vmap(lambda c, p: place_of(c, p.rays, shape(x)))(cameras, patches)
        return at.inside.ravel(), at.skin.ravel()

    def marks(x: Array) -> Array:
        return jax.vmap(lambda c, s: _landmark_errors(c, s, shape(x)))(cameras, seen).ravel()

    def known(x: Array) -> Array:
        """Residuals of the landmarks and of what is known before, over their deviations."""
        axis = shape(x)
        prior = jnp.concatenate([
            (axis.joints - joints) / params.joint_spread, (axis.radius - params.radius)[None] / params.radius_spread,
            (safe_norm(axis.along) - params.length)[None] / params.length_spread, axis.swell[None] / params.swell_spread,
        ])  # fmt: skip
        return jnp.concatenate([marks(x), prior])

    def normal(x: Array, blur: Array, asked: Array) -> tuple[Array, Array]:
        """Fisher's information, and the slope downhill."""

        def of(camera: Camera, patch: Patch, weight: Array) -> Evidence:
            e = pixel_evidence(patch, place_of(camera, patch.rays, shape(x)), params.pixels, noise, blur)
            return jax.tree.map(lambda a: weight * a, e)

        e = jax.tree.map(jnp.ravel, jax.vmap(of)(cameras, patches, asked))
        (outline, skin), J = jax.jacfwd(places)(x), jax.jacfwd(known)(x)
        N = (outline * e.edge[:, None]).T @ outline + (skin * e.deep[:, None]).T @ skin + J.T @ J
        return N, J.T @ known(x) - outline.T @ e.push - skin.T @ e.lag

    def fitted(asked: Array) -> Array:
        def step(x: Array, blur: Array) -> tuple[Array, None]:
            move = _solved(*normal(x, blur, asked))
            # no further than landmarks may err: what a step finds beyond it may be another finger
            longest = jnp.max(jnp.abs(move[:6]))
            return x - move * jnp.minimum(1.0, params.step / jnp.maximum(longest, 1e-9)), None

        return jax.lax.scan(step, flat, blurs)[0]

    sharp, wide = (jnp.asarray(b, dtype) for b in (params.pixels.blur, params.pixels.wide))
    share = jnp.minimum(jnp.arange(params.rounds + params.last_rounds, dtype=dtype) / params.rounds, 1.0)
    blurs = wide * (sharp / wide) ** share

    def ask(sees: Array, k: Array) -> tuple[Array, Array]:
        """Camera k alone; then those that see the finger, together; last none, but the landmarks."""
        alone = jnp.arange(count) == k
        x = fitted(jnp.where(k == count, sees, alone.astype(dtype)))
        own = jax.vmap(lambda c, p: sees_finger(p, place_of(c, p.rays, shape(x)), params.pixels, noise))(cameras, patches)  # fmt: skip
        return jnp.where(alone, own.astype(dtype), sees), x

    sees, found = jax.lax.scan(ask, jnp.zeros(count, dtype), jnp.arange(count + 2))
    x, bare = found[count], found[count + 1]
    N, _ = normal(x, sharp, sees)
    axis = shape(x)
    line = line_along(axis.tip, axis.along, _inverse(N, 0.0)[:6, :6])

    def squares(x: Array, N: Array) -> tuple[Array, Array]:
        """Sum of squared errors of the landmarks, and its mean where all errors are as told: it is less by what they pull the fit to themselves."""
        J = jax.jacfwd(marks)(x)
        pull = J @ _inverse(N, DAMPING) @ J.T
        there = 2.0 * jnp.sum(_marks_there(seen).astype(dtype))
        e = marks(x)
        return e @ e, jnp.maximum(there - jnp.trace(pull), 1.0)

    N_bare, _ = normal(bare, sharp, jnp.zeros(count, dtype))
    (off, freedom), (own_off, own_freedom) = squares(x, N), squares(bare, N_bare)
    ratio = jnp.clip(own_off / own_freedom, 1.0, params.worse)
    finite = jnp.all(jnp.isfinite(x)) & jnp.all(jnp.isfinite(line.covariance))
    good = finite & (off <= ratio * chi_square(freedom, params.agree))
    return jax.tree.map(lambda new, old: jnp.where(good, new, old), line, start)


def chi_square(freedom: Float[Array, ""], quantile: Scalar) -> Float[Array, ""]:
    """Quantile of the chi-square distribution, by that of the normal one (Wilson and Hilferty 1931)."""
    a = 2.0 / (9.0 * freedom)
    return freedom * (1.0 - a + quantile * jnp.sqrt(a)) ** 3


def _scale(N: Array) -> Array:
    return 1.0 / jnp.sqrt(jnp.maximum(jnp.diag(N), 1e-12))


def _inverse(N: Array, damping: Scalar) -> Array:
    """N^-1, by way of a unit diagonal, to which `damping` is added."""
    scale = _scale(N)
    unit = scale[:, None] * N * scale + damping * jnp.eye(len(N), dtype=N.dtype)
    return scale[:, None] * jnp.linalg.inv(unit) * scale


def _solved(N: Array, slope: Array) -> Array:
    """N^-1 slope, scaled to a unit diagonal: lengths and shares differ by orders."""
    scale = _scale(N)
    damped = scale[:, None] * N * scale + DAMPING * jnp.eye(len(N), dtype=N.dtype)
    return scale * jnp.linalg.solve(damped, scale * slope)


def _marks_there(seen: Seen) -> Bool[Array, "*camera 4"]:
    """Which landmarks are in an image: its detector found the hand, and column and row are numbers."""
    return seen.found[..., None] & jnp.all(jnp.isfinite(seen.pixels), axis=-1)


def _landmark_errors(camera: Camera, seen: Seen, axis: Axis) -> Array:
    """How far landmarks are from where the finger has them, over their deviations; 0 where there are none."""
    share = jnp.concatenate([jnp.ones(1, axis.joints.dtype), axis.joints, jnp.zeros(1, axis.joints.dtype)])
    at, _ = in_image(camera, axis.tip - share[:, None] * axis.along)
    there = _marks_there(seen)[:, None]
    return jnp.where(there, at - jnp.where(there, seen.pixels, 0), 0.0) / seen.spread
