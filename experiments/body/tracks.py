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
from hrcjax.cells.people import FASTEST
from hrcjax.numerics import unrolled_options
from hrcjax.typing import Array

from .truth import ARM_PARTS, approach_speeds, arm_axis_points, arm_places, axis_distance, nearest_of

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
"""Images between two that are compared."""
REACTION, PERIOD = 0.1, 1 / 30
"""Reaction time of the safety layer, and time between two images [s]."""
ASSUMED = 1.6
"""Speed of a person who is not measured (ISO 13855) [m/s]."""


@cache
def _frame() -> Any:
    return jax.jit(track_body, compiler_options=unrolled_options())


@cache
def _reader() -> Any:
    params = VARIANTS["full"]

    def read(fit: BodyFit, x: Array) -> tuple[Any, Array]:
        def one(p: Array) -> tuple[Any, Array]:
            return nearest_part(params, fit, p), measured_speed(params, fit, p, REACTION, ASSUMED)

        return jax.vmap(one)(x)

    return jax.jit(read)


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
    capsules = jax.tree.map(np.asarray, part_capsules(jnp.asarray(fit.joints[frames]), jnp.asarray(fit.radii[frames])))
    error = np.stack(
        [
            np.abs(
                axis_distance(places[:, j], capsules.a[:, None, k].astype(float), capsules.b[:, None, k].astype(float))
                - capsules.radius[:, None, k]
            )
            for j, k in enumerate(ARM_PARTS)
        ],
        axis=1,
    )
    true = true_joints(seen)
    own = np.linalg.norm(fit.joints[:, 3:5] - true[:, 3:5], axis=-1).sum(1)
    other = np.linalg.norm(fit.joints[:, 3:5] - true[:, 4:2:-1], axis=-1).sum(1)
    steps = np.linalg.norm(np.diff(true, axis=0), axis=-1) / np.diff(seen["stamps"])[:, None]
    found = {
        "clean": steps.max() < FASTEST, "frames": frames, "error": error, "outside": outside, "visible": visible, "tracked": fit.tracked, "age": fit.age,
        "explained": fit.explained, "exchanged": other < own, "seconds": seconds, "joints": fit.joints, "true_joints": true,
        "place_deviation": np.sqrt(np.trace(fit.place_covariance, axis1=-2, axis2=-1)), "lengths": fit.lengths,
        "count": seen["mask"].sum(1), "stamps": seen["stamps"],
    }  # fmt: skip
    return found | (_towards(seen, fit, frames) if variant == "full" else {})


def _towards(seen: dict[str, NDArray], fit: BodyFit, frames: NDArray) -> dict[str, NDArray]:
    """At the place of the arm that is nearest to the exact person: regions and speeds, true, of the track, and of the nearest point."""
    keep = ("region", "true_region", "sure", "speed", "bound", "deviation", "true_speed", "true_most", "distance", "track_distance", "point_speed")  # fmt: skip
    rows: dict[str, list[float]] = {name: [] for name in keep}
    for f in frames:
        x = arm_axis_points(seen, f)
        d, part = nearest_of(seen, f, x)
        k = int(d.argmin())
        one = jax.tree.map(lambda a, f=f: jnp.asarray(a[f]), fit)
        near, bound = jax.tree.map(
            lambda a: float(np.asarray(a)[0]), _reader()(one, jnp.asarray(x[k : k + 1], jnp.float32))
        )
        speed, most = approach_speeds(seen, f, x[k], REACTION + PERIOD)
        gaps = [np.linalg.norm(seen["points"][g][seen["mask"][g]] - x[k], axis=1).min(initial=9.0) for g in (f - 2, f)]
        values = (
            near.region, PART_REGION[part[k]] if part[k] < len(PART_REGION) else -1, near.sure, near.speed, bound, near.deviation,
            speed, most, d[k], near.distance, (gaps[0] - gaps[1]) / (2 * PERIOD),
        )  # fmt: skip
        for name, value in zip(keep, values, strict=True):
            rows[name].append(float(value))
    return {name: np.asarray(values) for name, values in rows.items()}
