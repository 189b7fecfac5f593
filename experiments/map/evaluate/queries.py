"""Query points: in free space, near observed surfaces."""

from functools import cache
from itertools import pairwise
from typing import NamedTuple

import jax
import numpy as np

from .families import Case
from .parts import in_parts
from .solids import World, world_distance
from .survey import LAYOUT, PARAMS, Frame, number

NEAR = 0.3
"""Largest distance of a query from a surface [m]."""
LEAST_VIEWS = 3
"""Least number of images in which an observed surface is visible."""
LEAST_COSINE = 0.2
"""Least cosine between its normal and the ray [1]."""
AGREE = 0.01
"""Largest difference between its depth and that of the exact image at its pixel [m]."""
DRAWN = 40_000
FAR_BANDS = (0.2, 0.3, 0.45, 0.6, 0.9, 1.2, 2.0, 3.0)
"""Edges of the bands of `far_out` [m]."""
EACH = 256
"""Queries of each of them."""
ROUNDS = 8
"""Draws of PART places for it, at most."""
PART = 8192
"""Queries of one call."""
OFF, STEP, KEPT = 0.01, 0.015, 0.8
"""Least distance [m], step [m] and cosine [1] of `settled`."""


class Queries(NamedTuple):
    """Query points with their exact results."""

    x: np.ndarray
    """Positions (query, 3) [m]."""
    distance: np.ndarray
    """Exact distance (query,) [m]."""
    gradient: np.ndarray
    """Exact gradient (query, 3) [1]."""


@cache
def _truth():
    def truth(world: World, x: jax.Array) -> tuple[jax.Array, jax.Array]:
        return jax.lax.map(jax.value_and_grad(lambda x: world_distance(world, x)), x, batch_size=1024)

    return jax.jit(truth)


def truth(world: World, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Exact distance [m] and gradient [1] at x (query, 3)."""
    d, g = in_parts(lambda x: _truth()(world, x), x, PART)
    return d, g


def settled(world: World, asked: Queries) -> np.ndarray:
    """Where the direction away from the nearest surface is well defined (query,).

    More than 1 cm from the surface, and the exact gradient changes by at most a cosine of 0.8 within 15 mm along every axis: not
    near the medial axis.
    """
    least = np.ones(len(asked.x))
    for step in np.concatenate([np.eye(3), -np.eye(3)]) * STEP:
        turned = truth(world, (asked.x + step).astype(np.float32))[1]
        least = np.minimum(least, np.sum(turned * asked.gradient, axis=1))
    return (least > KEPT) & (asked.distance > OFF)


def project(frame: Frame, p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Row, column and depth of points (point, 3), and whether they are in the image; rows and columns are clipped."""
    c = frame.camera
    local = (p - np.asarray(c.position)) @ np.asarray(c.rotation)
    z = np.where(local[:, 2] > 1e-3, local[:, 2], 1e-3)
    column = np.rint(local[:, 0] / z * number(c.fx) + number(c.cx))
    row = np.rint(local[:, 1] / z * number(c.fy) + number(c.cy))
    inside = (local[:, 2] > 0.01) & (column >= 1) & (column < c.width - 1) & (row >= 1) & (row < c.height - 1)
    row, column = (np.clip(v, 1, most - 2).astype(int) for v, most in ((row, c.height), (column, c.width)))
    return row, column, local[:, 2], inside


def times_seen(frames: list[Frame], p: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Number of images in which a surface point was measured (point,).

    An image counts if the point is in its field of view and depth range at a sufficient incidence angle; if the exact image has
    the point's depth at its pixel or a neighbour; and if there is a measurement at that pixel.
    """
    count = np.zeros(len(p), int)
    for frame in frames:
        row, column, z, inside = project(frame, p)
        way = np.asarray(frame.camera.position) - p
        facing = np.sum(way * normal, axis=1) > LEAST_COSINE * np.linalg.norm(way, axis=1)
        near = np.min([np.abs(frame.exact[row + i, column + j] - z) for i in (-1, 0, 1) for j in (-1, 0, 1)], axis=0)
        valid = (z > number(PARAMS.near)) & (z < number(PARAMS.far)) & (frame.measured[row, column] > 0)
        count += inside & facing & (near < AGREE) & valid
    return count


def held_out(case: Case, frames: list[Frame], count: int, seed: int) -> Queries:
    """Queries drawn uniformly in the case's box: outside all solids, near surfaces whose nearest point was observed."""
    x = np.random.default_rng(seed).uniform(case.lower, case.upper, (DRAWN, 3)).astype(np.float32)
    d, g = truth(case.world, x)
    near = np.nonzero((d > 0) & (d < NEAR))[0][: 4 * count]
    x, d, g = x[near], d[near], g[near]
    seen = times_seen(frames, x - d[:, None] * g, g) >= LEAST_VIEWS
    return Queries(*(v[seen][:count] for v in (x, d, g)))


def far_out(case: Case, frames: list[Frame], seed: int) -> list[Queries]:
    """Queries of each of FAR_BANDS, as many as were found, up to EACH: drawn uniformly in the case's box made larger by the
    distance, also outside of the map's box; the nearest surface lies within that box and was observed."""
    random, bands = np.random.default_rng(7000 + seed), []
    low, high = np.asarray(LAYOUT.lower), np.asarray(LAYOUT.lower) + LAYOUT.edge_of(0) * np.asarray(LAYOUT.shape)
    for least, most in pairwise(FAR_BANDS):
        lower, upper = case.lower - [most, most, 0.0], case.upper + most
        kept: list[Queries] = []
        for _ in range(ROUNDS):
            x = random.uniform(lower, upper, (PART, 3)).astype(np.float32)
            d, g = truth(case.world, x)
            foot = x - d[:, None] * g
            mapped = np.all((foot > low + LAYOUT.spacing) & (foot < high - LAYOUT.spacing), axis=1)
            some = np.nonzero((d >= least) & (d < most) & mapped)[0]
            some = some[times_seen(frames, foot[some], g[some]) >= LEAST_VIEWS]
            kept.append(Queries(x[some], d[some], g[some]))
            if sum(len(part.distance) for part in kept) >= EACH:
                break
        bands.append(Queries(*(np.concatenate(parts)[:EACH] for parts in zip(*kept, strict=True))))
    return bands
