"""Two things that touch, or nearly so, hang together in images and on the grid; they are told apart by shape.

Solids that stand beside each other and are convex from above are on two sides of an upright plane: a group that no shape explains is cut
where it is thin, or between the points on the best shape and those off it; every point then goes to the shape that it is nearest to, and the
two are kept if they explain the group better than one. Solids do not pass through each other, so that shapes that do are no two things.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from hrcjax.task_space.choice import best_shape
from hrcjax.task_space.coverage import left_out
from hrcjax.task_space.evidence import evidence
from hrcjax.task_space.instances import Part, SplitParams
from hrcjax.task_space.misfit import misfit
from hrcjax.task_space.shape_fit import OFF, Evidence, FitParams, Fitted
from hrcjax.task_space.solid_distance import Solid, common_depth, solid_distances
from hrcjax.task_space.view import View

ANGLES = 24
"""Directions of upright planes that are tried, over half a turn."""
STRIP = 0.004
"""Width of the strip about a plane in which points are counted [m]."""
FIRST, CUTS = 2, 6
"""Planes that are tried, the thinnest first, and how many at most."""
ROUNDS = 2
"""Times that points change sides."""
HOPELESS = 2
"""Times that a group is divided before it is kept whole if no part of it is explained by then."""


class Explained(NamedTuple):
    """A thing with the shape that explains it best."""

    parts: list[Part]
    place: Float[np.ndarray, "point 3"]
    """Its points [m]."""
    seen: Evidence
    kind: int
    fit: Fitted
    score: float
    """Criterion for each point [1]."""
    misfit: float = np.nan
    """Root mean square of the points' residuals over what noise makes of them; not a number until it is judged [1]."""
    left_out: float = np.nan
    """How far outside of the shape something of it is; the same [m]."""


def shaped(one: Explained, split: SplitParams) -> bool:
    """Whether a thing is its shape, and not its points."""
    near = float(one.fit.residual) <= split.worst_residual and one.left_out <= split.cover
    return near and float(one.fit.claimed) <= split.worst_claim


def _judged(
    views: list[View], one: Explained, flat: list[np.ndarray], params: FitParams, split: SplitParams
) -> Explained:
    """The same, with what all of its pixels say of the shape."""
    out = left_out(views, one.parts, flat, _solid(one), bool(one.seen.stands), split.least_pixels)
    return one._replace(misfit=misfit(views, one.parts, flat, _solid(one), params), left_out=out)


def _fitted(
    views: list[View], parts: list[Part], flat: list[np.ndarray], params: FitParams, split: SplitParams
) -> Explained:
    return _judged(views, _tried(views, parts, flat, params), flat, params, split)


def _tried(views: list[View], parts: list[Part], flat: list[np.ndarray], params: FitParams) -> Explained:
    """The best shape, as far as it takes to compare it with others."""
    places = [flat[part.view][part.pixels] for part in parts]
    seen = evidence(views, parts, places)
    kind, fit, score = best_shape(seen, params)
    return Explained(parts, np.concatenate(places), seen, kind, fit, score / max(int(np.sum(seen.mask)), 1))


def _score(things: Sequence[Explained]) -> float:
    """Criterion of several things for each of their points [1]."""
    return float(np.average([one.score for one in things], weights=[len(one.place) for one in things]))


def thin_places(place: Float[np.ndarray, "point 3"], count: int) -> list[tuple[Float[np.ndarray, "2"], float]]:
    """Upright planes, normal . (x, y) = offset, about which there are fewest points, and an eighth on either side at least; best
    first, each of another direction."""
    found = []
    for angle in np.arange(ANGLES) * np.pi / ANGLES:
        way = np.array([np.cos(angle), np.sin(angle)])
        along = place[:, :2] @ way
        low, high = np.quantile(along, [0.125, 0.875])
        edges = np.arange(low, high + STRIP, STRIP / 2)
        if len(edges) < 3:
            continue
        order = np.sort(along)
        within = np.searchsorted(order, edges + STRIP / 2) - np.searchsorted(order, edges - STRIP / 2)
        across = place[:, :2] @ np.array([-way[1], way[0]])
        # thin in comparison with what a body of the same points and width would have
        usual = len(place) * STRIP / max(np.ptp(along), STRIP)
        best = int(np.argmin(within))
        found.append((within[best] / usual, -np.ptp(across), way, float(edges[best])))
    found.sort(key=lambda one: one[:2])
    kept: list[tuple[np.ndarray, float]] = []
    for _, _, way, offset in found:
        if all(abs(way @ other) < np.cos(np.deg2rad(20)) for other, _ in kept):
            kept.append((way, offset))
    return kept[:count]


def passes(one: Explained, other: Explained, params: FitParams) -> bool:
    """Whether two shapes pass through each other, as solids cannot, by more than they may differ from the real surfaces."""
    return common_depth(_solid(one), _solid(other)) > OFF * float(params.model)


def _sides(parts: list[Part], side: list[np.ndarray], least: int) -> tuple[list[Part], list[Part]]:
    first = [part._replace(pixels=part.pixels[s]) for part, s in zip(parts, side, strict=True)]
    second = [part._replace(pixels=part.pixels[~s]) for part, s in zip(parts, side, strict=True)]
    return tuple([p for p in half if len(p.pixels) >= max(least // 3, 1)] for half in (first, second))  # pyright: ignore[reportReturnType]  # two


def _solid(one: Explained) -> Solid:
    return one.kind, np.asarray(one.fit.center), np.asarray(one.fit.size), float(one.fit.yaw)


def _from(one: Explained, place: np.ndarray) -> np.ndarray:
    """Distances of points from the surface of a shape [m]."""
    return np.abs(solid_distances(*_solid(one), place))


def _off(views: list[View], one: Explained, flat: list[np.ndarray], params: FitParams) -> list[np.ndarray]:
    """Which pixels of every part are not of the shape's surface."""
    spread = [np.hypot(views[p.view].deviation.ravel()[p.pixels], params.model) for p in one.parts]
    return [_from(one, flat[p.view][p.pixels]) > OFF * s for p, s in zip(one.parts, spread, strict=True)]


def _poor(views: list[View], one: Explained, flat: list[np.ndarray], params: FitParams, split: SplitParams) -> bool:
    """Whether a shape explains a group so badly that two are tried."""
    if one.misfit > split.poor or float(one.fit.claimed) > split.claimed or one.left_out > split.cover:
        return True
    return sum(int(off.sum()) for off in _off(views, one, flat, params)) >= split.off


def _as_two(
    views: list[View], one: Explained, flat: list[np.ndarray], params: FitParams, split: SplitParams
) -> tuple[Explained, Explained] | None:
    """The best of two shapes, if they explain a group better than one does; two that pass through each other only where no others do. The first
    that explain all are good enough; more than `FIRST` planes are tried only while all shapes pass through each other."""
    best, least = None, (True, one.score)
    cuts = [[flat[p.view][p.pixels][:, :2] @ way < offset for p in one.parts] for way, offset in thin_places(one.place, CUTS)]  # fmt: skip
    off = [~one_off for one_off in _off(views, one, flat, params)]
    for k, side in enumerate([off, *cuts]):
        if k > FIRST and not least[0]:
            break
        for _ in range(ROUNDS):
            halves = _sides(one.parts, side, split.least_pixels)
            if min(sum(len(p.pixels) for p in half) for half in halves) < split.least_pixels:
                break
            first, second = (_tried(views, half, flat, params) for half in halves)
            two = first, second
            score = passes(first, second, params), _score(two)
            if score[1] < one.score and score < least:
                best, least = two, score
            near = [[_from(t, flat[p.view][p.pixels]) for p in one.parts] for t in two]
            side = [a < b for a, b in zip(*near, strict=True)]
        if best is not None and not least[0]:
            best = _judged(views, best[0], flat, params, split), _judged(views, best[1], flat, params, split)
            if not any(_poor(views, t, flat, params, split) for t in best):
                break
    if best is None:
        return None
    return _judged(views, best[0], flat, params, split), _judged(views, best[1], flat, params, split)


def explain(
    views: list[View], parts: list[Part], flat: list[np.ndarray], params: FitParams, split: SplitParams
) -> list[Explained]:
    """A group of parts as one thing, or as several where one shape does not do; as one, too, where shapes do not explain most of it then.

    Args:
        flat: points of all pixels of every view [m].
    """
    whole = _fitted(views, parts, flat, params, split)
    open_, done = [whole], []
    for times in range(split.most):
        poor = [one for one in open_ if _poor(views, one, flat, params, split)]
        done += [one for one in open_ if not any(one is other for other in poor)]
        if times == HOPELESS and not done:
            return [whole]
        open_ = []
        for one in poor:
            two = _as_two(views, one, flat, params, split)
            if two is None:
                done.append(one)
            else:
                open_ += two
        if not open_:
            break
    done += open_
    loose = sum(len(one.place) for one in done if not shaped(one, split) or _poor(views, one, flat, params, split))
    return [whole] if len(done) > 1 and loose > split.loose * len(whole.place) else done


def rejoin(
    views: list[View], every: list[Explained], flat: list[np.ndarray], params: FitParams, split: SplitParams
) -> list[Explained]:
    """The same things, but for those that are parts of one: seen from different sides and with no cell in common, or cut by
    something in front. Neighbours become one where one shape explains both, and as well as two do; or the two pass through each other, as solids
    cannot: two shapes of the same points always explain their noise better.

    Args:
        flat: points of all pixels of every view [m].
    """
    every = list(every)
    tried: list[tuple[Explained, Explained]] = []
    while True:
        near = _near_pairs(every, split)
        pair = next((p for p in near if not any(every[p[0]] is a and every[p[1]] is b for a, b in tried)), None)
        if pair is None:
            return every
        a, b = (every[k] for k in pair)
        tried.append((a, b))
        one = _fitted(views, a.parts + b.parts, flat, params, split)
        if _poor(views, one, flat, params, split):
            continue
        if one.score <= split.alike * _score((a, b)) or passes(a, b, params):
            every = [other for k, other in enumerate(every) if k not in pair] + [one]


def hand_over(
    views: list[View], every: list[Explained], flat: list[np.ndarray], params: FitParams, split: SplitParams
) -> list[Explained]:
    """The same things, but for those that pass through a better explained neighbour, which solids cannot, and most of whose points lie on
    its surface: an image may join a small thing with a part of the one behind it, and a shape about both passes through the other. The
    neighbour gets these points, and what is left has a shape of its own, where there is one and it passes through less.

    Args:
        flat: points of all pixels of every view [m].
    """
    every = list(every)
    for i, j in _near_pairs(every, split):
        poorer, better = sorted((i, j), key=lambda k: -every[k].score)
        a, b = every[poorer], every[better]
        through = common_depth(_solid(a), _solid(b))
        if through <= OFF * float(params.model):
            continue  # side by side, as solids can be: near the neighbour's surface is what faces it
        stays = []
        for part in a.parts:
            place, spread = flat[part.view][part.pixels], views[part.view].deviation.ravel()[part.pixels]
            stays.append(_from(b, place) > OFF * np.hypot(spread, params.model))
        own, given = _sides(a.parts, stays, split.least_pixels)
        left = sum(len(part.pixels) for part in own)
        if left < split.least_pixels or left > (1 - split.handed) * len(a.place):
            continue
        two = _fitted(views, own, flat, params, split), _fitted(views, b.parts + given, flat, params, split)
        if all(shaped(one, split) for one in two) and common_depth(*map(_solid, two)) < through:
            every[poorer], every[better] = two
    return every


def _near_pairs(every: list[Explained], split: SplitParams) -> list[tuple[int, int]]:
    """Things with points nearer to each other than `near`."""
    trees = [KDTree(one.place) for one in every]
    return [
        (i, j)
        for i in range(len(every))
        for j in range(i)
        if trees[i].query(every[j].place, distance_upper_bound=split.near)[0].min() < split.near
    ]
