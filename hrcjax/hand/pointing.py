"""Where a finger or an arm points: a line through its landmarks held for a while, and the place at which it meets a surface."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.sphere_trace import sphere_trace
from hrcjax.numerics import safe_divide, safe_norm, safe_sqrt, solve_spd
from hrcjax.typing import Array, Bool, DistanceFn, Float, Matrix3, Scalar, Vector3


class PointingParams(eqx.Module):
    """When somebody points, and at what. All are our choice but the dwell."""

    dwell: float = 0.5
    """How long the landmarks must stay [s]."""
    still: float = 0.03
    """They stay if none is farther than this, and three standard deviations of an image, from its mean [m]."""
    gap: float = 0.15
    """For so long the hand may be lost without the time beginning anew [s]."""
    shared: float = 0.3
    """Share of a landmark's variance that is the same in all images, so that no mean lessens it [1]."""
    touch: float = 0.04
    """A tip nearer to a surface than this touches it: the place is beside the tip, and not along the finger [m]."""
    far: float = 3.0
    """The longest way from the tip to a place [m]."""
    tolerance: float = 0.012
    """A distance to a surface that counts as met: the field of a map does not fall to 0 at a surface [m]."""


class PointingState(eqx.Module):
    """What is known of a line that is being held."""

    information: Float[Array, "landmark 3 3"]
    """Sum over images, older ones less [1/m^2]."""
    weighted: Float[Array, "landmark 3"]
    """Sum of information times point [1/m]."""
    images: Float[Array, ""]
    """How many count [1]."""
    held: Float[Array, ""]
    """For how long the landmarks have stayed [s]."""
    lost: Float[Array, ""]
    """For how long there has been none [s]."""


class Line(NamedTuple):
    """A line that points."""

    tip: Vector3
    """Its foremost landmark [m]."""
    direction: Vector3
    """Of length 1."""
    covariance: Float[Array, "6 6"]
    """Of tip [m] and direction [1]."""


class Pointed(NamedTuple):
    """A place that a line points at."""

    place: Vector3
    """On a surface [m]."""
    covariance: Matrix3
    """[m^2]."""
    found: Bool[Array, ""]
    """Whether there is a surface."""
    touched: Bool[Array, ""]
    """Whether the tip is at it."""


def initial_pointing(landmarks: int, dtype: jnp.dtype | type = jnp.float32) -> PointingState:
    """Nobody points."""
    zero = jnp.zeros((), dtype)
    return PointingState(jnp.zeros((landmarks, 3, 3), dtype), jnp.zeros((landmarks, 3), dtype), zero, zero, zero)


def held_points(state: PointingState) -> Float[Array, "landmark 3"]:
    """Means of the landmarks by their information [m]; 0 where there is none."""
    empty = jnp.trace(state.information, axis1=-2, axis2=-1) <= 0
    safe = jnp.where(empty[:, None, None], jnp.eye(3, dtype=state.weighted.dtype), state.information)
    return jax.vmap(solve_spd)(safe, state.weighted)


def update_pointing(
    params: PointingParams,
    state: PointingState,
    points: Float[Array, "landmark 3"],
    information: Float[Array, "landmark 3 3"],
    pointing: Bool[Array, ""] | bool,
    dt: Scalar,
) -> tuple[PointingState, Bool[Array, ""]]:
    """Takes the landmarks of one image. A landmark that leaves its mean, or a loss for longer than `gap`, begins anew.

    Older images fade with the time `dwell`, so that a hand that settles is not held by where it was.

    Args:
        points: of the line, from its base to its tip [m]. What is not finite counts as nobody pointing.
        information: of each [1/m^2].
        pointing: whether the hand makes the gesture; always for an arm.
        dt: time since the last image [s].

    Returns:
        the state, and whether the line has been held for `dwell` in this image.
    """
    pointing = jnp.asarray(pointing) & jnp.all(jnp.isfinite(points)) & jnp.all(jnp.isfinite(information))
    points, information = jnp.where(pointing, points, 0), jnp.where(pointing, information, 0)
    away = safe_norm(points - held_points(state))
    known = jnp.where(pointing, information, jnp.eye(3, dtype=points.dtype))
    variance = jnp.trace(jax.vmap(lambda one: jnp.linalg.inv(one))(known), axis1=-2, axis2=-1)
    stays = (state.images > 0) & jnp.all(away <= params.still + 3.0 * safe_sqrt(variance))
    lost = jnp.where(pointing, 0.0, state.lost + dt)
    keep = jnp.where(pointing, stays, lost <= params.gap)
    fade = jnp.where(keep, jnp.where(pointing, 1.0 - jnp.minimum(dt / params.dwell, 1.0), 1.0), 0.0)
    weighted = jnp.einsum("kij,kj->ki", information, points)
    held = jnp.where(keep, state.held + jnp.where(pointing, dt, 0.0), 0.0)
    state = PointingState(
        fade * state.information + information,
        fade * state.weighted + weighted,
        fade * state.images + pointing.astype(state.images.dtype),
        held,
        lost,
    )
    return state, pointing & (held + 1e-6 >= params.dwell)


def held_line(params: PointingParams, state: PointingState) -> Line:
    """The line through the landmarks that are held, by weighted least squares: p_k = tip - s_k u.

    s_k is the distance of landmark k from the last one, the tip. Errors that all images share stay in the covariance.
    """
    points = held_points(state)
    dtype = points.dtype
    s = safe_norm(points - points[-1])
    eye = jnp.eye(3, dtype=dtype)
    # part of the variance falls with the images, the rest does not
    loss = 1.0 / ((1.0 - params.shared) + params.shared * jnp.maximum(state.images, 1.0))
    H = jnp.concatenate([jnp.broadcast_to(eye, (len(s), 3, 3)), -s[:, None, None] * eye], axis=-1)
    N = jnp.einsum("kai,kab,kbj->ij", H, state.information, H) + 1e-6 * jnp.eye(6, dtype=dtype)
    tip, along = jnp.split(jnp.linalg.solve(N, jnp.einsum("kai,ka->i", H, state.weighted)), 2)
    length = safe_norm(along)
    u = safe_divide(along, length)
    flat = safe_divide(eye - jnp.outer(u, u), length)  # of normalising
    J = jnp.zeros((6, 6), dtype).at[:3, :3].set(eye).at[3:, 3:].set(flat)
    return Line(tip, u, J @ jnp.linalg.inv(N) @ J.T / loss)


def pointed_place(params: PointingParams, line: Line, distance: DistanceFn) -> Pointed:
    """The place on a surface that a line points at: beside the tip where it touches, else the first along the line.

    The covariance is the line's, by the derivative of the place; at a grazing ray it is large.

    Args:
        distance: to everything that stands, without the hand itself [m].
    """
    near = distance(line.tip)
    touched = near <= params.touch

    def place(tip: Vector3, direction: Vector3) -> tuple[Vector3, Array]:
        d, gradient = jax.value_and_grad(distance)(tip)
        beside = tip - d * jax.lax.stop_gradient(safe_divide(gradient, safe_norm(gradient)))
        hit = sphere_trace(distance, tip, direction, params.far, params.tolerance)
        return jnp.where(touched, beside, hit.point), hit.found

    at, found = place(line.tip, line.direction)
    J = jnp.concatenate(jax.jacfwd(lambda *way: place(*way)[0], argnums=(0, 1))(line.tip, line.direction), axis=-1)
    return Pointed(at, J @ line.covariance @ J.T, jnp.isfinite(near) & (touched | found), touched)


def spread(covariance: Float[Array, "n n"]) -> Float[Array, ""]:
    """Root of the largest eigenvalue: the standard deviation along the worst direction [m]."""
    return jnp.sqrt(jnp.maximum(jnp.linalg.eigvalsh(covariance)[-1], 0.0))
