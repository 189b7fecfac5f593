"""First guesses of a body from its points alone: the head on top, the trunk below it or behind, arms to what lies farthest out."""

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.body.priors import REST
from hrcjax.body.skeleton import LEFT, LENGTHS, RADIUS_NAMES, RIGHT
from hrcjax.geom.cloud import Cloud
from hrcjax.geom.segment import point_segment_distance
from hrcjax.numerics import safe_norm, safe_sqrt, unit
from hrcjax.typing import Array, Float, Int, Mask, Scalar, Vector3
from hrcjax.world.scene import FLOOR_Z

HEAD_DEPTH = 0.2
"""Points this far under the highest are the head's [m]."""
LOW_PART = 0.35
"""Points lower than this over the table are looked at for the hip [m]."""
OUTSIDE = 0.06
"""Points this far from the trunk's surface are an arm's [m]."""
KINDS = (
    (0.0, 0, 0.0), (0.5, 0, 0.0), (1.0, 0, 0.0), (1.5, 0, 0.0), (0.0, 1, 0.0), (0.5, 1, 0.0), (1.0, 1, 0.0), (1.5, 1, 0.0),
    (0.0, 1, 0.5), (0.0, 1, 0.9), (0.0, 1, 1.3), (0.5, 1, 0.9), (1.5, 1, 0.9),
)  # fmt: skip
"""Bodies that are tried, each with hanging and with reaching arms: where they face, in half turns from the robot's base; hip below the
head (0) or behind the low points (1); how far they lean, 0: the head is on top [rad]."""
EVERY = np.arange(2 * len(KINDS), dtype=np.int32)
"""All of them, hanging and reaching in turn."""
FRONT = (0, 8, 1, 2, 9, 3, 16, 17)
"""Of the guesses, those of bodies that face the robot's base or a quarter turn to one side of it, upright or leaning: which ones were found to be
the body most often, with the people of docs/body.md."""


def _mean(points: Array, weight: Array, otherwise: Array) -> Vector3:
    total = jnp.sum(weight)
    return jnp.where(total > 0, jnp.sum(points * weight[:, None], axis=0) / jnp.maximum(total, 1e-6), otherwise)


def reaching_arm(
    lengths: Float[Array, "length"], shoulder: Vector3, target: Vector3, pole: Vector3
) -> Float[Array, "4 3"]:
    """Shoulder, elbow, wrist and fingers of an arm that reaches for a target as far as it can, its elbow towards the pole [m]."""
    upper, forearm, hand = (lengths[LENGTHS.index(name)] for name in ("upper arm", "forearm", "hand"))
    lower = forearm + hand
    way = target - shoulder
    reach = jnp.clip(safe_norm(way), 0.2, 0.99 * (upper + lower))
    u = unit(way)
    aside = unit(pole - (pole @ u) * u)
    foot = (reach * reach + upper**2 - lower**2) / (2 * reach)
    elbow = shoulder + foot * u + safe_sqrt(upper**2 - foot * foot) * aside
    along = unit(shoulder + reach * u - elbow)
    return jnp.stack([shoulder, elbow, elbow + forearm * along, elbow + lower * along])


def farthest_hand(
    points: Float[Array, "point 3"],
    among: Mask,
    shoulder: Vector3,
    hip: Vector3,
    neck: Vector3,
    reach: Scalar,
    radius: Scalar,
) -> tuple[Vector3, Float[Array, ""]]:
    """Where the fingers' axis may end: at the point farthest from the trunk that the arm reaches [m]; and how many points there are.

    Args:
        among: points that count.
        reach: length of the arm [m].
        radius: of the hand [m].
    """
    off = jax.vmap(lambda p: point_segment_distance(p, hip, neck))(points)
    near = among & (safe_norm(points - shoulder) < reach + radius + 0.1)
    best = points[jnp.argmax(jnp.where(near, off, -1.0))]
    around = near & (safe_norm(points - best) < 0.08)
    middle = _mean(points, around.astype(points.dtype), best)
    return middle - 0.7 * radius * unit(middle - shoulder), jnp.sum(near, dtype=points.dtype)


def poles(forward: Vector3, left: Vector3) -> tuple[Vector3, Vector3]:
    """Where elbows point: outside, back and down."""
    down = jnp.asarray([0.0, 0.0, -0.5], forward.dtype)
    return 0.6 * left - 0.6 * forward + down, -0.6 * left - 0.6 * forward + down


def guess_bodies(
    cloud: Cloud,
    lengths: Float[Array, "length"],
    radii: Float[Array, "radius"],
    eye: Vector3 | None,
    which: Int[Array, "guess"],
) -> Float[Array, "guess joint 3"]:
    """Bodies that may be it: facing four ways, upright or leaning, arms hanging or reaching.

    Args:
        cloud: points of one image.
        eye: from where they are seen, so that the body is behind them; None: from all around [m].
        which: of them: entry of `KINDS` times two, plus one where the arms reach.
    """
    points, mask = cloud.points, cloud.mask
    dtype = points.dtype
    height = jnp.where(mask, points[:, 2], -jnp.inf)
    top = jax.lax.top_k(height, 3)[0][2]
    trunk_radius, head_radius, hand_radius = (radii[RADIUS_NAMES.index(name)] for name in ("trunk", "head", "hand"))
    middle = _mean(points, mask.astype(dtype), jnp.zeros((3,), dtype))
    away = middle - (middle if eye is None else eye)
    away = unit(away.at[2].set(0.0))
    head_points = mask & (height > top - HEAD_DEPTH)
    crown = _mean(points, head_points.astype(dtype), middle) + 0.6 * head_radius * away
    crown = crown.at[2].set(top - head_radius)
    low = mask & (height < LOW_PART)
    radial = jnp.where(low, safe_norm(points[:, :2]), -jnp.inf)
    cut = jax.lax.top_k(radial, 40)[0]
    edge = cut[jnp.clip(jnp.sum(low) // 3, 0, 39)]
    far = low & (radial >= edge)
    behind = _mean(points, far.astype(dtype), crown) + 0.5 * trunk_radius * away
    hip_height = jnp.asarray(FLOOR_Z + 0.93, dtype)
    hips = jnp.stack([crown.at[2].set(hip_height), behind.at[2].set(hip_height)])
    to_base = jnp.arctan2(-middle[1], -middle[0])

    def body(turn: Array, hip: Array, lean: Array, reaching: Array) -> Array:
        angle = to_base + jnp.pi * turn
        face = jnp.stack([jnp.cos(angle), jnp.sin(angle), jnp.zeros((), dtype)])
        ahead = jnp.sin(lean) * face + jnp.cos(lean) * jnp.asarray([0.0, 0.0, 1.0], dtype)
        head = jnp.where(lean > 0, hip + (lengths[0] + lengths[1]) * ahead, crown)
        spine = unit(head - hip)
        left = unit(jnp.cross(spine, face))
        forward = jnp.cross(left, spine)
        reach = lengths[4] + lengths[5] + lengths[6]
        neck = head - lengths[1] * unit(spine + jnp.asarray([0.0, 0.0, 0.3], dtype))
        trunk = neck - lengths[0] * unit(neck - hip)
        arms = []
        for sign, pole in zip((1.0, -1.0), poles(forward, left), strict=True):
            shoulder = neck - 0.03 * spine + 0.5 * sign * lengths[2] * left
            up = jnp.asarray([0.0, 0.0, 1.0], dtype)
            hang = shoulder + 1.2 * (REST[0] * forward + REST[1] * sign * left + REST[2] * up)
            off = jax.vmap(lambda p: point_segment_distance(p, trunk, head))(points)
            # a reaching arm may cross the middle, but not far
            own_side = (points - neck) @ left * sign > -0.05
            outside = mask & (off > trunk_radius + OUTSIDE) & own_side
            target, some = farthest_hand(points, outside, shoulder, trunk, neck, reach, hand_radius)
            arms.append(reaching_arm(lengths, shoulder, jnp.where(reaching & (some >= 3), target, hang), pole))
        joints = jnp.zeros((11, 3), dtype).at[0].set(trunk).at[1].set(neck).at[2].set(head)
        return joints.at[jnp.asarray(LEFT)].set(arms[0]).at[jnp.asarray(RIGHT)].set(arms[1])

    kinds = jnp.asarray([(*kind, reaching) for kind in KINDS for reaching in (0, 1)], dtype)[which]
    return jax.vmap(lambda k: body(k[0], hips[k[1].astype(jnp.int32)], k[2], k[3] > 0))(kinds)
