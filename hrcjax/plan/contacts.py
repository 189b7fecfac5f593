"""Where an arm is near to something, over many configurations: gaps, and how the joints change them.

Configurations are the last axis of every array. A gap changes with joint j by n . (z_j x (x - o_j)) = z_j . (x x n) + (o_j x z_j)
. n, x the point, n the direction in which the gap opens: the wrench (n, x x n) times the axis of the joint as a line.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from hrcjax.numerics import computed
from hrcjax.plan.link_model import LinkModel
from hrcjax.plan.rounded_boxes import RoundedBoxes, least_distance, nearest_obstacles
from hrcjax.typing import Array, Float

SURFACES = 2
"""Obstacles that each sphere sees at once, the nearest ones: in a corner one alone would push it into the next."""


class Frames(NamedTuple):
    """Where the joints' frames are: those that turn with their links."""

    R: Float[Array, "joint 3 3 sample"]
    p: Float[Array, "joint 3 sample"]


class Contacts(NamedTuple):
    """Gaps of an arm."""

    gap: Float[Array, "contact sample"]
    """What is free between surfaces [m]."""
    slope: Float[Array, "contact joint sample"]
    """Its derivative by the joints [m/rad]."""


def frames_along(model: LinkModel, q: Float[Array, "sample joint"]) -> Frames:
    """The joints' frames in some configurations.

    With whole matrices, where `link_frames` writes out their entries: a compiler takes a tenth of the time for them.
    """
    chain, dtype = model.arm.chain, q.dtype
    cos, sin = jnp.cos(q.T)[:, None], jnp.sin(q.T)[:, None]
    x, y, z = (jnp.asarray(chain.rotation[:, :, k, None], dtype) for k in range(3))
    turned = computed(
        jnp.stack(
            [cos * x + sin * y, cos * y - sin * x, jnp.broadcast_to(z, (*cos.shape[:1], 3, cos.shape[2]))], axis=2
        )
    )
    pos = jnp.asarray(chain.pos, dtype)
    R, p = [turned[0]], [jnp.broadcast_to(pos[0, :, None], (3, q.shape[0]))]
    for i in range(1, chain.size):
        before = R[-1]
        p.append(jnp.asarray(p[-1] + sum(before[:, k] * pos[i, k] for k in range(3))))
        R.append(computed(jnp.asarray(sum(before[:, k, None] * turned[i, None, k] for k in range(3)))))
    return Frames(*computed((jnp.stack(R), jnp.stack(p))))


def _placed(model: LinkModel, frames: Frames, link: int, at: np.ndarray) -> Float[Array, "3 point sample"]:
    """Points of a link in the world, from its own frame."""
    dtype, samples = frames.p.dtype, frames.p.shape[-1]
    if link < 0:
        return jnp.broadcast_to(jnp.asarray(at.T[:, :, None], dtype), (3, len(at), samples))
    chain = model.arm.chain
    there = jnp.asarray(chain.link_pos[link] + at @ chain.link_rotation[link].T, dtype)
    R, p = frames.R[link], frames.p[link]
    return p[:, None] + sum(R[:, m, None] * there[:, m, None] for m in range(3))


def sphere_centers(model: LinkModel, frames: Frames) -> list[Float[Array, "sphere sample"]]:
    """The three coordinates of the spheres' centres [m]."""
    x = computed(jnp.concatenate([_placed(model, frames, link, at) for link, at, _ in model.spheres], axis=1))
    return list(x)


def _lines(frames: Frames) -> tuple[list[Array], list[Array]]:
    """The joints' axes, and their moments o x z, by coordinates (joint sample)."""
    z, o = ([x[:, k] for k in range(3)] for x in (frames.R[:, :, 2], frames.p))
    return z, _cross(o, z)


def _cross(a: list[Array], b: list[Array]) -> list[Array]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a: list[Array], b: list[Array]) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def obstacle_gaps(
    model: LinkModel, frames: Frames, solids: RoundedBoxes, count: int = SURFACES
) -> tuple[Float[Array, "contact sample"], list[Array], list[Array], np.ndarray]:
    """Gaps between spheres and what is nearest to them, the floor among it; normals, places, and links."""
    x = sphere_centers(model, frames)
    radii = jnp.asarray(model.radii, x[0].dtype)
    found = nearest_obstacles(solids, x, count)
    gaps, samples = (found.distance - radii[:, None]).reshape(-1, x[0].shape[1]), x[0].shape[1]
    normals = [n.reshape(-1, samples) for n in found.normal]
    places = [jnp.concatenate([c] * count) for c in x]
    links = np.tile(model.sphere_links, count)
    if model.floor is not None:
        begin = model.above_floor
        over = x[2][begin:] - radii[begin:, None] - jnp.asarray(model.floor, x[0].dtype)
        flat = jnp.zeros_like(over)
        gaps = jnp.concatenate([gaps, over])
        normals = [jnp.concatenate([n, up]) for n, up in zip(normals, (flat, flat, flat + 1), strict=True)]
        places = [jnp.concatenate([p, c[begin:]]) for p, c in zip(places, x, strict=True)]
        links = np.concatenate([links, model.sphere_links[begin:]])
    return gaps, normals, places, links


def least_gaps(
    model: LinkModel, q: Float[Array, "sample joint"], solids: RoundedBoxes
) -> tuple[Float[Array, "place sample"], Float[Array, "pair sample"]]:
    """Gaps without slopes: of every sphere from the nearest obstacle, then of those above the floor from it; and of pairs."""
    frames = frames_along(model, q)
    x = sphere_centers(model, frames)
    radii = jnp.asarray(model.radii, x[0].dtype)[:, None]
    gaps = least_distance(solids, x) - radii
    if model.floor is not None:
        begin = model.above_floor
        gaps = jnp.concatenate([gaps, x[2][begin:] - radii[begin:] - jnp.asarray(model.floor, x[0].dtype)])
    return gaps, pair_gaps(model, frames)[0]


def pair_gaps(model: LinkModel, frames: Frames) -> tuple[Float[Array, "pair sample"], list[Array], list[Array]]:
    """Gaps between pairs of capsules, the direction from the first to the second, and the nearest point of the second's
    axis; of an arm of many spheres only the nearest pair of every two links."""
    arm = model.arm
    if not model.pairs:
        nothing = jnp.zeros((0, frames.p.shape[-1]), frames.p.dtype)
        return nothing, [nothing] * 3, [nothing] * 3
    placed = [
        _placed(model, frames, link, np.stack([arm.capsule_a[k], arm.capsule_b[k]]))
        for k, link in enumerate(arm.capsule_links)
    ]
    first, second = (list(side) for side in zip(*model.pairs, strict=True))
    ends = [jnp.stack([placed[k][:, side] for k in which], axis=1) for which in (first, second) for side in range(2)]
    a, b, c, d = computed(ends)
    u, v, w = (list(y - x) for x, y in ((a, b), (c, d), (c, a)))
    s, t = _nearest_places(u, v, w)
    apart = [t * v[k] - w[k] - s * u[k] for k in range(3)]
    length = jnp.sqrt(_dot(apart, apart) + 1e-12)
    radii = jnp.asarray(arm.capsule_radii[first] + arm.capsule_radii[second], length.dtype)
    found = [length - radii[:, None], *[e / length for e in apart], *[c[k] + t * v[k] for k in range(3)]]
    if model.pair_rows is not None:
        every, picked = jnp.stack(computed(found)), []
        for rows in model.pair_rows:
            mine = every[:, rows]
            picked.append(jnp.take_along_axis(mine, jnp.argmin(mine[0], axis=0)[None, None], axis=1)[:, 0])
        found = list(jnp.stack(picked, axis=1))
    return found[0], found[1:4], found[4:]


def _nearest_places(u: list[Array], v: list[Array], w: list[Array]) -> tuple[Array, Array]:
    """Where two segments are nearest: shares s of u and t of v, w from the second's begin to the first's.

    The minimum of a convex quadratic over the unit square: the free one clipped in s, then t best for that s and clipped, then s
    best for that t and clipped (Ericson, Real-Time Collision Detection, 2005, section 5.1.9).
    """
    uu, uv, vv, uw, vw = _dot(u, u), _dot(u, v), _dot(v, v), _dot(u, w), _dot(v, w)
    determinant = uu * vv - uv * uv
    crossing = determinant > 1e-6 * uu * vv
    s = jnp.where(crossing, jnp.clip((uv * vw - vv * uw) / jnp.where(crossing, determinant, 1), 0, 1), 0.5)
    t = jnp.clip((uv * s + vw) / jnp.maximum(vv, 1e-12), 0, 1)
    s = jnp.clip((uv * t - uw) / jnp.maximum(uu, 1e-12), 0, 1)
    return s, t


def contacts(model: LinkModel, q: Float[Array, "sample joint"], solids: RoundedBoxes) -> tuple[Contacts, Contacts]:
    """The arm's gaps to obstacles and floor, and those between its own links, in some configurations."""
    frames = frames_along(model, q)
    z, moment = computed(_lines(frames))
    joints = np.arange(model.arm.chain.size)

    def slope(normal: list[Array], place: list[Array], moved: np.ndarray) -> Array:
        turning = computed(_cross(place, normal))
        by_joint = [sum(z[k][None] * turning[k][:, None] + moment[k][None] * normal[k][:, None] for k in range(3))][0]
        return jnp.where(jnp.asarray(moved)[..., None], by_joint, 0)

    gap, normal, place, links = obstacle_gaps(model, frames, solids)
    near = Contacts(*computed((gap, slope(normal, place, joints <= links[:, None]))))
    gap, normal, place = pair_gaps(model, frames)
    before, behind = model.pair_links.T
    between = (joints > before[:, None]) & (joints <= behind[:, None])
    return near, Contacts(*computed((gap, slope(normal, place, between))))
