"""A lazy probabilistic roadmap: broken lines through random free configurations, as guesses where smooth detours do not do.

Source: Bohlin, Kavraki, Path planning using lazy PRM, ICRA 2000: edges are checked only when the shortest way leads over them.
NumPy, one problem at a time; configurations are checked many at once.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

FreeFn = Callable[[NDArray], NDArray]
"""(configuration joint) -> whether each is free."""


def spread_samples(
    start: NDArray, goal: NDArray, low: NDArray, high: NDArray, count: int, rng: np.random.Generator
) -> NDArray:
    """Random configurations: half normal around the straight line, with deviations of 0.3 to 2 rad, half uniform in the box of
    its ends grown by 2 rad, all within the ranges, (count joint) [rad]."""
    near = count // 2
    along = start + rng.uniform(size=(near, 1)) * (goal - start)
    normal = along + np.exp(rng.uniform(np.log(0.3), np.log(2.0), (near, 1))) * rng.standard_normal((near, len(start)))
    lower, upper = np.minimum(start, goal) - 2.0, np.maximum(start, goal) + 2.0
    return np.clip(np.concatenate([normal, rng.uniform(lower, upper, (count - near, len(start)))]), low, high)


def subdivided(line: NDArray, step: float) -> NDArray:
    """A broken line with steps of at most `step` in any joint, its corners among them, (configuration joint) [rad]."""
    parts = [line[:1]]
    for a, b in pairwise(line):
        count = max(int(np.ceil(np.abs(b - a).max() / step)), 1)
        parts.append(a + np.linspace(0, 1, count + 1)[1:, None] * (b - a))
    return np.concatenate(parts)


def _free_lines(lines: list[NDArray], free: FreeFn, step: float) -> NDArray:
    fine = [subdivided(line, step) for line in lines]
    owner = np.repeat(np.arange(len(fine)), [len(line) for line in fine])
    bad = np.unique(owner[~free(np.concatenate(fine))])
    ok = np.ones(len(fine), bool)
    ok[bad] = False
    return ok


def roadmap_lines(
    start: NDArray,
    goal: NDArray,
    low: NDArray,
    high: NDArray,
    free: FreeFn,
    rng: np.random.Generator,
    samples: int = 1500,
    neighbours: int = 14,
    lines: int = 4,
    rounds: int = 400,
    step: float = 0.0349,
) -> list[NDArray]:
    """Free broken lines from start to goal, each (corner joint) [rad]; none if the samples do not suffice.

    Every line found makes its edges count twice for the next one, so that this takes another way.

    Args:
        low, high: ranges of the joints [rad].
        free: tells which configurations are free.
        samples: configurations drawn.
        neighbours: nearest ones that each is joined to.
        lines: most lines.
        rounds: most searches in the graph.
        step: largest change of any joint between configurations that are checked [rad].
    """
    drawn = spread_samples(start, goal, low, high, samples, rng)
    nodes = np.concatenate([start[None], goal[None], drawn[free(drawn)]])
    count = len(nodes)
    around = min(neighbours + 1, count)
    distance, index = (np.asarray(part) for part in KDTree(nodes).query(nodes, around))
    pairs = np.stack([np.repeat(np.arange(count), around - 1), index[:, 1:].reshape(-1)], axis=1)
    edges, kept = np.unique(np.sort(pairs, axis=1), axis=0, return_index=True)
    weight = np.maximum(distance[:, 1:].reshape(-1)[kept], 1e-9)
    number = csr_matrix((np.arange(1, len(edges) + 1), edges.T), shape=(count, count))
    there, checked = np.ones(len(edges), bool), np.zeros(len(edges), bool)
    found: list[NDArray] = []
    for _ in range(rounds):
        if len(found) == lines:
            break
        graph = csr_matrix((weight[there], edges[there].T), shape=(count, count))
        far, before = dijkstra(graph, directed=False, indices=0, return_predecessors=True)
        if not np.isfinite(far[1]):
            break
        way = [1]
        while way[-1] != 0:
            way.append(int(before[way[-1]]))
        used = np.array([number[min(i, j), max(i, j)] - 1 for i, j in pairwise(way)])
        new = used[~checked[used]]
        ok = _free_lines([nodes[edges[e]] for e in new], free, step) if len(new) else np.ones(0, bool)
        checked[new] = True
        there[new[~ok]] = False
        if ok.all():
            found.append(shortcut(nodes[way[::-1]], free, rng, step=step))
            weight[used] *= 2
    return found


def shortcut(line: NDArray, free: FreeFn, rng: np.random.Generator, tries: int = 40, step: float = 0.0349) -> NDArray:
    """A free broken line made shorter by straight cuts between random places on it.

    Args:
        line: (corner joint) free [rad].
        tries: number of cuts that are tried, eight at once.
    """
    for _ in range(max(tries // 8, 1)):
        lengths = np.linalg.norm(np.diff(line, axis=0), axis=1)
        ends = np.concatenate([[0], np.cumsum(lengths)])
        cuts = []
        for a, b in np.sort(rng.uniform(0, ends[-1], (8, 2)), axis=1):
            i, j = np.searchsorted(ends, [a, b], side="right") - 1
            if i == j:
                continue
            p, q = (line[k] + (at - ends[k]) / lengths[k] * (line[k + 1] - line[k]) for k, at in ((i, a), (j, b)))
            cuts.append((i, j, p, q, b - a - float(np.linalg.norm(q - p))))
        if not cuts:
            continue
        ok = _free_lines([np.stack([p, q]) for _, _, p, q, _ in cuts], free, step)
        gains = np.array([cut[4] for cut in cuts]) * ok
        if gains.max() > 1e-9:
            i, j, p, q, _ = cuts[int(np.argmax(gains))]
            line = np.concatenate([line[: i + 1], p[None], q[None], line[j + 1 :]])
    return line
