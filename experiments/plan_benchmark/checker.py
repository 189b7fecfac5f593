"""The exact collision check: capsules against obstacles, the floor and each other, at steps of 2 degrees.

Configurations whose covering spheres are free are free: a sieve that leaves few for the exact distances of capsules."""

from collections.abc import Callable, Sequence
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.geom.segment import FAR, capsule_distance
from hrcjax.geom.shape import box_distance, segment_convex_distance
from hrcjax.plan.body import self_pairs
from hrcjax.plan.contacts import frames_along, pair_gaps, sphere_centers
from hrcjax.plan.link_model import LinkModel, link_model
from hrcjax.plan.rounded_boxes import RoundedBoxes, least_distance
from hrcjax.robot import Arm, arm_capsules

from .problems import TIGHT, Problems

STEP = np.deg2rad(2.0)
"""Largest change of any joint from one checked configuration to the next [rad]."""
INFLATION = 0.004
"""Of the spheres of the sieve [m]."""
SPARSE = 6
"""Of so many configurations one is checked before the others."""
CHUNKS = (1024, 128)
"""Configurations that are checked at once: many, or the rest in few."""


def dense(path: NDArray) -> NDArray:
    """The path with steps of at most STEP, its waypoints among them."""
    count = np.maximum(np.ceil(np.abs(np.diff(path, axis=0)).max(axis=1, initial=0) / STEP), 1).astype(int)
    begin = np.repeat(np.arange(len(count)), count)
    share = (np.arange(len(begin)) - np.repeat(np.cumsum(count) - count, count)) / count[begin]
    return np.concatenate([path[begin] + share[:, None] * (path[begin + 1] - path[begin]), path[-1:]])


class Checker:
    """Tells whether configurations and paths of an arm are free."""

    def __init__(self, arm: Arm, sieve: bool = True, tight: Sequence[tuple[str, str]] = TIGHT) -> None:
        self.arm = arm
        pairs = tuple(self_pairs(arm, tight))
        self._distances = jax.jit(jax.vmap(partial(_configuration_distances, arm, pairs)))
        self._exact = jax.jit(jax.vmap(partial(_configuration_free, arm, pairs)))
        self._sieve = (
            jax.jit(partial(_surely_free, link_model(arm, INFLATION, 0.0, tight, whole=True))) if sieve else None
        )

    def warm(self, problems: Problems) -> None:
        """Compiles."""
        for f in (self._sieve, self._exact):
            if f is not None:
                for count in CHUNKS:
                    self._chunked(
                        f,
                        problems,
                        np.zeros(count, int),
                        np.resize(problems.start[0], (count, problems.start.shape[1])),
                    )

    def _chunked(self, f: Callable[..., jax.Array], problems: Problems, problem: NDArray, q: NDArray) -> NDArray:
        ok = np.zeros(len(q), bool)
        begin = 0
        while begin < len(q):
            chunk = next((c for c in CHUNKS if c <= len(q) - begin), CHUNKS[-1])
            rows = np.arange(begin, min(begin + chunk, len(q)))
            padded = np.resize(rows, chunk)
            begin += chunk
            ok[rows] = np.asarray(f(np.float32(q[padded]), problems.solids(problem[padded])))[: len(rows)]
        return ok

    def configurations_free(self, problems: Problems, problem: NDArray, q: NDArray, exact: bool = True) -> NDArray:
        """Whether each configuration is free among the obstacles of its problem, and within the joints' ranges.

        Args:
            exact: False asks the sieve alone, which takes some that are free for colliding.
        """
        ok = np.zeros(len(q), bool)
        if not len(q):
            return ok
        if self._sieve is not None:
            ok = self._chunked(self._sieve, problems, problem, q)
        if (exact or self._sieve is None) and len(left := np.flatnonzero(~ok)):
            ok[left] = self._chunked(self._exact, problems, problem[left], q[left])
        return ok & ((q >= self.arm.q_min - 1e-6) & (q <= self.arm.q_max + 1e-6)).all(1)

    def free(self, problems: Problems, which: Sequence[int] | NDArray, paths: Sequence[NDArray]) -> NDArray:
        """Whether each path is free among the obstacles of its problem, and within the joints' ranges."""
        if not len(paths):
            return np.zeros(0, bool)
        fine = [dense(path) for path in paths]
        owner = np.repeat(np.arange(len(fine)), [len(path) for path in fine])
        q, problem, ok = np.concatenate(fine), np.asarray(which)[owner], np.ones(len(fine), bool)
        sparse = (
            np.arange(len(q)) % SPARSE == 0
        )  # most paths that are not free are found out by few of their configurations
        for part in (sparse, ~sparse):
            rows = np.flatnonzero(part & ok[owner])
            ok[owner[rows[~self.configurations_free(problems, problem[rows], q[rows])]]] = False
        return ok

    def clearances(self, problems: Problems, which: Sequence[int] | NDArray, paths: Sequence[NDArray]) -> NDArray:
        """Least distance of each path from the obstacles of its problem [m]."""
        fine = [dense(path) for path in paths]
        owner = np.repeat(np.arange(len(fine)), [len(path) for path in fine])
        least, q, problem = np.full(len(fine), np.inf), np.concatenate(fine), np.asarray(which)[owner]
        for begin in range(0, len(q), CHUNKS[0]):
            rows = np.arange(begin, min(begin + CHUNKS[0], len(q)))
            padded = np.resize(rows, CHUNKS[0])
            away = self._distances(np.float32(q[padded]), problems.solids(problem[padded]))[0]
            np.minimum.at(least, owner[rows], np.asarray(away)[: len(rows)])
        return least


def _surely_free(model: LinkModel, q: jax.Array, solids: RoundedBoxes) -> jax.Array:
    """Whether the spheres of each configuration are free among its obstacles; configurations are the last axis within."""
    frames = frames_along(model, q)
    x = sphere_centers(model, frames)
    radii = jnp.asarray(model.radii, q.dtype)[:, None]
    last = jax.tree.map(lambda a: jnp.moveaxis(a, 0, -1), solids)
    away = jnp.all(least_distance(last, x) > radii, axis=0)
    high = jnp.asarray(model.sphere_links > 0)[:, None]
    above = jnp.all((x[2] > radii) | ~high, axis=0)
    return away & above & jnp.all(pair_gaps(model, frames)[0] > 0, axis=0)


def _configuration_distances(
    arm: Arm, pairs: tuple[tuple[int, int], ...], q: jax.Array, solids: RoundedBoxes
) -> tuple[jax.Array, jax.Array]:
    """Least distance of moving capsules from obstacles, and from the floor and each other [m]."""
    capsules = arm_capsules(arm, q)
    links = np.asarray(arm.capsule_links)
    moving = np.flatnonzero(links >= 0)

    def to_box(a: jax.Array, b: jax.Array, box: jax.Array) -> jax.Array:
        def distance(x: jax.Array) -> jax.Array:
            away = x - solids.center[box]
            if solids.rotation is not None:
                away = away @ solids.rotation[box]
            return box_distance(away, jnp.zeros(3, x.dtype), solids.half[box]) - solids.radius[box]

        return jnp.where(solids.radius[box] < 0, FAR, segment_convex_distance(a, b, distance))

    over_boxes = jax.vmap(to_box, in_axes=(None, None, 0))
    apart = jax.vmap(over_boxes, in_axes=(0, 0, None))(
        capsules.a[moving], capsules.b[moving], jnp.arange(solids.center.shape[0])
    )
    high = np.flatnonzero(links >= 1)
    over_floor = jnp.minimum(capsules.a[high, 2], capsules.b[high, 2]) - capsules.radius[high]
    i, j = np.asarray(pairs, int).reshape(-1, 2).T
    between = jax.vmap(capsule_distance)(
        *(x[i] for x in (capsules.a, capsules.b, capsules.radius)),
        *(x[j] for x in (capsules.a, capsules.b, capsules.radius)),
    )
    own = jnp.concatenate([over_floor, between])
    return jnp.min(apart - capsules.radius[moving][:, None]), jnp.min(own, initial=FAR)


def _configuration_free(arm: Arm, pairs: tuple[tuple[int, int], ...], q: jax.Array, solids: RoundedBoxes) -> jax.Array:
    away, own = _configuration_distances(arm, pairs, q, solids)
    return (away > 0) & (own > 0)
