"""Exact points on the surface of a person, by the project's own motions."""

import jax.numpy as jnp
import numpy as np

from hrcjax.geom.capsules import Capsules
from hrcjax.world.person import Person
from hrcjax.world.skeleton import Pose, body_capsules, body_of

SEEN_FROM = np.array([0.0, -1.5, 1.2])


def pose(hand: tuple[float, float, float] = (0.35, 0.0, -0.25), lean: float = 0.1, y: float = 1.1) -> Capsules:
    """Somebody who faces the robot, with the left hand somewhere and the right one hanging."""
    as_array = jnp.asarray
    return body_capsules(
        body_of(
            Pose(
                hip=as_array([0.2, y]),
                forward=as_array([0.0, -1.0]),
                lean=as_array(lean),
                hand=(as_array(hand), as_array([0.15, 0.06, -0.5])),
                stride=as_array(0.0),
            )
        )
    )


def person_of(body: Capsules) -> Person:
    """A record of one frame."""
    return Person(body.a[None], body.b[None], body.radius, jnp.asarray(30.0), jnp.asarray([True]))


def gaps(points: np.ndarray, body: Capsules) -> np.ndarray:
    """Signed distances of points to every capsule, in NumPy (point capsule)."""
    a, b, r = (np.asarray(v, float) for v in (body.a, body.b, body.radius))
    axis = b - a
    off = points[:, None] - a
    along = np.clip((off * axis).sum(-1) / np.maximum((axis * axis).sum(-1), 1e-12), 0, 1)
    return np.linalg.norm(off - along[..., None] * axis, axis=-1) - r


def surface_points(body: Capsules, count: int = 320, seed: int = 0, without: tuple[int, ...] = ()) -> np.ndarray:
    """Points on the outside of the first ten capsules, of the half that faces the camera; some parts are left out."""
    draw = np.random.default_rng(seed)
    found: list[np.ndarray] = []
    a, b, r = (np.asarray(v, float) for v in (body.a, body.b, body.radius))
    size = np.linalg.norm(b - a, axis=1) * r + 2 * r * r
    size[10:] = 0
    while sum(map(len, found)) < count:
        k = draw.choice(len(r), 4 * count, p=size / size.sum())
        u = draw.normal(size=(len(k), 3))
        axis_points = a[k] + draw.uniform(size=(len(k), 1)) * (b - a)[k]
        p = axis_points + r[k, None] * u / np.linalg.norm(u, axis=1, keepdims=True)
        d = gaps(p, body)
        on = (np.abs(d).min(1) < 0.004) & (d.min(1) > -0.004)
        facing = ((p - axis_points) * (SEEN_FROM - p)).sum(1) > 0
        nearest = d[:, :10].argmin(1)
        found.append(p[on & facing & ~np.isin(nearest, without) & (p[:, 2] > 0.03)])
    return np.concatenate(found)[:count]
