"""Tracks of a person, and what is measured on them."""

import time
from dataclasses import replace
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.body import (
    PART_REGION,
    BodyFit,
    BodyParams,
    initial_body,
    measured_speed,
    nearest_part,
    part_capsules,
    track_body,
)
from hrcjax.body.facing import OTHER_PART
from hrcjax.body.nearest import parts_at
from hrcjax.body.state import settled
from hrcjax.cells.people import FASTEST
from hrcjax.numerics import unrolled_options
from hrcjax.typing import Array

from .truth import (
    ARM_PARTS,
    ASSUMED,
    approach_speeds,
    arm_axis_points,
    arm_places,
    axis_distance,
    nearest_of,
    outside_places,
    part_speeds,
    visible_places,
)

WRONG = 1.1
"""Radii over the exact ones, before anything is learnt, of the tracker "thick" [1]."""
USUAL = BodyParams()
VARIANTS = {
    "full": USUAL,
    "fixed": replace(USUAL, length_spreads=(1e-3,) * 7, radius_spread=5e-3, length_drift=1e-5),
    "thick": replace(USUAL, radii=tuple(WRONG * radius for radius in USUAL.radii)),
    "cold": replace(USUAL, warm=False),
}
"""Trackers by name."""
EVERY = 12
"""Images between two in which all visible surfaces are compared."""
FAR_OFF, FEWEST = 0.1, 10
"""Error of a place that is wrong [m], and visible places by which an image is judged [1]."""
CLEAR = 1.5
"""Times that shoulders are nearer to those of one side than of the other, by which it is clear which side they are [1]."""
REACTION, PERIOD = 0.1, 1 / 30
"""Reaction time of the safety layer, and time between two images [s]."""


@cache
def _frame() -> Any:
    return jax.jit(track_body, compiler_options=unrolled_options())


@cache
def _reader() -> Any:
    params = VARIANTS["full"]

    def read(fit: BodyFit, x: Array) -> tuple[Any, Array, Any]:
        return nearest_part(params, fit, x), measured_speed(params, fit, x, REACTION, ASSUMED), parts_at(params, fit, x)

    return jax.jit(jax.vmap(read))


def follow(seen: dict[str, NDArray], variant: str) -> tuple[BodyFit, NDArray]:
    """The fits of all images, stacked, and the processor time of each frame [s]."""
    frame, params = _frame(), VARIANTS[variant]
    dts = np.diff(seen["stamps"], prepend=seen["stamps"][0] - PERIOD).astype(np.float32)
    state, fits, seconds = initial_body(params), [], []
    for k in range(len(dts)):
        items = tuple(jnp.asarray(v) for v in (seen["points"][k], seen["mask"][k], dts[k], seen["eyes"][k]))
        begin = time.process_time()
        state, fit = jax.block_until_ready(frame(params, state, *items))
        seconds.append(time.process_time() - begin)
        fits.append(jax.tree.map(np.asarray, fit))
    return jax.tree.map(lambda *a: np.stack(a), *fits), np.asarray(seconds[1:])


def true_joints(seen: dict[str, NDArray]) -> NDArray:
    """The joints of the exact person (frame joint 3) [m]."""
    a, b = seen["a"], seen["b"]
    return np.stack([a[:, 0], a[:, 2], b[:, 3], a[:, 4], a[:, 5], *(b[:, k] for k in range(4, 10))], axis=1)


def with_places(seen: dict[str, NDArray]) -> dict[str, NDArray]:
    """The images with places on the exact arms, in those that are compared."""
    frames = np.arange(3, len(seen["stamps"]) - 1, EVERY)
    places, outside, visible = arm_places(seen, frames)
    return seen | {"frames": frames, "places": places, "outside": outside, "visible": visible}


def measured(seen: dict[str, NDArray], variant: str) -> dict[str, NDArray]:
    """Everything that is stored of one person with one tracker.

    Args:
        seen: `with_places`.
    """
    fit, seconds = follow(seen, variant)
    frames, places, outside, visible = (seen[name] for name in ("frames", "places", "outside", "visible"))
    error = surface_errors(fit, frames, places)
    true = true_joints(seen)
    own = np.linalg.norm(fit.joints[:, 3:5] - true[:, 3:5], axis=-1).sum(1)
    other = np.linalg.norm(fit.joints[:, 3:5] - true[:, 4:2:-1], axis=-1).sum(1)
    steps = np.linalg.norm(np.diff(true, axis=0), axis=-1) / np.diff(seen["stamps"])[:, None]
    found = {
        "clean": steps.max() < FASTEST, "frames": frames, "error": error, "outside": outside, "visible": visible, "tracked": fit.tracked, "age": fit.age,
        "explained": fit.explained, "exchanged": other < own, "clear": np.maximum(own, other) > CLEAR * np.minimum(own, other), "seconds": seconds, "joints": fit.joints, "true_joints": true,
        "place_deviation": np.sqrt(np.trace(fit.place_covariance, axis1=-2, axis2=-1)), "lengths": fit.lengths,
        "count": seen["mask"].sum(1), "stamps": seen["stamps"], "wrong": wrong_images(seen, fit),
    }  # fmt: skip
    return found | (_towards(seen, fit, other < own) if variant == "full" else {})


def surface_errors(fit: BodyFit, frames: NDArray, places: NDArray) -> NDArray:
    """Distance of places (frame part place) to the surface of the fitted part [m]."""
    capsules = jax.tree.map(np.asarray, part_capsules(jnp.asarray(fit.joints[frames]), jnp.asarray(fit.radii[frames])))
    each = [
        axis_distance(places[:, j], capsules.a[:, None, k].astype(float), capsules.b[:, None, k].astype(float))
        - capsules.radius[:, None, k]
        for j, k in enumerate(ARM_PARTS)
    ]
    return np.abs(np.stack(each, axis=1))


def wrong_images(seen: dict[str, NDArray], fit: BodyFit) -> NDArray:
    """In every image, whether the track is sure and half of the visible places are far off.

    What cameras see takes long to find, so that it is asked where enough places are far off, seen or not.
    """
    wrong = np.zeros(len(seen["stamps"]), bool)
    sure = np.asarray(settled(USUAL, *(jnp.asarray(a) for a in (fit.tracked, fit.age, fit.explained))))
    for f in np.flatnonzero(sure).tolist():
        places, outside = outside_places(seen, f)
        off = surface_errors(fit, np.asarray([f]), places[None])[0] > FAR_OFF
        if (off & outside).sum() < FEWEST / 2:
            continue
        visible = visible_places(seen, f, places, outside)
        wrong[f] = visible.sum() >= FEWEST and off[visible].mean() > 0.5
    return wrong


def _towards(seen: dict[str, NDArray], fit: BodyFit, exchanged: NDArray) -> dict[str, NDArray]:
    """In every image, at the place of the arm that is nearest to the exact person: regions and speeds, true, of the track, and of the
    nearest point; and speeds and distances of all parts with what the track tells of their errors."""
    looked = np.arange(2, len(seen["stamps"]) - 1)
    rows: dict[str, list[Any]] = {name: [] for name in ("x", "true_part", "true_speed", "true_most", "distance", "point_speed", "true_speeds", "true_distances")}  # fmt: skip
    for f in looked.tolist():
        x = arm_axis_points(seen, f)
        d, part = nearest_of(seen, f, x)
        k = int(d.argmin())
        speed, most = approach_speeds(seen, f, x[k], REACTION + PERIOD)
        gaps = [np.linalg.norm(seen["points"][g][seen["mask"][g]] - x[k], axis=1).min(initial=9.0) for g in (f - 2, f)]
        speeds, distances = part_speeds(seen, f, x[k])
        if exchanged[f]:  # a part that is taken for that of the other side has its motion
            speeds, distances = speeds[list(OTHER_PART)], distances[list(OTHER_PART)]
        values = (x[k], part[k], speed, most, d[k], (gaps[0] - gaps[1]) / (2 * PERIOD), speeds, distances)
        for name, value in zip(rows, values, strict=True):
            rows[name].append(value)
    found = {name: np.asarray(values) for name, values in rows.items()}
    here = jax.tree.map(lambda a: jnp.asarray(a[looked]), fit)
    near, bound, told = jax.tree.map(np.asarray, _reader()(here, jnp.asarray(found.pop("x"), jnp.float32)))
    true_part = found.pop("true_part")
    regions = np.append(PART_REGION, -1)  # legs are no part of the body that is followed
    return found | {
        "looked": looked, "region": near.region, "true_region": regions[np.minimum(true_part, len(PART_REGION))], "sure": near.sure,
        "speed": near.speed, "bound": bound, "deviation": near.deviation, "track_distance": near.distance,
        "known": told.known, "speeds": told.speed, "deviations": told.speed_deviation, "distances": told.distance,
        "place_deviations": told.place_deviation,
    }  # fmt: skip
