"""Where a finger or an arm points: a line through its landmarks held for a while, and the place at which it meets a surface."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.sphere_trace import STEEPEST, sphere_trace
from hrcjax.numerics import safe_divide, safe_norm, safe_sqrt, solve_spd
from hrcjax.typing import Array, Bool, DistanceFn, Float, Matrix3, Scalar, Vector3

NEIGHBOURS = 1.5
"""Standard deviations from a line to those about it whose places tell how well its own is known [1]."""
ARM = 1.0
"""A turn by one radian counts as this way where main axes of a line's covariance are looked for [m]."""


class PointingParams(eqx.Module):
    """When somebody points, and at what. All are our choice but the dwell."""

    dwell: float = 0.5
    """How long the landmarks must stay [s]."""
    still: float = 0.03
    """They stay if none is farther than this, and three standard deviations of an image, from its mean [m]."""
    drift: float = 0.03
    """They may move on as fast as this, and two standard deviations, over the dwell: an arm that is held still wanders slower [m/s]."""
    turn: float = 0.15
    """And the line may turn as fast as this, and two standard deviations [rad/s]."""
    gap: float = 0.15
    """For so long the hand may be lost without the time beginning anew [s]."""
    touch: float = 0.04
    """A tip nearer to a surface than this touches it: the place is beside the tip, and not along the finger [m]."""
    finger: float = 0.008
    """Half the thickness of a finger: a tip that touches a surface is so far from it [m]."""
    far: float = 3.0
    """The longest way from the tip to a place [m]."""
    tolerance: float = 0.012
    """A distance to a surface that counts as met: the field of a map does not fall to 0 at a surface [m]."""
    surface: float = 0.004
    """Standard deviation of a surface along its normal, of which the distance is a field of noisy points [m]."""


class PointingState(eqx.Module):
    """What is known of landmarks that are being held: sums over images, older ones less."""

    information: Float[Array, "landmark 3 3"]
    """[1/m^2]"""
    weighted: Float[Array, "landmark 3"]
    """Information times point [1/m]."""
    common: Float[Array, "landmark 3 3"]
    """Covariance that is the same in all images [m^2]."""
    own: Float[Array, "landmark"]
    """Trace of the other part of the covariance [m^2]."""
    images: Float[Array, ""]
    """How many count [1]."""
    age: Float[Array, "2"]
    """Their ages [s], and the squares of these [s^2]."""
    points: Float[Array, "landmark 3"]
    """The points [m]."""
    aged: Float[Array, "landmark 3"]
    """Age times point [m s]."""
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
    zero, one, three = jnp.zeros((), dtype), jnp.zeros((landmarks, 3), dtype), jnp.zeros((landmarks, 3, 3), dtype)
    return PointingState(three, one, three, one[:, 0], zero, jnp.zeros(2, dtype), one, one, zero, zero)


def held_points(state: PointingState) -> Float[Array, "landmark 3"]:
    """Means of the landmarks by their information [m]; 0 where there is none."""
    return jax.vmap(solve_spd)(_known(state), state.weighted)


def held_covariances(state: PointingState) -> Float[Array, "landmark 3 3"]:
    """Covariances of the means [m^2]: what is common to all images stays, the rest falls with their number."""
    n = jnp.maximum(state.images, 1.0)
    return jnp.linalg.inv(_known(state)) + (1.0 - 1.0 / n) * state.common / n


def _known(state: PointingState) -> Float[Array, "landmark 3 3"]:
    empty = jnp.trace(state.information, axis1=-2, axis2=-1) <= 0
    return jnp.where(empty[:, None, None], jnp.eye(3, dtype=state.weighted.dtype), state.information)


def update_pointing(
    params: PointingParams,
    state: PointingState,
    points: Float[Array, "landmark 3"],
    information: Float[Array, "landmark 3 3"],
    common: Float[Array, "landmark 3 3"],
    pointing: Bool[Array, ""] | bool,
    dt: Scalar,
) -> tuple[PointingState, Bool[Array, ""]]:
    """Takes the landmarks of one image. A landmark that leaves its mean, or a loss for longer than `gap`, begins anew.

    Older images fade with the time `dwell`, so that a hand that settles is not held by where it was. Landmarks that wander on
    (`drifts`) are not held, however long they have been near their mean.

    Args:
        points: of the line, from its base to its tip [m]. What is not finite counts as nobody pointing.
        information: of each [1/m^2].
        common: part of the covariance of each that is the same in all images [m^2].
        pointing: whether the hand makes the gesture; always for an arm.
        dt: time since the last image [s].

    Returns:
        the state, and whether the line has been held for `dwell` in this image.
    """
    finite = [jnp.all(jnp.isfinite(x)) for x in (points, information, common)]
    pointing = jnp.asarray(pointing) & finite[0] & finite[1] & finite[2]
    points, information, common = (jnp.where(pointing, x, 0) for x in (points, information, common))
    away = safe_norm(points - held_points(state))
    covariance = jnp.linalg.inv(jnp.where(pointing, information, jnp.eye(3, dtype=points.dtype)))
    variance = jnp.trace(covariance, axis1=-2, axis2=-1)
    stays = (state.images > 0) & jnp.all(away <= params.still + 3.0 * safe_sqrt(variance))
    lost = jnp.where(pointing, 0.0, state.lost + dt)
    keep = jnp.where(pointing, stays & (state.lost + dt <= params.gap), lost <= params.gap)
    fade = jnp.where(keep, jnp.where(pointing, 1.0 - jnp.minimum(dt / params.dwell, 1.0), 1.0), 0.0)
    new = pointing.astype(points.dtype)
    own = jnp.where(pointing, jnp.maximum(variance - jnp.trace(common, axis1=-2, axis2=-1), 0.0), 0.0)
    held = jnp.where(keep, state.held + jnp.where(pointing, dt, 0.0), 0.0)
    age, count = state.age, state.images
    state = PointingState(
        fade * state.information + information,
        fade * state.weighted + jnp.einsum("kij,kj->ki", information, points),
        fade * state.common + common,
        fade * state.own + own,
        fade * count + new,
        fade * jnp.stack([age[0] + dt * count, age[1] + 2 * dt * age[0] + dt * dt * count]),
        fade * state.points + points,
        fade * (state.aged + dt * state.points),
        held,
        lost,
    )
    return state, pointing & (held + 1e-6 >= params.dwell) & ~drifts(params, state)


def drifts(params: PointingParams, state: PointingState) -> Bool[Array, ""]:
    """Whether the landmarks wander, or their line turns, faster than allowed and than noise would have it.

    The velocity of each landmark is the slope of its places over time; that of their mean and that of the tip about the base are
    compared with two standard deviations, by the part of the errors that is new in every image.
    """
    n = jnp.maximum(state.images, 1.0)
    mean_age = state.age[0] / n
    spread_age = jnp.maximum(state.age[1] - n * mean_age**2, 0.0)  # sum of squares about the mean [s^2]
    velocity = safe_divide(mean_age * state.points - state.aged, spread_age)
    variance = safe_divide(state.own / n, spread_age)
    moved, turned = jnp.mean(velocity, axis=0), velocity[-1] - velocity[0]
    length = safe_norm((state.points[-1] - state.points[0]) / n)
    slow = safe_norm(moved) <= params.drift + 2.0 * safe_sqrt(jnp.mean(variance) / len(variance))
    steady = safe_norm(turned) <= params.turn * length + 2.0 * safe_sqrt(variance[0] + variance[-1])
    return ~(slow & steady)


def held_line(state: PointingState) -> Line:
    """The line through the landmarks that are held, by weighted least squares: p_k = tip - s_k u.

    s_k is the distance of landmark k from the last one, the tip.
    """
    points = held_points(state)
    dtype = points.dtype
    s = safe_norm(points - points[-1])
    eye = jnp.eye(3, dtype=dtype)
    known = jnp.linalg.inv(held_covariances(state))
    H = jnp.concatenate([jnp.broadcast_to(eye, (len(s), 3, 3)), -s[:, None, None] * eye], axis=-1)
    N = jnp.einsum("kai,kab,kbj->ij", H, known, H) + 1e-6 * jnp.eye(6, dtype=dtype)
    tip, along = jnp.split(jnp.linalg.solve(N, jnp.einsum("kai,kab,kb->i", H, known, points)), 2)
    return line_along(tip, along, jnp.linalg.inv(N))


def line_along(tip: Vector3, along: Vector3, covariance: Float[Array, "6 6"]) -> Line:
    """A line of any direction `along`, with the covariance of both, as one of a direction of length 1."""
    length = safe_norm(along)
    u = safe_divide(along, length)
    eye = jnp.eye(3, dtype=u.dtype)
    flat = safe_divide(eye - jnp.outer(u, u), length)  # of normalising
    J = jnp.zeros((6, 6), u.dtype).at[:3, :3].set(eye).at[3:, 3:].set(flat)
    return Line(tip, u, J @ covariance @ J.T)


def pointed_place(params: PointingParams, line: Line, distance: DistanceFn) -> Pointed:
    """The place on a surface that a line points at: beside the tip where it touches, else the first along the line.

    A tip that touches is half a finger's thickness from the surface. What the map has more or less is air, or what the map is off, in any
    direction: at edges and columns the nearest surface of a map of points is farther than the true one, and in another place. It counts as a
    standard deviation along every axis. What the surface is off along its normal is part of it: there the larger of both counts.

    The covariance along a line is that of places of lines about it, `NEIGHBOURS` standard deviations to each side along its main
    axes (the unscented transform of Julier and Uhlmann): it is large at a grazing ray, and where the line may miss the edge of what it meets.

    Args:
        distance: to everything that stands, without the hand itself [m].
    """
    d, gradient = jax.value_and_grad(distance)(line.tip)
    touched = d <= params.touch
    eye = jnp.eye(3, dtype=line.tip.dtype)
    off = safe_divide(gradient, safe_norm(gradient))
    beside, flat = line.tip - d * off, eye - jnp.outer(off, gradient)

    moves = _main_axes(line)
    lines = jnp.concatenate([jnp.zeros((1, 6), moves.dtype), NEIGHBOURS * moves, -NEIGHBOURS * moves])
    towards = line.direction + lines[:, 3:]
    towards = safe_divide(towards, safe_norm(towards)[:, None])
    hits = jax.vmap(sphere_trace, in_axes=(None, 0, 0, None, None))(
        distance, line.tip + lines[:, :3], towards, params.far, params.tolerance
    )
    apart = hits.point[1:] - hits.point[0]
    there = jax.grad(distance)(hits.point[0])
    slant = jnp.maximum(jnp.abs(safe_divide(there, safe_norm(there)) @ line.direction), STEEPEST)

    place = jnp.where(touched, beside, hits.point[0])
    gap = d - params.finger  # air, or what the map is off
    at_tip = flat @ line.covariance[:3, :3] @ flat.T + gap * gap * eye
    covariance = jnp.where(touched, at_tip, apart.T @ apart / (2 * NEIGHBOURS**2))
    unsaid = safe_sqrt(jnp.maximum(params.surface**2 - gap * gap, 0.0))  # of the surface, where the gap says less
    surface = jnp.where(touched, unsaid * off, params.surface * line.direction / slant)
    found = jnp.isfinite(d) & (touched | hits.found[0])
    return Pointed(place, covariance + jnp.outer(surface, surface), found, touched)


def _main_axes(line: Line) -> Float[Array, "4 6"]:
    """Moves of tip and direction by one standard deviation along the main axes of their covariance, but for those along the line."""
    u = line.direction
    across = jnp.eye(3, dtype=u.dtype) - jnp.outer(u, u)
    P = jnp.zeros((6, 6), u.dtype).at[:3, :3].set(across).at[3:, 3:].set(across)
    scale = jnp.asarray([1.0, 1.0, 1.0, *(ARM,) * 3], u.dtype)  # both in metres
    values, axes = jnp.linalg.eigh(scale[:, None] * (P @ line.covariance @ P.T) * scale)
    return (safe_sqrt(jnp.maximum(values[-4:], 0.0)) * axes[:, -4:] / scale[:, None]).T


def spread(covariance: Float[Array, "n n"]) -> Float[Array, ""]:
    """Root of the largest eigenvalue: the standard deviation along the worst direction [m]."""
    return jnp.sqrt(jnp.maximum(jnp.linalg.eigvalsh(covariance)[-1], 0.0))
