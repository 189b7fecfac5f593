"""Problems of other families than the file's, drawn by seeds: shelves, tables, cages, spheres, boxes turned at random, and a table seen
as points. Start and goal are random free configurations with the tool among the obstacles; there is no reference path."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from hrcjax.robot import Arm, points_on_links

from .checker import Checker
from .problems import Problems

POINT = 0.035
"""Radius of the balls that stand for points [m]."""
RANGE = np.pi
"""Joints of start and goal are at most this far from 0 [rad]."""
DRAWN = 1024
"""Random configurations at once for each problem."""
Made = tuple[list[NDArray], list[NDArray], list[float], NDArray, NDArray, list[NDArray] | None]
"""Centres, half extents, radii [m], the corners of the region in which the tool begins and ends, and axes of the boxes."""


def shelf(rng: np.random.Generator) -> Made:
    """Three boards between two sides and a back, in front of the robot."""
    x, width, depth = rng.uniform(0.45, 0.6), rng.uniform(0.3, 0.4), 0.14
    heights = np.array([0.12, 0.42, 0.72]) + rng.uniform(-0.03, 0.03, 3)
    center = [np.array([x + depth, 0, z]) for z in heights]
    half = [np.array([depth, width, 0.01])] * 3
    center += [np.array([x + depth, side * width, 0.42]) for side in (-1, 0, 1)] + [np.array([x + 2 * depth, 0, 0.42])]
    half += [np.array([depth, 0.01, 0.35])] * 3 + [np.array([0.01, width, 0.35])]
    return center, half, [0.0] * 7, np.array([x - 0.05, -width, 0.15]), np.array([x + 2 * depth, width, 0.7]), None


def table(rng: np.random.Generator) -> Made:
    """A table's top on four legs, with upright capsules on it."""
    x, y, z = rng.uniform(0.5, 0.6), rng.uniform(-0.15, 0.15), rng.uniform(0.25, 0.35)
    center, half = [np.array([x, y, z])], [np.array([0.22, 0.4, 0.015])]
    for side in (-1, 1):
        for end in (-1, 1):
            center.append(np.array([x + 0.2 * side, y + 0.38 * end, z / 2]))
            half.append(np.array([0.02, 0.02, z / 2]))
    radii = [0.0] * 5
    for _ in range(5):
        tall = rng.uniform(0.08, 0.2)
        center.append(np.array([x + rng.uniform(-0.2, 0.2), y + rng.uniform(-0.35, 0.35), z + 0.03 + tall / 2]))
        half.append(np.array([0.0, 0.0, tall / 2]))
        radii.append(0.03)
    return center, half, radii, np.array([x - 0.25, y - 0.4, 0.08]), np.array([x + 0.25, y + 0.4, z + 0.25]), None


def cage(rng: np.random.Generator) -> Made:
    """Upright bars round the robot, and two rings of beams over them."""
    count, far = 8, rng.uniform(0.45, 0.6)
    turn = rng.uniform(0, 2 * np.pi)
    angles = turn + 2 * np.pi * np.arange(count) / count
    center = [np.array([far * np.cos(a), far * np.sin(a), 0.45]) for a in angles]
    half, radii = [np.array([0.0, 0.0, 0.45])] * count, [0.02] * count
    rotation = [np.eye(3)] * count
    for a in angles:
        middle = a + np.pi / count
        center.append(np.array([far * np.cos(middle), far * np.sin(middle), rng.uniform(0.5, 0.9)]))
        half.append(np.array([0.01, far * np.sin(np.pi / count), 0.01]))
        radii.append(0.01)
        rotation.append(Rotation.from_euler("z", middle).as_matrix())
    return center, half, radii, np.array([-0.75, -0.75, 0.1]), np.array([0.75, 0.75, 0.8]), rotation


def spheres(rng: np.random.Generator) -> Made:
    """Spheres round the robot."""
    away = rng.standard_normal((12, 3)) * np.array([1, 1, 0.4])
    away *= rng.uniform(0.4, 0.75, (12, 1)) / np.linalg.norm(away, axis=1, keepdims=True)
    center = list(away + np.array([0, 0, 0.4]))
    return (
        center,
        [np.zeros(3)] * 12,
        list(rng.uniform(0.05, 0.13, 12)),
        np.array([-0.7, -0.7, 0.1]),
        np.array([0.7, 0.7, 0.8]),
        None,
    )


def turned_boxes(rng: np.random.Generator) -> Made:
    """Boxes turned at random."""
    away = rng.standard_normal((10, 3)) * np.array([1, 1, 0.4])
    away *= rng.uniform(0.4, 0.75, (10, 1)) / np.linalg.norm(away, axis=1, keepdims=True)
    center, half = list(away + np.array([0, 0, 0.4])), list(rng.uniform(0.03, 0.15, (10, 3)))
    rotation = list(Rotation.random(10, rng=rng).as_matrix())
    return center, half, [0.0] * 10, np.array([-0.7, -0.7, 0.1]), np.array([0.7, 0.7, 0.8]), rotation


def points(rng: np.random.Generator) -> Made:
    """A table with two walls on it as points every 6 cm, each a ball: more than a hundred obstacles."""
    x, y, z = rng.uniform(0.5, 0.6), rng.uniform(-0.15, 0.15), rng.uniform(0.2, 0.35)
    across, along, up = np.arange(-0.18, 0.19, 0.06), np.arange(-0.36, 0.37, 0.06), np.arange(0.06, 0.19, 0.06)
    top = np.stack([*np.meshgrid(across, along, [0.0])], axis=-1).reshape(-1, 3)
    walls = [np.stack([*np.meshgrid(across, [at], up)], axis=-1).reshape(-1, 3) for at in rng.uniform(-0.3, 0.3, 2)]
    center = np.concatenate([top, *walls]) + np.array([x, y, z])
    count = len(center)
    low, high = np.array([x - 0.25, y - 0.4, 0.08]), np.array([x + 0.25, y + 0.4, z + 0.25])
    return list(center), [np.zeros(3)] * count, [POINT] * count, low, high, None


FAMILIES: dict[str, Callable[[np.random.Generator], Made]] = {
    "shelf": shelf, "table": table, "cage": cage, "spheres": spheres, "turned_boxes": turned_boxes,
    "points": points,
}  # fmt: skip


def family(name: str, count: int, seed: int, arm: Arm, checker: Checker) -> Problems:
    """Problems of a family. Start and goal are free by the exact check, and their tool points lie in the family's region."""
    tools = jax.jit(jax.vmap(lambda q: points_on_links(arm.chain, q, (arm.tool_link,), arm.tool_offset[None])[0]))
    drawn = [np.random.default_rng([seed, k, *name.encode()]) for k in range(count)]
    made = [FAMILIES[name](rng) for rng in drawn]
    problems = _problems(made, np.zeros((count, 2, arm.chain.size)))
    low, high = np.maximum(arm.q_min, -RANGE), np.minimum(arm.q_max, RANGE)
    ends: list[list[NDArray]] = [[] for _ in made]
    while left := [k for k in range(count) if len(ends[k]) < 2]:
        q = np.stack([drawn[k].uniform(low, high, (DRAWN, arm.chain.size)) for k in left])
        x = np.asarray(tools(jnp.asarray(q.reshape(-1, q.shape[2]), jnp.float32))).reshape(*q.shape[:2], 3)
        there = np.array([((x[i] > made[k][3]) & (x[i] < made[k][4])).all(1) for i, k in enumerate(left)])
        owner, which = np.nonzero(there)
        free = checker.configurations_free(problems, np.asarray(left)[owner], q[owner, which])
        for i, j in zip(owner[free], which[free], strict=True):
            ends[left[i]].append(q[i, j])
    return _problems(made, np.stack([np.stack(both[:2]) for both in ends]))


def _problems(made: list[Made], ends: NDArray) -> Problems:
    count, boxes = len(made), np.array([len(one[0]) for one in made])
    most = int(boxes.max())
    center, half = np.full((count, most, 3), 9.0), np.zeros((count, most, 3))
    grown, rotation = np.zeros((count, most)), np.tile(np.eye(3), (count, most, 1, 1))
    for k, one in enumerate(made):
        n = boxes[k]
        center[k, :n], half[k, :n], grown[k, :n] = one[0], one[1], one[2]
        if one[5] is not None:
            rotation[k, :n] = one[5]
    turned = any(one[5] is not None for one in made)
    return Problems(ends[:, 0], ends[:, 1], center, half, boxes, tuple(ends), grown, rotation if turned else None)
