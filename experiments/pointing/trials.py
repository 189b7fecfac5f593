"""Trials: people, what they point at, and where that is by the exact shapes."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.sphere_trace import sphere_trace
from hrcjax.sense.camera import Camera, in_image
from hrcjax.typing import Array
from hrcjax.world import Scene, scene_distance
from hrcjax.world.place import path_middle

from .hand import FINGER, INDEX, SHAPE, TIP, Hand, frame_of, hand_at
from .people import ARM_RADII, NEAREST, REACH, Stand, elbows, people, shoulders
from .posture import BEND, bends, room_beside_oneself

KINDS = {
    "tip": "the finger touches the table or an obstacle: the place beside its tip",
    "finger": "the line along the index finger, to a surface 0.3 to 1.2 m from its tip",
    "fresh": "the same fingers, with errors of the landmarks that are new in every image",
    "arm": "the line from shoulder to wrist of a straight arm, to a surface 0.3 to 1.2 m from the wrist",
    "away": "a finger that points at nothing",
    "through": "a hand that passes, pointing, at 0.1 to 0.6 m/s",
    "wide": "the same fingers, in images in which what is near is wider by a pixel to each side",
    "thick": "the same hands, fingers and all, 20 % thicker than the method is told",
    "thin": "the same hands 20 % thinner than it is told",
    "noisy": "the same fingers, with errors of landmarks and depths 1.5 times as large as it is told",
}
"""Kinds of trials."""
AGAIN = ("fresh", "wide", "thick", "thin", "noisy")
"""Kinds with the trials of `finger`."""
THICKNESS = {"thick": 1.2, "thin": 0.8}
"""Kind -> factor of the radii of the hand's capsules."""
WAYS = (0.3, 0.6, 0.9, 1.2)
"""Limits of the ways to a place, each third of which as many trials have [m]."""
SPEEDS = (0.1, 0.6)
"""Of a hand that passes [m/s]."""
SLOPE = 0.25
"""The least cosine of the angle between a line and the normal where it meets a surface: nobody points along a table [1]."""
BASE = 0.2
"""Places nearer to the base's axis than this are the robot's own [m]."""
SEEN = 0.03
"""A place was seen in the set-up if a point of the map is so near [m]."""
IN_SIGHT = 0.01
"""And if the line from a camera to it meets a surface so near to it [m]."""
FAR = 4.0
"""How far the exact shapes are looked for along a line [m]."""
TOUCH = 0.002
"""Gap between a finger that touches and the surface [m]."""
BATCH = 512
"""Candidates that are drawn at once."""
MOST_BATCHES = 40
MARGIN = 12.0
"""Landmarks are at least so far inside the images [px]."""


class Trials(NamedTuple):
    """Some trials of one kind; every array has a row for each."""

    capsules: Capsules
    line: NDArray
    """(trial landmark 3) the landmarks of the line, from base to tip [m]."""
    wrist: NDArray
    """(trial 3) [m]."""
    shoulder: NDArray
    """(trial 3) of the arm that points [m]."""
    hand: NDArray
    """(trial 21 3) landmarks of the hand [m]."""
    direction: NDArray
    """(trial 3) of the line [1]."""
    place: NDArray
    """(trial 3) what is pointed at; no number: nothing [m]."""
    way: NDArray
    """(trial) from the tip to the place [m]."""
    velocity: NDArray
    """(trial 3) of a hand that passes [m/s]."""
    size: NDArray
    """(trial) factor of the hand's lengths [1]."""


@jax.jit
def exact_hits(scene: Scene, origin: Array, direction: Array) -> tuple[Array, Array, Array]:
    """Where lines meet the exact shapes [m], the normals there, and whether they do."""

    def distance(x: Array) -> Array:
        return scene_distance(scene, x)

    def one(origin: Array, direction: Array) -> tuple[Array, Array, Array]:
        hit = sphere_trace(distance, origin, direction, FAR, 1e-4, 160)
        return hit.point, jax.grad(distance)(hit.point), hit.found

    return jax.vmap(one)(origin, direction)


@jax.jit
def _distances(scene: Scene, x: Array) -> Array:
    return jax.vmap(jax.vmap(lambda one: scene_distance(scene, one)))(x)


def unit(v: NDArray) -> NDArray:
    """Of length 1 along the last axis."""
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def _turned(u: NDArray, deviation: float, random: np.random.Generator) -> NDArray:
    """Directions turned by about `deviation` [rad]."""
    return unit(u + deviation * random.normal(size=u.shape))


def aims(scene: Scene, random: np.random.Generator, count: int) -> NDArray:
    """(count 3) Where people mean to point: half of them at obstacles, the others at the table [m]."""
    lower, upper = np.asarray(scene.table_lower, float), np.asarray(scene.table_upper, float)
    middle = np.asarray(path_middle(scene), float)
    x = random.uniform(max(lower[0], middle[0] - 0.8), min(upper[0], middle[0] + 0.8), count)
    y = random.uniform(lower[1] + 0.05, upper[1] - 0.04, count)
    found = np.stack([x, y, np.zeros(count)], axis=-1)
    solids = np.flatnonzero(np.asarray(scene.mask))
    if len(solids):
        chosen = random.choice(solids, count)
        center, size = np.asarray(scene.center, float)[chosen], np.asarray(scene.size, float)[chosen]
        at = center + 0.8 * size * random.uniform(-1, 1, (count, 3))
        found = np.where(random.uniform(size=(count, 1)) < 0.5, at, found)
    return found


class _Drawn(NamedTuple):
    """Candidates."""

    stand: Stand
    shoulder: NDArray
    hand: Hand
    u: NDArray
    size: NDArray
    straight: bool


def _stands(scene: Scene, random: np.random.Generator, count: int, back: float, lean: float) -> Stand:
    x = np.asarray(path_middle(scene), float)[0] + random.uniform(-0.5, 0.5, count)
    y = float(scene.table_upper[1]) + 0.2 + back * random.uniform(size=count)
    return Stand(np.stack([x, y], axis=-1), lean * random.uniform(size=count), random.choice([-1.0, 1.0], count))


def _hands(tip: NDArray, u: NDArray, size: NDArray, side: NDArray, random: np.random.Generator) -> Hand:
    return hand_at(tip, frame_of(u, 0.4 * random.normal(size=len(u))), size, side)


def _draw_tip(scene: Scene, random: np.random.Generator, count: int) -> _Drawn:
    """Fingers that touch what the shoulder sees."""
    stand, size = _stands(scene, random, count, 0.0, 0.7), random.uniform(0.9, 1.1, count)
    shoulder = shoulders(stand)
    towards = unit(aims(scene, random, count) - shoulder)
    place, normal, found = (np.asarray(x, float) for x in exact_hits(scene, *_floats(shoulder, towards)))
    u = _turned(unit(place - shoulder), 0.25, random)
    tip = place + normal * (FINGER * size + TOUCH)[:, None]
    tip[found == 0] = np.nan
    return _Drawn(stand, shoulder, _hands(tip, u, size, stand.side, random), u, size, False)


def _draw_finger(scene: Scene, random: np.random.Generator, count: int) -> _Drawn:
    """Fingers some way from what they point at, about on the line from the shoulder to it."""
    stand, size = _stands(scene, random, count, 0.5, 0.4), random.uniform(0.9, 1.1, count)
    shoulder, aim = shoulders(stand), aims(scene, random, count)
    away = _turned(unit(shoulder - aim), 0.15, random)
    tip = aim + random.uniform(WAYS[0], WAYS[-1], count)[:, None] * away
    return _Drawn(stand, shoulder, _hands(tip, -away, size, stand.side, random), -away, size, False)


def _draw_arm(scene: Scene, random: np.random.Generator, count: int) -> _Drawn:
    """Straight arms."""
    stand, size = _stands(scene, random, count, 0.5, 0.4), random.uniform(0.9, 1.1, count)
    shoulder = shoulders(stand)
    u = unit(aims(scene, random, count) - shoulder)
    R = frame_of(u, 0.4 * random.normal(size=count))
    offset = SHAPE[TIP] * size[:, None] * np.stack([np.ones(count), stand.side, np.ones(count)], axis=-1)
    wrist = shoulder + 0.98 * REACH * u
    hand = hand_at(wrist + np.einsum("kij,kj->ki", R, offset), R, size, stand.side)
    return _Drawn(stand, shoulder, hand, u, size, True)


def _draw_away(scene: Scene, random: np.random.Generator, count: int) -> _Drawn:
    """Fingers that point over everything."""
    stand, size = _stands(scene, random, count, 0.3, 0.4), random.uniform(0.9, 1.1, count)
    shoulder = shoulders(stand)
    u = unit(np.stack([random.uniform(-0.7, 0.7, count), -np.ones(count), random.uniform(0.2, 0.6, count)], axis=-1))
    tip = shoulder + random.uniform(0.5, 0.7, (count, 1)) * _turned(u, 0.1, random)
    return _Drawn(stand, shoulder, _hands(tip, u, size, stand.side, random), u, size, False)


DRAWS: dict[str, Callable[[Scene, np.random.Generator, int], _Drawn]] = {
    "tip": _draw_tip, "finger": _draw_finger, "arm": _draw_arm, "away": _draw_away, "through": _draw_finger,
    **dict.fromkeys(AGAIN, _draw_finger),
}  # fmt: skip


def _floats(*arrays: NDArray) -> tuple[Array, ...]:
    return tuple(jnp.asarray(np.nan_to_num(a, nan=9.0), jnp.float32) for a in arrays)


def in_images(cameras: Camera, x: NDArray) -> NDArray:
    """(trial) Whether all landmarks (trial landmark 3) are in all images."""
    u, depth = (np.asarray(a) for a in jax.vmap(in_image, in_axes=(0, None))(cameras, jnp.asarray(x, jnp.float32)))
    size = np.array([cameras.width, cameras.height]) - 1 - MARGIN
    return np.all((u > MARGIN) & (u < size), axis=(0, 2, 3)) & np.all(depth > 0.4, axis=(0, 2))


def in_sight(scene: Scene, cameras: Camera, place: NDArray, normal: NDArray) -> NDArray:
    """(place) Whether a camera sees a place, by the exact shapes: it lies on a side that faces it, and nothing is in between."""
    seen = np.zeros(len(place), bool)
    for eye in np.asarray(cameras.position, float):
        u = unit(place - eye)
        at, _, found = (np.asarray(x, float) for x in exact_hits(scene, *_floats(np.broadcast_to(eye, u.shape), u)))
        near = np.linalg.norm(at - place, axis=1) < IN_SIGHT
        seen |= (found > 0) & near & (np.sum(normal * u, axis=1) < -SLOPE)
    return seen


def _possible(drawn: _Drawn, elbow: NDArray) -> NDArray:
    """Which candidates a person could do, with fingers of any `THICKNESS`."""
    hand = drawn.hand._replace(radius=drawn.hand.radius * max(THICKNESS.values()))
    parts = jax.tree.map(lambda a: np.nan_to_num(a, nan=9.0), (drawn.stand, drawn.shoulder, elbow, hand, drawn.size))
    room = room_beside_oneself(people(*parts), drawn.stand.side)
    return (room > 0) & (bends(elbow, drawn.hand.landmarks) <= BEND)


def _accepted(kind: str, scene: Scene, cameras: Camera, tree: KDTree, drawn: _Drawn) -> tuple[NDArray, NDArray, NDArray]:  # fmt: skip
    """Which candidates will do, with the places and the ways to them."""
    marks = drawn.hand.landmarks
    wrist, tip = marks[:, 0], marks[:, TIP]
    origin = wrist if kind == "arm" else tip
    place, normal, found = (np.asarray(x, float) for x in exact_hits(scene, *_floats(origin, drawn.u)))
    if kind == "tip":  # beside the tip, along the gradient there
        d = np.asarray(_distances(scene, *_floats(tip[:, None])), float)[:, 0]
        normal = np.asarray(_gradients(scene, *_floats(tip)), float)
        place, found = tip - d[:, None] * normal, np.isfinite(tip).all(axis=1)
    way = np.linalg.norm(place - origin, axis=1)
    room = np.asarray(_distances(scene, *_floats(marks)), float) - FINGER * drawn.size[:, None]
    free = room.min(axis=1) > 0
    length = np.linalg.norm(wrist - drawn.shoulder, axis=1)
    good = free & (length >= NEAREST) & (length <= REACH) & np.isfinite(tip).all(axis=1)
    line = np.stack([drawn.shoulder, wrist], axis=1) if kind == "arm" else marks[:, [0, *INDEX]]
    good &= in_images(cameras, np.nan_to_num(line, nan=9.0))
    elbow = elbows(drawn.shoulder, wrist, drawn.stand.side)
    lift = np.asarray(_distances(scene, *_floats(elbow[:, None])), float)[:, 0]
    good &= lift > ARM_RADII["forearm"] * drawn.size
    good &= _possible(drawn, elbow)
    if kind == "away":
        return good & (found == 0), np.full_like(place, np.nan), np.full(len(good), np.nan)
    lower, upper = np.asarray(scene.table_lower, float), np.asarray(scene.table_upper, float)
    good &= (found > 0) & (place[:, 2] > -1e-3) & np.all((place[:, :2] > lower) & (place[:, :2] < upper), axis=1)
    good &= np.linalg.norm(place[:, :2], axis=1) > BASE
    good &= tree.query(np.nan_to_num(place, nan=9.0))[0] < SEEN
    good &= np.sum(normal * drawn.u, axis=1) < -SLOPE
    good &= in_sight(scene, cameras, place, normal)
    if kind != "tip":
        good &= (way >= WAYS[0]) & (way <= WAYS[-1])
    return good, place, way


@jax.jit
def _gradients(scene: Scene, x: Array) -> Array:
    return jax.vmap(jax.grad(lambda one: scene_distance(scene, one)))(x)


def number_of(kind: str) -> int:
    """The number of a kind, for random draws; those of `AGAIN` are that of `finger`."""
    return list(KINDS).index("finger" if kind in AGAIN else kind)


def draw_trials(kind: str, scene: Scene, cameras: Camera, points: NDArray, count: int, seed: int) -> Trials:
    """Trials of a kind, the same for the same seed; ways to the place evenly in the thirds of `WAYS`.

    Args:
        cameras: the stationary ones, at full resolution.
        points: (point 3) of the map [m].

    Raises:
        RuntimeError: too few candidates will do.
    """
    random, tree = np.random.default_rng([seed, number_of(kind)]), KDTree(points)
    bins = len(WAYS) - 1 if kind in ("finger", *AGAIN, "arm") else 1
    quota = [count // bins + (k < count % bins) for k in range(bins)]
    kept: list[tuple[_Drawn, NDArray, NDArray, NDArray]] = []
    for _ in range(MOST_BATCHES):
        drawn = DRAWS[kind](scene, random, BATCH)
        good, place, way = _accepted(kind, scene, cameras, tree, drawn)
        at = np.digitize(way, WAYS[1:-1]) if bins > 1 else np.zeros(BATCH, int)
        chosen = [np.flatnonzero(good & (at == k))[: quota[k]] for k in range(bins)]
        quota = [left - len(some) for left, some in zip(quota, chosen, strict=True)]
        kept.append((drawn, np.concatenate(chosen), place, way))
        if not any(quota):
            return _joined(kind, kept, random)
    raise RuntimeError(f"{kind}: {sum(quota)} of {count} trials could not be drawn")


def _joined(kind: str, kept: list[tuple[_Drawn, NDArray, NDArray, NDArray]], random: np.random.Generator) -> Trials:
    def pick(of: Callable[[_Drawn], NDArray]) -> NDArray:
        return np.concatenate([of(drawn)[rows] for drawn, rows, _, _ in kept])

    stand = Stand(*(pick(lambda d, k=k: d.stand[k]) for k in range(3)))
    hand = Hand(*(pick(lambda d, k=k: d.hand[k]) for k in range(4)))
    hand = hand._replace(radius=hand.radius * THICKNESS.get(kind, 1.0))
    shoulder, u, size = pick(lambda d: d.shoulder), pick(lambda d: d.u), pick(lambda d: d.size)
    wrist = hand.landmarks[:, 0]
    body = people(stand, shoulder, elbows(shoulder, wrist, stand.side), hand, size)
    line = np.stack([shoulder, wrist], axis=1) if kind == "arm" else hand.landmarks[:, INDEX]
    velocity = np.zeros_like(u)
    if kind == "through":
        turn, speed = random.uniform(0, 2 * np.pi, len(u)), random.uniform(*SPEEDS, len(u))
        velocity = speed[:, None] * np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=-1)
    places, ways = (np.concatenate([entry[k][entry[1]] for entry in kept]) for k in (2, 3))
    return Trials(body, line, wrist, shoulder, hand.landmarks, u, places, ways, velocity, size)
