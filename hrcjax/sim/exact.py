"""Exact distances of the arm to the person and to obstacles over an episode, for its outcome."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.segment import FAR, capsule_distance
from hrcjax.robot import arm_capsules
from hrcjax.sim.cell import Cell
from hrcjax.sim.closest import Sampled, closest, travelled
from hrcjax.typing import Array, Bool, Float, Joints
from hrcjax.world import Scene, capsules_obstacle_distances

BLOCK = 16
"""Ticks whose distances are computed together: in one vmap over all, the compiler computes them anew for each of their uses."""


def person_distances(arm: Capsules, person: Capsules) -> Float[Array, "capsule other"]:
    """Exact distances of every capsule of the arm to every one of the person [m]; FAR where nobody is."""
    between = jax.vmap(jax.vmap(capsule_distance, (None, None, None, 0, 0, 0)), (0, 0, 0, None, None, None))
    distances = between(arm.a, arm.b, arm.radius, person.a, person.b, person.radius)
    return jnp.where(person.radius[None, :] < 0, FAR, distances)


def separation_and_approach(
    cell: Cell, q: Joints, qd: Joints, person: Capsules, distances: Float[Array, "capsule other"]
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """The least distance to the person [m], FAR if nobody is there; the arm's own part in its decrease, which is the speed of
    its nearest point towards the person, who is held [m/s], 0 if nobody is there.

    Args:
        distances: of every pair of capsules, to find the nearest; no derivative passes through them [m].
    """
    i, j = jnp.unravel_index(jnp.argmin(distances), distances.shape)

    def nearest(q: Joints) -> Array:
        arm = arm_capsules(cell.arm, q)
        return capsule_distance(arm.a[i], arm.b[i], arm.radius[i], person.a[j], person.b[j], person.radius[j])

    separation, opening = jax.jvp(nearest, (q,), (qd,))
    nobody = person.radius[j] < 0
    return jnp.where(nobody, FAR, separation), jnp.where(nobody, 0.0, -opening)


def moving_links(cell: Cell, arm: Capsules) -> Capsules:
    """The arm without its base, which comes first and never moves; at every tick."""
    fixed = sum(link < 0 for link in cell.arm.capsule_links)
    return Capsules(*(x[:, fixed:] for x in (arm.a, arm.b, arm.radius)))


def sampled_person_distances(arm: Capsules, person: Capsules) -> Float[Array, "sample capsule other"]:
    """The distances at every tick of both."""
    return jax.lax.map(lambda both: person_distances(*both), (arm, person), batch_size=BLOCK)


def sampled_obstacle_distances(scene: Scene, links: Capsules) -> Float[Array, "sample capsule obstacle"]:
    """Exact distances of every link to every obstacle at every tick of the links [m]; FAR where there is none."""
    return jax.lax.map(lambda some: capsules_obstacle_distances(scene, some), links, batch_size=BLOCK)


def thinned(shape: Capsules, stride: int) -> Capsules:
    """Every `stride`-th tick of a shape."""
    return jax.tree.map(lambda a: a[::stride], shape)


def least_separations(
    arm: Capsules,
    person: Capsules,
    distances: Float[Array, "sample capsule other"],
    stride: int,
    counts: Bool[Array, "time"],
    moving: Bool[Array, "time"],
) -> tuple[Float[Array, ""], Bool[Array, ""], Bool[Array, ""]]:
    """The least distance of arm and person at the ticks that count [m]; whether they touched while the arm moved, and while
    it stood.

    Args:
        arm, person: at every tick.
        distances: of every pair of their capsules at every `stride`-th tick [m].
    """  # fmt: skip
    there = jnp.any(person.radius >= 0, axis=1)
    comes = jnp.pad(there[1:] != there[:-1], (0, -there.shape[0] % stride + 1)).reshape(-1, stride)
    jump = jnp.where(jnp.any(comes, axis=1), 4 * FAR, jnp.zeros((), distances.dtype))  # who comes or goes is anywhere
    way = travelled(arm, stride)[:, :, None] + travelled(person, stride)[:, None, :] + jump[:, None, None]
    sampled = Sampled(distances.reshape(distances.shape[0], -1), way.reshape(way.shape[0], -1))
    fixed = pair_distance(*jax.lax.stop_gradient((arm, person)))  # whether they touch has no derivative
    while_moving, while_standing = (closest(fixed, sampled, counts & some, stride, 0.0) for some in (moving, ~moving))
    return closest(pair_distance(arm, person), sampled, counts, stride), while_moving < 0, while_standing < 0


def pair_distance(arm: Capsules, person: Capsules) -> Callable[[Array, Array], Array]:
    """The distance of a pair of capsules at a tick, pairs counted person by person for each of the arm [m]."""
    count = person.a.shape[1]

    def at(tick: Array, pair: Array) -> Array:
        i, j = pair // count, pair % count
        apart = capsule_distance(
            arm.a[tick, i], arm.b[tick, i], arm.radius[tick, i], person.a[tick, j], person.b[tick, j], person.radius[tick, j]
        )  # fmt: skip
        return jnp.where(person.radius[tick, j] < 0, FAR, apart)

    return at


def least_clearance(
    scene: Scene,
    links: Capsules,
    distances: Float[Array, "sample capsule obstacle"],
    stride: int,
    counts: Bool[Array, "time"],
) -> Float[Array, ""]:
    """The least distance of the moving links to obstacles at the ticks that count [m].

    Args:
        links: at every tick.
        distances: of every link to every obstacle at every `stride`-th tick [m].
    """  # fmt: skip
    way = jnp.broadcast_to(travelled(links, stride)[:, :, None], distances.shape)
    count = distances.shape[2]
    sampled = Sampled(distances.reshape(distances.shape[0], -1), way.reshape(way.shape[0], -1))

    def at(tick: Array, pair: Array) -> Array:
        i, j = pair // count, pair % count
        link = Capsules(links.a[tick, i][None], links.b[tick, i][None], links.radius[tick, i][None])
        solid = jax.tree.map(lambda a: a[j][None], (scene.kind, scene.center, scene.size, scene.yaw, scene.mask))
        one = eqx.tree_at(lambda s: (s.kind, s.center, s.size, s.yaw, s.mask), scene, solid)
        return capsules_obstacle_distances(one, link)[0, 0]

    return closest(at, sampled, counts, stride)
