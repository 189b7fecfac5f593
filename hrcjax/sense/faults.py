"""Faults of depth cameras as data: what each camera suffers, from when to when, and what it then delivers.

A fault is active while an image is exposed at or after its begin and before its end. Of two faults of one kind on one
camera at one time that in the first slot counts. Faults of different kinds act together, in the order of the light's
way: in front of the lens (BLOCKED), lens (BLURRED), stereo (PERSON_LOST), transfer (HALF_EMPTY), driver (FROZEN, stamps,
delays).
"""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.sense.points import valid_depth
from hrcjax.typing import Array, Bool, Float, Int, PRNGKeyArray, Scalar

NONE, PERSON_LOST, FROZEN, BLOCKED, BLURRED, HALF_EMPTY, DROPPED, LATE, SKEWED = range(9)

FAULTS = {
    NONE: "no fault",
    PERSON_LOST: "person not measured",
    FROZEN: "last image again",
    BLOCKED: "lens covered",
    BLURRED: "image blurred",
    HALF_EMPTY: "half of the image empty",
    DROPPED: "image dropped",
    LATE: "image late",
    SKEWED: "time stamp wrong",
}
"""Kinds of faults: code -> words."""

AMOUNTS = {
    NONE: 0.0,
    PERSON_LOST: 1.0,
    FROZEN: 0.0,
    BLOCKED: 0.0,
    BLURRED: 9.0,
    HALF_EMPTY: 1.0,
    DROPPED: 0.0,
    LATE: 0.2,
    SKEWED: -0.3,
}
"""Default amounts of `one_fault`; what they mean is told at `FaultSchedule.amount`."""

STEP = 0.001
"""Depths that a fault computes are rounded to the unit of the camera's images [m]."""
SCATTER = 0.1
"""Standard deviation of the depth of something too near to be measured, as a share of it; our estimate [1]."""


class FaultSchedule(eqx.Module):
    """Faults of several cameras, several for each."""

    kind: Int[Array, "camera slot"]
    """What happens: a code of `FAULTS`."""
    begin: Float[Array, "camera slot"]
    """The first image with the fault is exposed then or later [s]."""
    end: Float[Array, "camera slot"]
    """The last one before this; infinity: it stays [s]."""
    amount: Float[Array, "camera slot"]
    """How much of it. PERSON_LOST: share of the person's pixels without measurement [1]. BLOCKED: depth of what covers the
    lens; 0: nothing is measured [m]. BLURRED: edge of the square that a pixel is the mean of, rounded down to an odd
    number [px]. HALF_EMPTY: positive: the left half, negative: the right one. LATE: extra delay [s]. SKEWED: stamp minus
    exposure [s]. Others: not used."""


class Delivered(eqx.Module):
    """What a camera delivers of one exposure."""

    depth: Float[Array, "height width"]
    """The image; 0: no measurement [m]."""
    stamp: Float[Array, ""]
    """When the camera says that it was exposed [s]."""
    delay: Float[Array, ""]
    """Time until it arrives, beyond the usual one [s]."""
    arrives: Bool[Array, ""]
    """False: it never does, and the other fields mean nothing. The camera's last image stays the one before."""


def no_faults(cameras: int, dtype: jnp.dtype | type = jnp.float32) -> FaultSchedule:
    """Cameras that work."""
    nothing = jnp.zeros((cameras, 1), dtype)
    return FaultSchedule(jnp.full((cameras, 1), NONE, jnp.int32), nothing, nothing, nothing)


def one_fault(
    kind: int,
    camera: int,
    begin: float | int,
    end: float | int,
    cameras: int,
    amount: float | int | None = None,
    dtype: jnp.dtype | type = jnp.float32,
) -> FaultSchedule:
    """One fault of one of several cameras; made on the host. More: `join_faults`.

    Args:
        kind: a code of `FAULTS`.
        camera: which of them, from 0.
        begin: time of the first exposure with the fault [s].
        end: time of the first exposure without it; infinity: it stays [s].
        cameras: number of cameras.
        amount: see `FaultSchedule.amount`; None: that of `AMOUNTS`.
        dtype: of times and amounts.

    Raises:
        ValueError: an unknown kind, no such camera, an end that is not after the begin, or an amount that the kind does not
            have.
    """
    if kind not in FAULTS:
        raise ValueError(
            f"unknown kind of fault {kind}: accepted are {', '.join(f'{k} {w}' for k, w in FAULTS.items())}"
        )
    if not 0 <= camera < cameras:
        raise ValueError(f"camera {camera} of {cameras}: accepted are 0 to {cameras - 1}")
    if not begin < end:
        raise ValueError(f"a fault from {begin} s to {end} s: the end must be after the begin")
    amount = AMOUNTS[kind] if amount is None else float(amount)
    wrong = {
        PERSON_LOST: not 0 <= amount <= 1,
        BLOCKED: amount < 0,
        BLURRED: amount < 1,
        HALF_EMPTY: amount == 0,
        LATE: amount < 0,
    }
    if wrong.get(kind, False) or not math.isfinite(amount):
        raise ValueError(f"{FAULTS[kind]}: amount {amount} is out of its range, see FaultSchedule.amount")

    here = np.arange(cameras)[:, None] == camera
    kinds = jnp.asarray(np.where(here, kind, NONE), jnp.int32)
    return FaultSchedule(kinds, *(jnp.asarray(np.where(here, value, 0.0), dtype) for value in (begin, end, amount)))


def join_faults(*schedules: FaultSchedule) -> FaultSchedule:
    """The faults of several schedules of the same cameras; the slots of the first come first.

    Raises:
        ValueError: none, or schedules of different numbers of cameras.
    """
    if len({schedule.kind.shape[0] for schedule in schedules}) != 1:
        raise ValueError(
            f"schedules of {[s.kind.shape[0] for s in schedules]} cameras; accepted: one or more, of the same cameras"
        )
    return jax.tree.map(lambda *columns: jnp.concatenate(columns, axis=1), *schedules)


def _active(
    schedule: FaultSchedule, camera: Int[Array, ""], exposed: Float[Array, ""], kind: int
) -> tuple[Bool[Array, ""], Float[Array, ""]]:
    """Whether a camera has a fault of a kind, and its amount; 0 if not."""
    here = (schedule.kind[camera] == kind) & (schedule.begin[camera] <= exposed) & (exposed < schedule.end[camera])
    on = jnp.any(here)
    return on, jnp.where(on, schedule.amount[camera][jnp.argmax(here)], 0.0)


def _box_sum(image: Float[Array, "row column"], reach: Int[Array, ""]) -> Float[Array, "row column"]:
    """Sum over the rows from -reach to +reach around each, as far as the image goes."""
    rows = jnp.arange(image.shape[0], dtype=jnp.int32)
    sums = jnp.concatenate([jnp.zeros_like(image[:1]), jnp.cumsum(image, axis=0)])
    above, below = jnp.maximum(rows - reach, 0), jnp.minimum(rows + reach + 1, image.shape[0])
    return sums[below] - sums[above]


def blur(depth: Float[Array, "height width"], width: Scalar) -> Float[Array, "height width"]:
    """Every pixel the mean of what is measured in a square around it, foreground and background alike [m].

    Not measured where less than half of the square is.

    Args:
        depth: 0 or not finite: no measurement [m].
        width: edge of the square, rounded down to an odd number [px].
    """
    reach = ((jnp.asarray(width) - 1) / 2).astype(jnp.int32)
    there = valid_depth(depth)
    known = jnp.where(there, depth, 0)

    def square(image: Array) -> Array:
        return _box_sum(_box_sum(image, reach).T, reach).T

    measured = square(there.astype(depth.dtype))
    mean = square(known) / jnp.maximum(measured, 1)
    return jnp.where(2 * measured >= square(jnp.ones_like(depth)), jnp.round(mean / STEP) * STEP, 0)


def deliver(
    schedule: FaultSchedule,
    camera: Int[Array, ""],
    exposed: Float[Array, ""],
    depth: Float[Array, "height width"],
    person: Bool[Array, "height width"],
    last: Float[Array, "height width"],
    key: PRNGKeyArray,
) -> Delivered:
    """What a camera delivers of an image that it measured.

    Args:
        schedule: faults of all cameras.
        camera: which of them.
        exposed: when the image was exposed [s].
        depth: the measured image; 0: no measurement [m].
        person: True where the image shows a person.
        last: the last image that this camera delivered; 0 before the first [m].
        key: random key of the faults.
    """
    key_lost, key_near = jax.random.split(key)

    def fault(kind: int) -> tuple[Array, Array]:
        return _active(schedule, camera, exposed, kind)

    blocked, near = fault(BLOCKED)
    cover = near * (1 + SCATTER * jax.random.normal(key_near, depth.shape, depth.dtype))
    image = jnp.where(blocked, jnp.maximum(jnp.round(cover / STEP) * STEP, 0), depth)
    blurred, width = fault(BLURRED)
    image = jax.lax.cond(blurred, blur, lambda image, width: image, image, width)  # the only one that costs time
    lost, share = fault(PERSON_LOST)
    image = jnp.where(lost & person & (jax.random.uniform(key_lost, depth.shape, depth.dtype) < share), 0, image)
    halved, side = fault(HALF_EMPTY)
    left = jnp.arange(depth.shape[1]) < depth.shape[1] // 2
    image = jnp.where(halved & (left == (side > 0)), 0, image)
    image = jnp.where(fault(FROZEN)[0], last, image)

    _, shift = fault(SKEWED)
    _, delay = fault(LATE)
    return Delivered(image, exposed + shift, delay, ~fault(DROPPED)[0])
