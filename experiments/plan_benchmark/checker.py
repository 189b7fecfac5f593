"""The exact collision check: capsules against boxes, the floor and each other, at steps of 2 degrees."""

from collections.abc import Sequence
from functools import partial
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.geom.segment import capsules_distances
from hrcjax.geom.shape import box_distance, segment_convex_distance
from hrcjax.plan.body import self_pairs
from hrcjax.robot import Arm, arm_capsules

from .problems import TIGHT, Problems

STEP = np.deg2rad(2.0)
"""Largest change of any joint from one checked configuration to the next [rad]."""
CHUNK = 2048
"""Configurations that are checked at once."""


def dense(path: NDArray) -> NDArray:
    """The path with steps of at most STEP, its waypoints among them."""
    parts = [path[:1]]
    for a, b in pairwise(path):
        count = max(int(np.ceil(np.abs(b - a).max() / STEP)), 1)
        parts.append(a + np.linspace(0, 1, count + 1)[1:, None] * (b - a))
    return np.concatenate(parts)


class Checker:
    """Tells whether paths of an arm are free."""

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self._free = jax.jit(jax.vmap(partial(_configuration_free, arm, tuple(self_pairs(arm, TIGHT)))))

    def free(self, problems: Problems, which: Sequence[int], paths: Sequence[NDArray]) -> NDArray:
        """Whether each path is free among the boxes of its problem, and within the joints' ranges."""
        fine = [dense(path) for path in paths]
        owner = np.repeat(np.arange(len(fine)), [len(path) for path in fine])
        q = np.concatenate(fine) if fine else np.zeros((0, self.arm.chain.size))
        problem = np.asarray(which)[owner] if len(owner) else owner
        ok = np.zeros(len(q), bool)
        for begin in range(0, len(q), CHUNK):
            rows = np.arange(begin, min(begin + CHUNK, len(q)))
            padded = np.resize(rows, CHUNK)
            k = problem[padded]
            single = [np.float32(x[k]) for x in (problems.center, problems.half)]
            found = self._free(
                jnp.asarray(np.float32(q[padded])), *map(jnp.asarray, single), jnp.asarray(problems.boxes[k])
            )
            ok[rows] = np.asarray(found)[: len(rows)]
        within = ((q >= self.arm.q_min - 1e-6) & (q <= self.arm.q_max + 1e-6)).all(1)
        return np.array([bool((ok & within)[owner == k].all()) for k in range(len(fine))], bool)


def _configuration_free(
    arm: Arm, pairs: tuple[tuple[int, int], ...], q: jax.Array, center: jax.Array, half: jax.Array, count: jax.Array
) -> jax.Array:
    capsules = arm_capsules(arm, q)
    links = np.asarray(arm.capsule_links)
    moving = np.flatnonzero(links >= 0)

    def to_box(a: jax.Array, b: jax.Array, center: jax.Array, half: jax.Array) -> jax.Array:
        return segment_convex_distance(a, b, lambda x: box_distance(x, center, half))

    over_boxes = jax.vmap(to_box, in_axes=(None, None, 0, 0))
    apart = jax.vmap(over_boxes, in_axes=(0, 0, None, None))(capsules.a[moving], capsules.b[moving], center, half)
    real = jnp.arange(center.shape[0]) < count
    boxes_free = jnp.all((apart > capsules.radius[moving][:, None]) | ~real)
    high = np.flatnonzero(links >= 1)
    floor_free = jnp.all(jnp.minimum(capsules.a[high, 2], capsules.b[high, 2]) > capsules.radius[high])
    between = capsules_distances(capsules, capsules)
    i, j = np.asarray(pairs).T
    return boxes_free & floor_free & jnp.all(between[i, j] > 0)
