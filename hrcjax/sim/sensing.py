"""Sensing that all settings of a world share: every image of an episode, with the arm moving as a nominal one.

The scene is surveyed before anyone comes (`hrcjax.sim.survey`); then every image of the stationary cameras tells where
people may be. See `hrcjax.sim.own_sensing` for sensing with the arm where it really is.
"""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.body import BodyFit, BodyParams
from hrcjax.field.grid import GridField
from hrcjax.geom.capsules import Capsules
from hrcjax.geom.cloud import Cloud
from hrcjax.geom.segment import FAR
from hrcjax.map import FieldMap
from hrcjax.presence import VoxelLayout
from hrcjax.sim.survey import SenseParams, Survey
from hrcjax.sim.watch import Stage, Watch, initial_watch, people_seen, watch_image
from hrcjax.typing import Array, Bool, Float, Int, PRNGKeyArray

MOVING_CAPACITY = 768
"""Default capacity of a cloud of moving points."""


class Frames(eqx.Module):
    """All sensed data of one scene and its people."""

    scene: GridField
    """Distance to everything that stands: the map of the set-up, sampled on a grid."""
    moving: Cloud
    """Points of people, image by image, (frame point)."""
    beyond: Float[Array, "*frame"]
    """Whatever of them had no place in the cloud is farther from the robot's base than this [m]."""
    stamp: Float[Array, "*frame"]
    """When each image was taken [s]."""
    camera: Int[Array, "*frame"]
    """By which camera."""
    valid: Bool[Array, "*frame"]
    """False where an image was refused or missing: it carries no information, also not that nobody is present."""
    reasons: Int[Array, "*frame camera"]
    """What is wrong with each camera's latest image then: bits of `hrcjax.sense.HEALTH_REASONS`; 0: nothing."""
    guarded: Bool[Array, "*frame"]
    """True where an image was refused, a camera is missing, or somebody may be hidden who was measured before: reduced speed."""
    static_overflow: Bool[Array, ""]
    """True where the map of the set-up exceeded a capacity, or a camera has no settled picture of the cell."""
    map: FieldMap | None = None
    """The map of the set-up, for fields that read it themselves. None: the frames have no map."""
    unseen: Bool[Array, "voxel"] | None = None
    """Voxels that no camera saw in the set-up."""
    hidden: GridField | None = None
    """Distance to space where somebody may be unseen; None: nobody is where no camera looks."""
    body: BodyFit | None = None
    """The body of a person after every image; None: it is not followed."""

    @staticmethod
    def nobody(
        scene: GridField,
        capacity: int,
        cameras: int,
        dtype: jnp.dtype,
        overflow: Array,
        known: FieldMap | None,
        hidden: GridField | None = None,
    ) -> "Frames":
        """One image without anyone, without an axis of frames."""
        cloud = Cloud(jnp.zeros((capacity, 3), dtype), jnp.zeros((capacity,), bool))
        zero, no = jnp.zeros((), dtype), jnp.asarray(False)
        reasons = jnp.zeros((cameras,), jnp.int32)
        return Frames(
            scene, cloud, zero + FAR, zero, jnp.zeros((), jnp.int32), no, reasons, no, overflow, known, None, hidden
        )


def frame_of(
    voxels: VoxelLayout, params: SenseParams, survey: Survey, stage: Stage, state: Watch, robot: Capsules, capacity: int
) -> tuple:
    """Cloud, `Frames.beyond`, reasons and `Frames.guarded` after an image."""
    seen = people_seen(voxels, params.presence, survey, stage.rig, state, robot, capacity)
    guarded = seen.lost | state.track.missing | jnp.any(state.reasons != 0)
    return seen.cloud, seen.beyond, state.reasons, guarded


def sense_sequence(
    voxels: VoxelLayout,
    capacity: int,
    latency: float,
    survey: Survey,
    scene: GridField,
    stage: Stage,
    robot: Capsules,
    stamps: Float[Array, "frame"],
    cameras: Int[Array, "frame"],
    key: PRNGKeyArray,
    params: SenseParams,
    hidden: GridField | None = None,
    body: BodyParams | None = None,
) -> Frames:
    """Every image of an episode, in the order of exposure.

    Args:
        voxels: in which people are followed.
        capacity: of each cloud.
        latency: usual time from exposure to use [s].
        survey: of the empty cell.
        scene: its distance field.
        stage: what the cameras look at.
        robot: the arm's capsules at every stamp (frame capsule).
        stamps: times of the images, increasing [s].
        cameras: which one takes each.
        key: random key of the noise.
        params: parameters of sensing.
        hidden: distance to space where somebody may be unseen; None: nobody is there.
        body: follow the body of a person; None: not.

    Raises:
        ValueError: the number of arm poses differs from that of stamps.
    """
    if robot.radius.shape[0] != stamps.shape[0]:
        raise ValueError(f"{robot.radius.shape[0]} poses of the arm for {stamps.shape[0]} stamps")

    def image(state: Watch, item: tuple) -> tuple[Watch, tuple]:
        stamp, camera, arm, key = item
        state, good = watch_image(voxels, params, survey, stage, state, camera, stamp, arm, key, latency, body)
        fit = None if state.body is None else state.body.fit
        return state, (*frame_of(voxels, params, survey, stage, state, arm, capacity), good, fit)

    keys = jax.random.split(key, stamps.shape[0])
    start = initial_watch(voxels, survey, stamps[0], body)
    _, (cloud, beyond, reasons, guarded, good, fits) = jax.lax.scan(image, start, (stamps, cameras, robot, keys))
    return Frames(
        scene,
        cloud,
        beyond,
        stamps,
        cameras,
        good,
        reasons,
        guarded,
        survey.overflow,
        survey.map,
        survey.unseen,
        hidden,
        fits,
    )
