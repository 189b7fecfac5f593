"""A world observed from all its camera poses by a simulated D435i: the map, and the input of other methods from the same images."""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike

from hrcjax.map import (
    FieldMap,
    FrameParams,
    FrameReport,
    MapLayout,
    MapParams,
    empty_map,
    initial_stream,
    labelled_points,
    settle,
    take_frame,
)
from hrcjax.sense import Camera, NoiseParams, d435i
from hrcjax.sense.noise import measure
from hrcjax.sense.points import supported as supported_pixels

from .families import Case
from .solids import World, render_world

LAYOUT = MapLayout(lower=(-2.0, -2.0, -0.2), shape=(40, 40, 20))
PARAMS = MapParams()


LEAST_PIXELS = 16
"""Least pixels of all images in a voxel for other methods; below, they are taken for flying pixels."""


def number(value: ArrayLike) -> float:
    """A scalar as a Python float."""
    return float(np.asarray(value))


class Frame(NamedTuple):
    """One image, on the host."""

    camera: Camera
    exact: np.ndarray
    """Exact depth; infinity: no surface (height, width) [m]."""
    measured: np.ndarray
    """Measured depth; 0: no measurement (height, width) [m]."""


class Survey(NamedTuple):
    """A map and its frames."""

    state: FieldMap
    frames: list[Frame]
    raw: np.ndarray
    """Measured pixels, one per voxel, drawn at random (point, 3) [m]."""
    supported: np.ndarray
    """The same without pixels that their neighbours do not support and voxels with few pixels (point, 3) [m]."""
    faults: int
    """Blocks and points of any frame that exceeded a capacity."""


@cache
def _look():
    def look(world: World, eye: jax.Array, target: jax.Array, key: jax.Array) -> tuple[Camera, jax.Array, jax.Array]:
        camera = d435i(eye, target, 1)
        exact = render_world(camera, world)
        return camera, exact, measure(exact, camera, key, NoiseParams())

    return jax.jit(look)


@cache
def _take():
    def step(state: FieldMap, camera: Camera, depth: jax.Array) -> tuple[FieldMap, FrameReport]:
        stream = initial_stream(depth.dtype)  # all frames are accepted
        state, _, report, _ = take_frame(
            LAYOUT, FrameParams(PARAMS), state, stream, jnp.zeros((), depth.dtype), camera, depth
        )
        return state, report

    return jax.jit(step, donate_argnums=0)


@cache
def _settle():
    return jax.jit(lambda state: settle(LAYOUT, PARAMS, state), donate_argnums=0)


@cache
def _supported():
    return jax.jit(lambda depth: supported_pixels(depth))


def look(world: World, eye: np.ndarray, target: np.ndarray, seed: int) -> Frame:
    """One image of a world with the noise of a D435i."""
    camera, exact, measured = _look()(world, jnp.asarray(eye), jnp.asarray(target), jax.random.key(seed))
    return Frame(camera, np.asarray(exact), np.asarray(measured))


def take(state: FieldMap, frame: Frame) -> tuple[FieldMap, FrameReport]:
    """The map after one image. The old map's memory is reused."""
    return _take()(state, frame.camera, jnp.asarray(frame.measured))


def settled(state: FieldMap) -> FieldMap:
    """The map with all weights up to date. The old map's memory is reused."""
    return _settle()(state)


def map_points(state: FieldMap) -> np.ndarray:
    """The points of level 0 (point, 3) [m]."""
    return labelled_points(state)[0]


def pixels(frame: Frame, z: np.ndarray) -> np.ndarray:
    """All pixels of a measured image z [m] within the map's depth range, in the world (pixel, 3) [m]."""
    c = frame.camera
    v, u = np.nonzero((z > number(PARAMS.near)) & (z < number(PARAMS.far)))
    z = z[v, u]
    local = np.stack([(u - number(c.cx)) / number(c.fx) * z, (v - number(c.cy)) / number(c.fy) * z, z], axis=1)
    return (local @ np.asarray(c.rotation).T + np.asarray(c.position)).astype(np.float32)


class RandomThinning:
    """One point per voxel of the map, drawn uniformly from the points in the voxel."""

    def __init__(self, seed: int) -> None:
        self.draw = np.random.default_rng(seed)
        self.shape = np.asarray(LAYOUT.shape) * 4
        self.best = np.full(int(np.prod(self.shape)), -1.0, np.float32)
        self.points = np.zeros((len(self.best), 3), np.float32)
        self.count = np.zeros(len(self.best), np.int32)

    def add(self, points: np.ndarray) -> None:
        """Adds points (point, 3) [m]."""
        place = np.floor((points - np.asarray(LAYOUT.lower, np.float32)) / np.float32(LAYOUT.spacing)).astype(np.int32)
        inside = np.all((place >= 0) & (place < self.shape), axis=1)
        points, place = points[inside], place[inside]
        voxel = (place[:, 0] * self.shape[1] + place[:, 1]) * self.shape[2] + place[:, 2]
        self.count += np.bincount(voxel, minlength=len(self.count)).astype(np.int32)
        lot = self.draw.random(len(points), np.float32)
        better = lot > self.best[voxel]
        voxel, lot, points = voxel[better], lot[better], points[better]
        order = np.argsort(lot)  # of several writes to one voxel the last one remains
        self.best[voxel[order]] = lot[order]
        self.points[voxel[order]] = points[order]

    def result(self, least: int = 1) -> np.ndarray:
        """The drawn points (point, 3), of voxels with at least `least` points [m]."""
        return self.points[self.count >= least]


def survey(case: Case, seed: int, every: int = 1, told: Callable[[Frame], Frame] = lambda frame: frame) -> Survey:
    """Fuses the images of a case, or every n-th of them, into a map.

    Args:
        told: frame -> what the map is told of it.
    """
    state, frames, faults, raw, supported = empty_map(LAYOUT), [], 0, RandomThinning(seed), RandomThinning(seed)
    for k, (eye, target) in enumerate(zip(case.eyes[::every], case.targets[::every], strict=True)):
        frame = look(case.world, eye, target, 100 * seed + k)
        state, report = take(state, told(frame))
        faults += int(report.lost) + int(report.unseen) + int(report.left_out)
        raw.add(pixels(frame, frame.measured))
        supported.add(pixels(frame, np.where(_supported()(frame.measured), frame.measured, 0)))
        frames.append(frame)
    state = settled(state)
    return Survey(state, frames, raw.result(), supported.result(LEAST_PIXELS), faults)
