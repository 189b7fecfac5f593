"""What was found, against what stands there: matches, errors, and which points of the truth the shapes cover."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from hrcjax.task_space import POINTS, TaskSpace, solid_distances
from hrcjax.task_space.view import in_image
from hrcjax.world.scene import BOX, SPHERE
from hrcjax.world.scenes import Obstacle

from .tables import hull, surface

COVER = 0.01
"""A point of the truth is covered within this of a shape [m]."""
TOUCH = 0.02
"""Things nearer than this to each other may be found as one [m]."""
VISIBLE = 0.01
"""A point is seen if no image has its pixel nearer than this before it; added to four deviations [m]."""
LEAST_SEEN = 10
"""A thing of which both cameras together show fewer points of `SAMPLES` is counted as hidden [1]."""


def reach_of(o: Obstacle) -> float:
    """How far the centre of a match may be: the radius of the ball or of the upright cylinder about a thing [m]."""
    return hull(o)


def size_error(o: Obstacle, kind: int, size: NDArray, yaw: float) -> float:
    """Largest error of a half extent or radius [m]. Those of two boxes are compared by the nearest quarter turn."""
    one, other = np.array(o.size), np.asarray(size, float)
    if o.kind == SPHERE and kind == SPHERE:
        return float(abs(one[0] - other[0]))
    if o.kind == BOX and kind in (BOX, POINTS) and round((yaw - o.yaw) / (np.pi / 2)) % 2:
        other = other[[1, 0, 2]]
    return float(np.abs(one - other).max())


def seen_by(found: TaskSpace, place: NDArray, exact: list[NDArray]) -> NDArray:
    """Which points of the truth any camera sees, by exact depth images."""
    seen = np.zeros(len(place), bool)
    for view, depth in zip(found.views, exact, strict=True):
        local = place @ found.table.rotation.T + found.table.shift
        pixel, z = in_image(view, local)
        at = np.round(pixel).astype(int)
        inside = (z > 0) & np.all((at >= 0) & (at < np.array(depth.shape)[::-1]), axis=1)
        nearest = np.zeros(len(place))
        nearest[inside] = depth[at[inside, 1], at[inside, 0]]
        seen |= inside & (z <= nearest + VISIBLE)
    return seen


def measure_table(things: list[Obstacle], found: TaskSpace, exact: list[NDArray], seed: int) -> dict[str, Any]:
    """Arrays of one table, a value for each true thing, and how many instances belong to none.

    A thing is found if an instance whose centre lies within its reach is given to it, one to one, so that the sum of distances is
    least; or if it is nearer than `TOUCH` to another, and one instance covers at least 99 in 100 of its points. An instance that
    is given to none and covers none so is false.

    Args:
        exact: depth images without noise [m].
    """
    draw = np.random.default_rng(seed)
    table, every = found.table, found.instances
    centers = np.array([table.rotation.T @ (one.center - table.shift) for one in every]).reshape(-1, 3)
    count = len(things)
    reach = np.array([reach_of(o) for o in things])
    true = np.array([o.center for o in things])
    off = np.linalg.norm(true[:, None] - centers[None], axis=-1)
    allowed = off <= reach[:, None]
    rows, columns = linear_sum_assignment(np.where(allowed, off, 1e3))
    match = np.full(count, -1)
    for i, j in zip(rows, columns, strict=True):
        if allowed[i, j]:
            match[i] = j
    samples = [surface(o, draw) for o in things]
    gaps = np.array([_gap(i, samples, things) for i in range(count)])
    distances = np.array([
        [solid_distances(one.kind, c, one.size, one.yaw, s) for one, c in zip(every, centers, strict=True)] for s in samples
    ]).reshape(count, len(every), len(samples[0]))  # fmt: skip
    covers = np.mean(distances <= COVER, axis=2) if len(every) else np.zeros((count, 0))
    merged = np.array(
        [match[i] < 0 and gaps[i] < TOUCH and len(every) > 0 and covers[i].max() >= 0.99 for i in range(count)]
    )
    used = set(match[match >= 0]) | {int(covers[i].argmax()) for i in np.flatnonzero(merged)}
    nearest = distances.min(1) if len(every) else np.full((count, len(samples[0])), np.inf)
    seen = np.array([seen_by(found, s, exact) for s in samples])
    covered = nearest <= COVER
    has = match >= 0
    kinds = np.array([every[j].kind if j >= 0 else -2 for j in match])

    def share(which: NDArray) -> NDArray:
        return np.array([c[w].mean() if w.any() else np.nan for c, w in zip(covered, which, strict=True)])

    return {
        "kind": np.array([o.kind for o in things]), "size": np.array([o.size for o in things]), "center": true,
        "match": match, "merged": merged, "gap": gaps, "found_kind": kinds,
        "centre_error": np.where(has, off[np.arange(count), np.maximum(match, 0)], np.nan) if len(every) else np.full(count, np.nan),
        "size_error": np.array([size_error(o, every[j].kind, every[j].size, every[j].yaw) if j >= 0 else np.nan for o, j in zip(things, match, strict=True)]),
        "covered": covered.mean(1), "covered_seen": share(seen), "covered_unseen": share(~seen), "worst": nearest.max(1),
        "seen": seen.sum(1), "instances": np.array(len(every)), "false": np.array(len(every) - len(used)),
        "false_center": centers[[j for j in range(len(every)) if j not in used]],
        "normalised_error": np.array([np.max(np.abs(true[i] - centers[j]) / np.maximum(every[j].center_deviation, 1e-6)) if j >= 0 else np.nan for i, j in enumerate(match)]),
    }  # fmt: skip


def _gap(i: int, samples: list[NDArray], things: list[Obstacle]) -> float:
    """Distance from a thing to the nearest other one [m]."""
    others = [solid_distances(o.kind, np.array(o.center), np.array(o.size), o.yaw, samples[i]).min() for k, o in enumerate(things) if k != i]  # fmt: skip
    return float(min(others, default=np.inf))
