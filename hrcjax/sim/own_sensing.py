"""An episode that senses with the arm where it really is: between control ticks each camera takes its images at its own
rate, with this setting's arm in the picture, occluding the view and removed from it where its encoders say it is.

Sweeps share one sensing by all settings (`hrcjax.sim.sensing`), with a nominal arm; this is for one setting at a time.
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.body import BodyFit
from hrcjax.geom.capsules import Capsules
from hrcjax.robot import arm_capsules
from hrcjax.sense.rig import exposures
from hrcjax.sim.cell import Cell
from hrcjax.sim.episode import Episode, pack_cameras, plan_route
from hrcjax.sim.followed import nobody_followed
from hrcjax.sim.params import Params
from hrcjax.sim.parts import Fields, Task
from hrcjax.sim.prepare import LEAD, Surveyed
from hrcjax.sim.sensing import Frames, frame_of
from hrcjax.sim.survey import SenseParams
from hrcjax.sim.tick import Record, Sensed, TickState, initial_state, tick
from hrcjax.sim.watch import Watch, initial_watch, watch_image
from hrcjax.typing import Array, Bool, Float, Int, Joints, PRNGKeyArray, Scalar

PENDING = 6
"""Images that are kept until they are used: more than are exposed within the latency."""


class Kept(eqx.Module):
    """The last images, in a ring."""

    static: Any
    """Field of the scene."""
    moving: Any
    """Fields of the people in each."""
    stamp: Float[Array, "image"]
    """When each was taken; minus infinity: none yet [s]."""
    valid: Bool[Array, "image"]
    """False where it was refused."""
    guarded: Bool[Array, "image"]
    """See `Frames.guarded`."""
    faults: Int[Array, "image"]
    """See `Record.cameras`."""
    count: Int[Array, ""]
    """Images so far."""
    body: BodyFit | None = None
    """The body of a person in each; None: it is not followed."""


def tick_images(cell: Cell, rates: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The images before the episode (times [s], cameras), and those of every tick (times [s], cameras; -1: none).

    Raises:
        ValueError: more than one image in a tick.
    """
    stamps, cameras = exposures(rates, -LEAD, cell.ticks * cell.dt)
    before = stamps < 0
    at = np.floor(stamps[~before] / cell.dt + 1e-6).astype(int)
    if len(np.unique(at)) != len(at):
        raise ValueError(f"cameras of {rates} Hz take two images in one tick of {cell.dt} s; accepted: one at most")
    times, which = np.zeros(cell.ticks), np.full(cell.ticks, -1, np.int32)
    times[at], which[at] = stamps[~before], cameras[~before]
    return stamps[before], cameras[before], times, which


def episode_own(
    params: Params, cell: Cell, known: Surveyed, key: PRNGKeyArray, sense: SenseParams, stop: Bool[Array, "time"] | None = None
) -> Episode:  # fmt: skip
    """Plan a path and follow it beside the person, with images of this very arm.

    Args:
        known: the surveyed cell.
        key: random key of the images' noise.
        sense: parameters of sensing.
        stop: whether a command stops the arm, at every tick; None: commands are not read.
    """
    path, route = plan_route(params, cell, Task(known.scene, known.q_start, params.potential, cell.arm))
    images = ticks_of(cell, known, key)
    state, kept = first_looks(params, cell, known, sense, key)

    def one(carry: tuple[Watch, Kept, TickState], now: tuple[TickImage, Array | None]) -> tuple[tuple[Watch, Kept, TickState], Record]:  # fmt: skip
        state, kept, arm = carry
        item, stop = now
        state, kept = look_if_due(params, cell, known, sense, state, kept, arm.arm.q, item)
        arm, record = tick(params, cell, route, images_in_use(cell, known, kept, item.t, stop), arm)
        return (state, kept, arm), record

    start = (state, kept, initial_state(cell, known.q_start))
    (_, _, final), record = jax.lax.scan(one, start, (images, stop))
    return Episode(path, record, final)


class TickImage(eqx.Module):
    """The image of a tick; an episode stacks them over time."""

    t: Float[Array, "*time"]
    """Start of the tick [s]."""
    exposed: Float[Array, "*time"]
    """When the image is taken [s]."""
    camera: Int[Array, "*time"]
    """By which camera; -1: there is none."""
    key: Array
    """Random key of its noise."""


def image_keys(cell: Cell, rates: tuple[float, ...], key: PRNGKeyArray) -> tuple[Array, Array]:
    """Random keys of the images before the episode, and one for each tick."""
    early = len(tick_images(cell, rates)[0])
    keys = jax.random.split(key, early + cell.ticks)
    return keys[:early], keys[early:]


def ticks_of(cell: Cell, known: Surveyed, key: PRNGKeyArray) -> TickImage:
    """The images of all ticks."""
    dtype, rates = known.q_start.dtype, known.stage.rig.rates
    _, _, times, which = tick_images(cell, rates)
    _, keys = image_keys(cell, rates, key)
    return TickImage(jnp.asarray(cell.times, dtype), jnp.asarray(times, dtype), jnp.asarray(which), keys)


def look(
    params: Params, cell: Cell, known: Surveyed, sense: SenseParams, state: Watch, kept: Kept, q: Joints, t: Float[Array, ""],
    camera: Array, key: PRNGKeyArray,
) -> tuple[Watch, Kept]:  # fmt: skip
    """The cameras' state after one image, with the field of the people in it kept.

    Args:
        q: joints of the arm in the image [rad].
        t: when it is taken [s].
    """
    arm = arm_capsules(cell.arm, q)
    state, good = watch_image(
        cell.voxels, sense, known.survey, known.stage, state, camera, t, arm, key, cell.latency, cell.body
    )
    return state, keep(params, cell, known, sense, state, kept, arm, t, camera, good)


def keep(
    params: Params, cell: Cell, known: Surveyed, sense: SenseParams, state: Watch, kept: Kept, arm: Capsules, t: Float[Array, ""],
    camera: Array, good: Bool[Array, ""],
) -> Kept:  # fmt: skip
    """The images kept after one that the cameras' state has taken: the field of the people in it is fitted.

    Args:
        arm: in the image.
        good: whether it was not refused.
    """
    capacity = cell.moving_points * cell.people
    cloud, beyond, reasons, guarded = frame_of(cell.voxels, sense, known.survey, known.stage, state, arm, capacity)
    one = Frames(
        known.field, cloud, beyond, t, camera, good, reasons, guarded, known.survey.overflow, known.survey.map,
        known.survey.unseen, known.hidden,
    )  # fmt: skip
    moving = fit_one(params, cell, one)[1]
    place = kept.count % PENDING

    def put(all_: Array, new: Array) -> Array:
        return all_.at[place].set(new)

    return Kept(
        kept.static, jax.tree.map(put, kept.moving, moving), put(kept.stamp, t), put(kept.valid, good),
        put(kept.guarded, guarded), put(kept.faults, pack_cameras(reasons)), kept.count + 1,
        None if state.body is None else jax.tree.map(put, kept.body, state.body.fit),
    )  # fmt: skip


def look_if_due(
    params: Params, cell: Cell, known: Surveyed, sense: SenseParams, state: Watch, kept: Kept, q: Joints, item: TickImage
) -> tuple[Watch, Kept]:  # fmt: skip
    """The cameras' state after a tick's image; the same where it has none."""
    return jax.lax.cond(
        item.camera >= 0,
        lambda: look(
            params, cell, known, sense, state, kept, q, item.exposed, jnp.maximum(item.camera, 0), item.key
        ),
        lambda: (state, kept),
    )  # fmt: skip


def first_looks(
    params: Params, cell: Cell, known: Surveyed, sense: SenseParams, key: PRNGKeyArray
) -> tuple[Watch, Kept]:  # fmt: skip
    """The cameras' state after the images before the episode, with the arm at its start."""
    dtype, q_start, rates = known.q_start.dtype, known.q_start, known.stage.rig.rates
    stamps, cameras, _, _ = tick_images(cell, rates)
    keys, _ = image_keys(cell, rates, key)
    state = initial_watch(cell.voxels, known.survey, jnp.asarray(stamps[0], dtype), cell.body)
    kept = nothing_kept(params, cell, known, cell.moving_points * cell.people)

    def before(carry: tuple[Watch, Kept], item: tuple) -> tuple[tuple[Watch, Kept], None]:
        t, camera, key = item
        return look(params, cell, known, sense, *carry, q_start, t, camera, key), None

    items = (jnp.asarray(stamps, dtype), jnp.asarray(cameras), keys)
    return jax.lax.scan(before, (state, kept), items)[0]


def images_in_use(cell: Cell, known: Surveyed, kept: Kept, t: Scalar, stop: Bool[Array, ""] | None = None) -> Sensed:
    """What of the images is in use at a time, and whether a command stops the arm; None: commands are not read."""
    arrived = kept.stamp <= t - cell.latency
    usable = jnp.where(arrived & kept.valid, kept.stamp, -jnp.inf)
    newest, latest = jnp.argmax(usable), jnp.argmax(jnp.where(arrived, kept.stamp, -jnp.inf))
    age = jnp.where(jnp.isfinite(usable[newest]), t - usable[newest], jnp.inf)
    fields = Fields(kept.static, jax.tree.map(lambda a: a[newest], kept.moving))
    guarded = kept.guarded[newest] | kept.guarded[latest]
    body = jax.tree.map(lambda a: a[newest], kept.body)
    return Sensed(fields, age, ~known.survey.overflow, guarded, kept.faults[latest], stop, body)


def fit_one(params: Params, cell: Cell, frame: Frames) -> tuple[Any, Any]:
    """The field of the scene, and that of the people in one image."""
    alone = eqx.tree_at(
        lambda f: (f.moving, f.beyond, f.stamp, f.camera, f.valid, f.reasons, f.guarded),
        frame,
        replace_fn=lambda part: jax.tree.map(lambda a: a[None], part),
    )
    fields = cell.field.fit(params.field, alone)
    return fields.static, jax.tree.map(lambda a: a[0], fields.moving)


def nothing_kept(params: Params, cell: Cell, known: Surveyed, capacity: int) -> Kept:
    """A ring without images."""
    dtype, count = known.q_start.dtype, known.stage.rig.count
    empty = Frames.nobody(known.field, capacity, count, dtype, known.survey.overflow, known.survey.map, known.hidden)
    static, moving = fit_one(params, cell, empty)
    no = jnp.zeros((PENDING,), bool)

    def ring(a: Array) -> Array:
        return jnp.broadcast_to(a, (PENDING, *a.shape))

    body = None if cell.body is None else nobody_followed(cell.body, jnp.zeros((), dtype)).fit
    return Kept(
        static, jax.tree.map(ring, moving), jnp.full((PENDING,), -jnp.inf, dtype), no, no, jnp.zeros((PENDING,), jnp.int32),
        jnp.zeros((), jnp.int32), jax.tree.map(ring, body),
    )  # fmt: skip
