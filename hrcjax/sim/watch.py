"""One image of one camera: rendered and measured, delivered with its faults, judged, and taken into the track of people.

The exact scene and person enter only by the rendered image.
"""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.body import BodyParams
from hrcjax.geom.capsules import Capsules
from hrcjax.presence import Presence, PresenceParams, Track, VoxelLayout, initial_track, presence_cloud, update_track
from hrcjax.sense import Delivered, FaultSchedule, HealthState, deliver, judge_image
from hrcjax.sense.camera import render_capsules, render_scene
from hrcjax.sense.health import NO_IMAGE
from hrcjax.sense.noise import measure
from hrcjax.sense.rig import Rig
from hrcjax.sim.followed import Followed, follow_body, nobody_followed
from hrcjax.sim.survey import SenseParams, Survey, crop_box
from hrcjax.typing import Array, Bool, Float, Int, PRNGKeyArray
from hrcjax.world import Person, Scene
from hrcjax.world.person import person_at


class Watch(eqx.Module):
    """State of the cameras that watch the cell."""

    track: Track
    """Where people may be."""
    health: HealthState
    """Of each camera."""
    reasons: Int[Array, "camera"]
    """What is wrong with each camera's latest image, bits of `HEALTH_REASONS`; 0: nothing."""
    body: Followed | None = None
    """The body of a person; None: it is not followed."""


class Stage(eqx.Module):
    """What the cameras look at, made once for a world."""

    rig: Rig
    """The cameras."""
    scene_depth: Float[Array, "camera height width"]
    """Exact depth of the scene in each stationary camera [m]."""
    person: Person
    """Everybody in the cell."""
    faults: FaultSchedule
    """What the cameras suffer."""


def stage_of(rig: Rig, scene: Scene, person: Person, faults: FaultSchedule) -> Stage:
    """Renders the scene in every camera."""
    return Stage(rig, jax.vmap(lambda camera: render_scene(camera, scene))(rig.cameras), person, faults)


def initial_watch(voxels: VoxelLayout, survey: Survey, time: Float[Array, ""], body: BodyParams | None = None) -> Watch:
    """After the set-up, before the first image.

    Args:
        time: of the first image [s].
        body: follow the body of a person; None: not.
    """
    count = survey.empty.settled.shape[0]
    followed = None if body is None else nobody_followed(body, time)
    return Watch(initial_track(voxels, count, time), survey.health, jnp.zeros((count,), jnp.int32), followed)


def periods(rig: Rig, dtype: jnp.dtype) -> Float[Array, "camera"]:
    """Time between two images of each camera [s]."""
    return jnp.asarray([1.0 / rate for rate in rig.rates], dtype)


def watch_image(
    voxels: VoxelLayout,
    params: SenseParams,
    survey: Survey,
    stage: Stage,
    state: Watch,
    camera: Int[Array, ""],
    exposed: Float[Array, ""],
    robot: Capsules,
    key: PRNGKeyArray,
    latency: float,
    body: BodyParams | None = None,
) -> tuple[Watch, Bool[Array, ""]]:
    """The state after one image, and whether the image was good.

    Args:
        camera: which one.
        exposed: when [s].
        robot: the arm then, as its joint encoders tell.
        latency: usual time from exposure to use [s].
        body: follow the body of a person; None: not.
    """
    key, fault_key = jax.random.split(key)
    depth, shows = shown(params, stage, camera, exposed, robot, key)
    got = deliver(stage.faults, camera, exposed, depth, shows, state.health.last[camera], fault_key)
    after, good = taken(voxels, params, survey, stage.rig, state, camera, exposed, got, robot, latency)
    if body is None or after.body is None:
        return after, good
    found = follow_body(body, voxels, stage.rig, after.track, after.body, camera, exposed, good)
    return eqx.tree_at(lambda w: w.body, after, found), good


def shown(
    params: SenseParams,
    stage: Stage,
    camera: Int[Array, ""],
    exposed: Float[Array, ""],
    robot: Capsules,
    key: PRNGKeyArray,
) -> tuple[Float[Array, "height width"], Bool[Array, "height width"]]:
    """What a camera measures [m], and which pixels show a person. Arguments as `watch_image`."""
    eye = jax.tree.map(lambda a: a[camera], stage.rig.cameras)
    nothing = jnp.full((eye.height, eye.width), jnp.inf, stage.scene_depth.dtype)
    person_depth = render_capsules(eye, person_at(stage.person, exposed), nothing)
    behind = jnp.minimum(stage.scene_depth[camera], render_capsules(eye, robot, nothing))
    return measure(jnp.minimum(behind, person_depth), eye, key, params.noise), person_depth < behind


def taken(
    voxels: VoxelLayout,
    params: SenseParams,
    survey: Survey,
    rig: Rig,
    state: Watch,
    camera: Int[Array, ""],
    exposed: Float[Array, ""],
    got: Delivered,
    robot: Capsules,
    latency: float,
) -> tuple[Watch, Bool[Array, ""]]:
    """The state after an image that a camera delivered, or did not, and whether it was good.

    Args:
        rig: the cameras.
        got: what this one delivered. The others: as `watch_image`.
    """
    dtype = got.depth.dtype
    eye = jax.tree.map(lambda a: a[camera], rig.cameras)
    robot_depth = render_capsules(eye, robot, jnp.full((eye.height, eye.width), jnp.inf, dtype))
    health = jax.tree.map(lambda a: a[camera], state.health)
    judged, reasons = judge_image(
        params.health, health, got.depth, got.stamp, exposed + latency + got.delay, jnp.asarray(False)
    )
    period = periods(rig, dtype)
    reasons = jnp.where(got.arrives, reasons, NO_IMAGE)
    health = jax.tree.map(lambda new, old: jnp.where(got.arrives, new, old), judged, health)
    good = reasons == 0
    track = update_track(
        voxels, params.presence, survey.empty, state.track, camera, rig.cameras, period, exposed, good, got.depth,
        robot_depth, crop_box(params, dtype),
    )  # fmt: skip
    after = Watch(
        track,
        jax.tree.map(lambda all_, one: all_.at[camera].set(one), state.health, health),
        state.reasons.at[camera].set(reasons),
        state.body,
    )
    return after, good


def people_seen(
    voxels: VoxelLayout, params: PresenceParams, survey: Survey, rig: Rig, state: Watch, robot: Capsules, capacity: int
) -> Presence:
    """The points of people after an image; see `presence_cloud`."""
    period = periods(rig, state.track.time.dtype)
    return presence_cloud(voxels, params, survey.empty, state.track, period, robot, capacity)
