"""The set-up: the empty cell is looked at by all cameras while the arm moves, until the map has settled."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.map import (
    FieldMap,
    FrameParams,
    MapLayout,
    MapParams,
    StreamParams,
    empty_map,
    initial_stream,
    settle,
    take_frame,
)
from hrcjax.presence import (
    Background,
    Empty,
    PresenceParams,
    VoxelLayout,
    initial_background,
    learn_background,
    seen_free,
    settled_depth,
    sight_of,
    survey_empty,
    unpack_columns,
    voxel_of,
)
from hrcjax.presence.sight import all_sights
from hrcjax.presence.voxels import inside_box
from hrcjax.robot import Arm, arm_capsules, tool_frame
from hrcjax.sense import Camera, HealthParams, HealthState, NoiseParams, initial_health, judge_image
from hrcjax.sense.camera import render_capsules, render_scene
from hrcjax.sense.noise import measure
from hrcjax.sense.rig import Rig, hand_camera
from hrcjax.typing import Array, Bool, Float, Int, PRNGKeyArray, Vector3
from hrcjax.world import Scene

ROUND = 1.0
"""Time between two rounds of images, in which the arm moves on [s]."""
MOST_ROUNDS = 40
"""Rounds after which the set-up ends in any case."""
LEAST_KNOWN = 0.25
"""Share of a camera's picture that must have settled for it to watch anything [1]."""
STILL = 3
"""Rounds in a row without a change that end the set-up."""
TILE_COLUMNS = 80
"""Least number of tiles along the width of an image."""
SCENE_LAYOUT = MapLayout(
    lower=(-2.0, -2.0, 0.0), shape=(40, 40, 14), spacing=0.025, capacity=512, levels=3, seen=512, born=256, refitted=128
)
"""The map of what stands around the arm's base, at the HRI paper's finer spacing of 2.5 cm."""


def scene_frame_params() -> FrameParams:
    """The map's parameters for cameras up to 3 m away that see little but the table. A point is removed after two images that
    look through it: nothing moves in the set-up, and noise would keep the map from settling."""
    return FrameParams(map=MapParams(far=3.5, patience=2.0), stream=StreamParams(least_share=0.2))


class SenseParams(eqx.Module):
    """Parameters of sensing: set-up, crop box, people, camera noise."""

    frame: FrameParams = eqx.field(default_factory=scene_frame_params)
    """Parameters of fusing an image of the set-up into the map."""
    presence: PresenceParams = PresenceParams()
    """How people are told from the scene, and followed where no camera sees them."""
    health: HealthParams = HealthParams(delay_change=0.02)
    """When an image is refused."""
    delay: float = 0.05
    """Usual time from the exposure of an image to its use; `Cell.latency` takes its place [s]."""
    settled: float = 2.0
    """Points that may appear or vanish in a round of images for the map to count as settled [1]."""
    table_margin: float = 0.03
    """Points lower than this above the table top are cropped, because of noise [m]."""
    reach: float = 2.0
    """Half width of the crop box around the robot's base, in x and y [m]."""
    ceiling: float = 1.3
    """Height of the crop box above the table [m]."""
    noise: NoiseParams = NoiseParams()
    """Noise of the cameras."""
    unseen_obstacle: bool = eqx.field(static=True, default=False)
    """Whether the arm keeps away from space that no camera saw in the set-up, as from an obstacle."""
    unseen_person: bool = eqx.field(static=True, default=False)
    """Whether somebody may be in that space, so that the safety monitor counts the distance to it."""


class Survey(eqx.Module):
    """What is known of the empty cell."""

    map: FieldMap
    """All that stands there, as far as a camera saw it."""
    empty: Empty
    """What the stationary cameras watch."""
    health: HealthState
    """What is usual for each stationary camera."""
    unseen: Bool[Array, "voxel"]
    """Voxels of the crop box that no camera saw free or as a surface: hidden sides, the inside of obstacles, and what lies
    outside of all views."""
    rounds: Int[Array, ""]
    """Rounds of images until the map had settled [1]."""
    settled: Bool[Array, ""]
    """False if it still changed when the set-up ended."""
    overflow: Bool[Array, ""]
    """True if a capacity of the map was exceeded, or a camera has no settled picture of the cell: the arm holds."""


def crop_box(params: SenseParams, dtype: jnp.dtype) -> tuple[Vector3, Vector3]:
    """Minimum and maximum corner of the crop box [m]."""
    lower = jnp.stack([jnp.asarray(v, dtype) for v in (-params.reach, -params.reach, params.table_margin)])
    upper = jnp.stack([jnp.asarray(v, dtype) for v in (params.reach, params.reach, params.ceiling)])
    return lower, upper


def tile_of(camera: Camera) -> int:
    """Pixels along the edge of the tiles that images are thinned to."""
    return max(1, camera.width // TILE_COLUMNS)


@partial(jax.jit, static_argnums=(0, 1, 2))
def survey(
    arm: Arm,
    layout: MapLayout,
    voxels: VoxelLayout,
    rig: Rig,
    scene: Scene,
    postures: Float[Array, "look joint"],
    key: PRNGKeyArray,
    params: SenseParams,
) -> Survey:
    """Looks at the empty cell until the map has settled: one image of every camera in each posture of the scan, then
    more from its last one while the map still changes.

    Args:
        layout: of the map.
        voxels: in which people will be followed.
        scene: what stands there; enters only by the images.
        postures: of the scan [rad].
        key: random key of the noise.
    """
    dtype = postures.dtype
    box, first = crop_box(params, dtype), jax.tree.map(lambda a: a[0], rig.cameras)
    tile, count, looks = tile_of(first), rig.count, postures.shape[0]
    places = count + (rig.hand is not None)
    sights = all_sights(voxels, rig.cameras)

    def image(known: tuple, c: Int[Array, ""], q: Array, stamp: Array, key: PRNGKeyArray) -> tuple:
        """One image of camera c, the one in the hand being the last."""
        state, streams, background, health, seen, changes, short = known
        arm_now = arm_capsules(arm, q)
        camera = jax.tree.map(lambda a: a[jnp.minimum(c, count - 1)], rig.cameras)
        if rig.hand is not None:
            mounted = hand_camera(rig.hand, *tool_frame(arm, q))
            camera = jax.tree.map(lambda a, b: jnp.where(c < count, a, b), camera, mounted)
        robot = render_capsules(camera, arm_now, jnp.full((camera.height, camera.width), jnp.inf, dtype))
        depth = measure(jnp.minimum(render_scene(camera, scene), robot), camera, key, params.noise)
        stream = jax.tree.map(lambda a: a[c], streams)
        state, stream, report, _ = take_frame(
            layout, params.frame, state, stream, stamp, camera, depth, arm_now, box, tile
        )
        streams = jax.tree.map(lambda a, b: a.at[c].set(b), streams, stream)
        own = jax.tree.map(lambda a: a[c], background)
        one_health = jax.tree.map(lambda a: a[c], health)
        one_health, bad = judge_image(params.health, one_health, depth, stamp, stamp + params.delay, True)
        learnt = learn_background(params.presence, own, depth, robot)
        own = jax.tree.map(lambda new, old: jnp.where(bad == 0, new, old), learnt, own)
        background = jax.tree.map(lambda a, b: a.at[c].set(b), background, own)
        health = jax.tree.map(lambda a, b: a.at[c].set(b), health, one_health)
        # the robot is not free space behind: only what lies before it
        free = unpack_columns(voxels, seen_free(voxels, params.presence, sight_of(voxels, camera), depth))
        changes = changes + (report.new + report.removed).astype(dtype)
        short = short | (report.lost > 0) | (report.unseen > 0) | (report.left_out > 0)
        return state, streams, background, health, seen | free, changes, short

    def one_round(known: tuple) -> tuple:
        k, still, key, rest = known
        key, *keys = jax.random.split(key, places + 1)
        q = postures[jnp.minimum(k, looks - 1)]
        rest = (*rest[:5], jnp.zeros((), dtype), rest[6])

        def one(rest: tuple, item: tuple[Array, PRNGKeyArray]) -> tuple[tuple, None]:
            c, key = item
            return image(rest, c, q, ROUND * k.astype(dtype) + 0.01 * c.astype(dtype), key), None

        rest, _ = jax.lax.scan(one, rest, (jnp.arange(places, dtype=jnp.int32), jnp.stack(keys)))
        quiet = (k >= looks - 1) & (rest[5] <= params.settled)
        return k + 1, jnp.where(quiet, still + 1, 0), key, rest

    def unsettled(known: tuple) -> Bool[Array, ""]:
        return (known[0] < MOST_ROUNDS) & (known[1] < STILL)

    streams = jax.tree.map(lambda a: jnp.broadcast_to(a, (places, *a.shape)), initial_stream(dtype))
    background = initial_background(places, first.height, first.width, dtype)
    nothing = jnp.zeros((voxels.count,), bool)
    health = jax.tree.map(
        lambda a: jnp.broadcast_to(a, (places, *a.shape)), initial_health(first.height, first.width, dtype)
    )
    rest = (empty_map(layout, dtype), streams, background, health, nothing, jnp.zeros((), dtype), jnp.asarray(False))
    zero = jnp.zeros((), jnp.int32)
    rounds, still, _, rest = jax.lax.while_loop(unsettled, one_round, (zero, zero, key, rest))
    state, _, background, health, seen, _, short = rest
    state = settle(layout, params.frame.map, state)

    settled = settled_depth(Background(*(a[:count] for a in jax.tree.leaves(background))))
    empty = survey_empty(voxels, params.presence, settled, sights)
    blind = jnp.any(jnp.mean(settled > 0, axis=(1, 2), dtype=dtype) < LEAST_KNOWN)
    rows = state.levels[0].rows
    at = voxel_of(voxels, jnp.moveaxis(rows[:, :3], 1, 2).reshape(-1, 3))
    at = jnp.where(rows[:, 3].reshape(-1) > 0, at, voxels.count)
    known = seen | unpack_columns(voxels, empty.watched) | nothing.at[at].set(True, mode="drop")
    health = jax.tree.map(lambda a: a[:count], health)
    # stamps of the set-up are of another clock than those of the task
    never = jnp.full((count,), -jnp.inf, dtype)
    health = eqx.tree_at(lambda h: (h.stamp, h.arrived), health, (never, never))
    return Survey(state, empty, health, ~known & inside_box(voxels, box), rounds, still >= STILL, short | blind)
