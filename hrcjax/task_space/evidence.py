"""What the views say about one thing: its points, and stretches of rays along which they saw through."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hrcjax.task_space.instances import Part
from hrcjax.task_space.shape_fit import Evidence
from hrcjax.task_space.view import View, in_image, rays

POINTS, RAYS = 512, 768
"""Capacities."""
AROUND = 0.04
"""Free space is looked at up to this far about the points [m]."""
STANDS = 0.03
"""A thing seen lower than this stands on the table [m]."""
BELOW = 6
"""Rays that must pass below a thing for it to hang [1]."""


def evidence(views: list[View], parts: list[Part], places: list[Float[np.ndarray, "_ 3"]]) -> Evidence:
    """What was seen of one thing that consists of parts of images, in the frame of the views.

    Args:
        places: of the parts' pixels [m].
    """
    draw = np.random.default_rng(0)
    every = np.concatenate(places)
    deviation = np.concatenate([views[part.view].deviation.ravel()[part.pixels] for part in parts])
    lower, upper = np.percentile(every, 1, axis=0), np.percentile(every, 99, axis=0)
    middle = (lower + upper) / 2
    reach = float(np.percentile(np.linalg.norm(every - middle, axis=1), 99)) + AROUND
    begin, end = [], []
    for k, view in enumerate(views):
        own = np.concatenate([part.pixels for part in parts if part.view == k] or [np.zeros(0, int)])
        a, b = _free(view, own, middle, reach)
        begin.append(a)
        end.append(b)
    a, b = np.concatenate(begin), np.concatenate(end)
    stands = lower[2] < STANDS or _passes_below(a, b, lower, upper) < BELOW

    def some(count: int, capacity: int) -> np.ndarray:
        return draw.choice(count, min(count, capacity), replace=False)

    def padded(values: np.ndarray, capacity: int) -> jnp.ndarray:
        rest = capacity - len(values)
        return jnp.asarray(np.concatenate([values, np.repeat(values[:1] if len(values) else middle[None], rest, 0)]), jnp.float32)  # fmt: skip

    p, r = some(len(every), POINTS), some(len(a), RAYS)
    return Evidence(
        points=padded(every[p], POINTS),
        deviation=jnp.asarray(np.pad(deviation[p], (0, POINTS - len(p)), constant_values=1.0), jnp.float32),
        mask=jnp.arange(POINTS) < len(p),
        begin=padded(a[r], RAYS), end=padded(b[r] if len(r) else b, RAYS), free=jnp.arange(RAYS) < len(r),
        lower=jnp.asarray(lower, jnp.float32), upper=jnp.asarray(upper, jnp.float32), stands=jnp.asarray(bool(stands)),
    )  # fmt: skip


def _free(view: View, own: np.ndarray, middle: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Begin and end of the stretches, within a ball, along which rays went on to something behind."""
    at, z = in_image(view, middle[None])
    nothing = np.zeros((0, 3))
    if z[0] <= reach:
        return nothing, nothing
    radius = 1.1 * reach * view.focal.max() / (z[0] - reach) + 1
    height, width = view.depth.shape
    low = np.clip(np.floor(at[0] - radius), 0, [width, height]).astype(int)
    high = np.clip(np.ceil(at[0] + radius) + 1, 0, [width, height]).astype(int)
    window = (slice(low[1], high[1]), slice(low[0], high[0]))
    depth = view.depth[window]
    if depth.size == 0:
        return nothing, nothing
    direction = rays(view, window)
    mine = np.zeros(view.depth.size, bool)
    mine[own] = True
    offset = view.position - middle
    aa, bb = np.sum(direction**2, -1), direction @ offset
    square = bb**2 - aa * (offset @ offset - reach**2)
    root = np.sqrt(np.maximum(square, 0))
    enter, leave = (-bb - root) / aa, (-bb + root) / aa
    until = np.minimum(leave, depth - 0.005 - 3 * view.deviation[window])
    seen = (depth > 0) & (square > 0) & (enter > 0) & (until > enter + 0.005) & ~mine.reshape(view.depth.shape)[window]
    d, s, e = direction[seen], enter[seen], until[seen]
    return view.position + s[:, None] * d, view.position + e[:, None] * d


def _passes_below(a: np.ndarray, b: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> int:
    """How many stretches pass through the space between a thing and the table."""
    inset = 0.2 * (upper - lower)
    low = np.array([lower[0] + inset[0], lower[1] + inset[1], 0.005])
    high = np.array([upper[0] - inset[0], upper[1] - inset[1], lower[2] - 0.01])
    if high[2] <= low[2] or len(a) == 0:
        return 0
    t = np.linspace(0, 1, 16)[:, None, None]
    place = a + t * (b - a)
    return int(np.any(np.all((place > low) & (place < high), axis=-1), axis=0).sum())
