"""The exact person in NumPy: places on the arms' surfaces, which of them cameras see, nearest parts, speeds."""

import numpy as np
from numpy.typing import NDArray

from hrcjax.body import PARTS

ARM_PARTS = (4, 5, 6, 7, 8, 9)
"""Upper arms, forearms and hands, left and right in turn."""
ASSUMED = 1.6
"""Speed of a person who is not measured (ISO 13855) [m/s]."""
PLACES = 40
"""Places on every part."""
BOX = ((-2.0, -2.0, 0.03), (2.0, 2.0, 1.3))
"""What is looked at around the arm's base [m]."""


def axis_distance(p: NDArray, a: NDArray, b: NDArray) -> NDArray:
    """Distance of points to a segment [m]."""
    axis = b - a
    along = np.clip(((p - a) * axis).sum(-1) / np.maximum((axis * axis).sum(-1), 1e-12), 0, 1)
    return np.linalg.norm(p - a - along[..., None] * axis, axis=-1)


def surface_places(a: NDArray, b: NDArray, radius: float) -> NDArray:
    """Places spread over a capsule's surface [m]."""
    k = np.arange(PLACES) + 0.5
    height, turn = 1 - 2 * k / PLACES, np.pi * (1 + 5**0.5) * k
    flat = np.sqrt(1 - height**2)
    u = np.stack([flat * np.cos(turn), flat * np.sin(turn), height], axis=1)  # a spiral on the sphere
    u = u[np.random.default_rng(0).permutation(PLACES)]
    axis = b - a
    length = np.linalg.norm(axis)
    along = axis / max(length, 1e-9)
    side = round(PLACES * length / (length + 2 * radius))
    across = u[:side] - (u[:side] @ along)[:, None] * along
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    share = ((np.arange(side) * 0.618) % 1)[:, None]
    ends = np.where((u[side:] @ along)[:, None] > 0, b, a)
    return np.concatenate([a + share * axis + radius * across, ends + radius * u[side:]])


def exposed(p: NDArray, a: NDArray, b: NDArray, radius: NDArray, own: int) -> NDArray:
    """Places that lie in no other capsule, and in the box that is looked at."""
    others = [axis_distance(p, a[k], b[k]) > radius[k] - 1e-4 for k in range(len(radius)) if k != own]
    return np.logical_and.reduce([*others, (p > BOX[0]).all(1), (p < BOX[1]).all(1)])


def seen_from(p: NDArray, eye: NDArray, a: NDArray, b: NDArray, radius: NDArray) -> NDArray:
    """Places between which and an eye no capsule is."""
    way = np.linspace(0.02, 0.9, 32)[None, :, None] ** 1.5
    q = p[:, None] + way * (eye - p)[:, None]
    return np.logical_and.reduce(
        [(axis_distance(q, a[k], b[k]) > radius[k] - 0.003).all(1) for k in range(len(radius))]
    )


def outside_places(seen: dict[str, NDArray], f: int) -> tuple[NDArray, NDArray]:
    """Places on the person's arms in an image (part place 3) [m], and which are on the outside."""
    a, b, r = (seen[name][f].astype(float) for name in ("a", "b", "radius"))
    if (r < 0).all():
        return np.zeros((len(ARM_PARTS), PLACES, 3)), np.zeros((len(ARM_PARTS), PLACES), bool)
    places = np.stack([surface_places(a[k], b[k], r[k]) for k in ARM_PARTS])
    return places, np.stack([exposed(p, a, b, r, k) for p, k in zip(places, ARM_PARTS, strict=True)])


def visible_places(seen: dict[str, NDArray], f: int, places: NDArray, outside: NDArray) -> NDArray:
    """Which of these places a camera sees in this image or the last."""
    a, b, r = (seen[name][f].astype(float) for name in ("a", "b", "radius"))
    looks = [seen_from(places[outside], seen["eyes"][g].astype(float), a, b, r) for g in (f, max(f - 1, 0))]
    visible = np.zeros_like(outside)
    visible[outside] = looks[0] | looks[1]
    return visible


def arm_places(seen: dict[str, NDArray], frames: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Places on the person's arms (frame part place 3) [m], which are on the outside, and which a camera sees in this image or the last."""
    each = [outside_places(seen, f) for f in frames]
    visible = [visible_places(seen, f, *one) for f, one in zip(frames, each, strict=True)]
    return np.stack([one[0] for one in each]), np.stack([one[1] for one in each]), np.stack(visible)


def arm_axis_points(seen: dict[str, NDArray], f: int) -> NDArray:
    """Points along the axes of the robot's capsules in an image, without its base [m]."""
    a, b = seen["arm_a"][f][1:].astype(float), seen["arm_b"][f][1:].astype(float)
    share = np.linspace(0, 1, 5)[None, :, None]
    return (a[:, None] + share * (b - a)[:, None]).reshape(-1, 3)


def nearest_of(seen: dict[str, NDArray], f: int, x: NDArray) -> tuple[NDArray, NDArray]:
    """Distance of points to the person's surface in an image [m], and the nearest capsule."""
    a, b, r = (seen[name][f].astype(float) for name in ("a", "b", "radius"))
    d = np.stack([axis_distance(x, a[k], b[k]) - r[k] for k in range(len(r))], axis=-1)
    return d.min(-1), d.argmin(-1)


def approach_speeds(seen: dict[str, NDArray], f: int, x: NDArray, ahead: float) -> tuple[NDArray, NDArray]:
    """Speed at which the person comes to a fixed place about an image, and the greatest one until a time later [m/s]."""
    t = seen["stamps"]
    last = min(int(np.searchsorted(t, t[f] + ahead)) + 1, len(t))
    d = np.stack([nearest_of(seen, g, x)[0] for g in range(max(f - 1, 0), last)])
    speed = -np.diff(d, axis=0) / np.diff(t[max(f - 1, 0) : last])
    return speed[:2].mean(0), speed[1:].max(0) if len(speed) > 1 else speed[0]


def part_speeds(seen: dict[str, NDArray], f: int, x: NDArray) -> tuple[NDArray, NDArray]:
    """Of the parts that a track has: speed towards a fixed place, from the image before to the one after [m/s], and distance [m]."""
    count = len(PARTS)
    around = []
    for g in (f - 1, f, f + 1):
        a, b, r = (seen[name][g][:count].astype(float) for name in ("a", "b", "radius"))
        around.append(axis_distance(x, a, b) - r)
    return (around[0] - around[2]) / (seen["stamps"][f + 1] - seen["stamps"][f - 1]), around[1]
