"""What a track says at a place: which part of the body is nearest, and how fast it may come."""

from typing import NamedTuple

import jax.numpy as jnp

from hrcjax.body.params import BodyParams
from hrcjax.body.skeleton import END_A, END_B, PART_REGION, part_capsules
from hrcjax.body.state import BodyFit, sure_track
from hrcjax.geom.segment import FAR
from hrcjax.numerics import safe_divide, safe_norm, safe_sqrt
from hrcjax.typing import Array, Bool, Float, Int, Scalar, Vector3


class NearestPart(NamedTuple):
    """The part of the body nearest to a place."""

    distance: Float[Array, ""]
    """To its surface; FAR without a track [m]."""
    part: Int[Array, ""]
    """Index into `PARTS`."""
    region: Int[Array, ""]
    """Index into `hrcjax.safety.pfl.BODY_REGIONS`."""
    speed: Float[Array, ""]
    """Speed of its surface towards the place; negative: it goes away [m/s]."""
    deviation: Float[Array, ""]
    """Standard deviation of that speed [m/s]."""
    place_deviation: Float[Array, ""]
    """Standard deviation of where the part is, towards the place [m]."""
    sure: Bool[Array, ""]
    """Whether speed and region can be relied on: the track is old enough, and every part that may be the nearest is seen and known well."""


class PartsAt(NamedTuple):
    """Every part of the body at the place of its surface that is nearest to a place."""

    distance: Float[Array, "part"]
    """Signed distance [m]."""
    speed: Float[Array, "part"]
    """Speed towards the place; negative: it goes away [m/s]."""
    speed_deviation: Float[Array, "part"]
    """Standard deviation of that speed [m/s]."""
    place_deviation: Float[Array, "part"]
    """Standard deviation of where the part is, towards the place [m]."""
    known: Bool[Array, "part"]
    """Whether the part is seen and its place known well."""


def parts_at(params: BodyParams, fit: BodyFit, x: Vector3) -> PartsAt:
    """Distance and speed of every part, and how sure they are.

    Args:
        fit: of one frame.
        x: the place [m].
    """
    dtype = x.dtype
    capsules = part_capsules(fit.joints, fit.radii)
    axis = capsules.b - capsules.a
    along = jnp.clip(safe_divide(jnp.sum((x - capsules.a) * axis, axis=1), jnp.sum(axis * axis, axis=1)), 0, 1)
    gap = x - capsules.a - along[:, None] * axis
    size = safe_norm(gap)
    u = safe_divide(gap, size[:, None])
    share = jnp.asarray(END_A, dtype) + along[:, None] * jnp.asarray(END_B - END_A, dtype)
    speed = jnp.sum((share @ fit.speeds) * u, axis=1)

    def deviation(of: Array) -> Array:
        # joints of one part err together at worst: deviations add up
        return jnp.sum(share * safe_sqrt(jnp.einsum("pc,jcd,pd->pj", u, of, u)), axis=1)

    of_place = deviation(fit.place_covariance)
    known = (fit.unseen <= params.sure_unseen) & (of_place < params.sure_position)
    return PartsAt(size - capsules.radius, speed, deviation(fit.speed_covariance), of_place, known)


def nearest_part(params: BodyParams, fit: BodyFit, x: Vector3, radius: Scalar = 0.0) -> NearestPart:
    """The part nearest to a place, such as a control point of the arm.

    Args:
        fit: of one frame.
        x: the place [m].
        radius: of a sphere there, taken off the distance [m].
    """
    distance, speed, of_speed, of_place, known = parts_at(params, fit, x)
    part = jnp.argmin(distance)
    rivals = distance < distance[part] + params.rivals
    sure = sure_track(params, fit) & jnp.all(known | ~rivals)
    away = jnp.asarray(FAR, x.dtype)
    return NearestPart(
        jnp.where(fit.tracked, distance[part] - radius, away), part, jnp.asarray(PART_REGION)[part], speed[part],
        of_speed[part], of_place[part], sure,
    )  # fmt: skip


def measured_speed(params: BodyParams, fit: BodyFit, x: Vector3, reaction: Scalar, assumed: Scalar) -> Float[Array, ""]:
    """Upper bound of the speed at which the body comes to a place, v_h; what is assumed where it is not known surely [m/s].

    The fastest of the parts that may be the nearest, raised by its uncertainty and by what a person may gain within the reaction time;
    not under 0, nor over what is assumed.

    Args:
        fit: of one frame.
        x: the place [m].
        reaction: time until the arm answers [s].
        assumed: speed of a person who is not measured [m/s].
    """
    distance, speed, of_speed, _, _ = parts_at(params, fit, x)
    near = nearest_part(params, fit, x)
    bound = speed + params.deviations * of_speed
    fastest = jnp.max(jnp.where(distance < near.distance + params.rivals, bound, -jnp.inf))
    fastest = jnp.maximum(fastest + params.human_acceleration * reaction, 0.0)
    most = jnp.asarray(assumed, x.dtype)
    return jnp.where(near.sure, jnp.minimum(fastest, most), most)


def ahead(params: BodyParams, fit: BodyFit, time: Scalar) -> tuple[Float[Array, "joint 3"], Float[Array, "joint"]]:
    """Where the joints will be [m], and the standard deviation of that in the worst direction [m].

    Constant velocity, for some tenths of a second; what accelerations may add grows with the square of the time.

    Args:
        time: from the frame on [s].
    """
    kinds = jnp.asarray([0, 1, 2, 3, 3, 4, 4, 5, 5, 6, 6])
    pushed = 0.5 * jnp.asarray(params.acceleration, fit.joints.dtype)[kinds] * time * time
    spread = (
        jnp.linalg.eigvalsh(fit.place_covariance)[:, -1]
        + time * time * jnp.linalg.eigvalsh(fit.speed_covariance)[:, -1]
    )
    return fit.joints + time * fit.speeds, safe_sqrt(spread + pushed * pushed)
