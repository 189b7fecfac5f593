"""Points of a link between two control points: how much faster than both they may approach somebody.

On a rigid link p(s) = (1 - s) p0 + s p1, and the velocity is linear in s too. For a person at y, D(s) a(s) = -(p(s) - y) . v(s),
distance times approach, has no term in s^2, because (p1 - p0) . (v1 - v0) = 0. So it is linear along the link,

    a(s) = ((1 - s) D0 a0 + s D1 a1) / D(s),    D(s)^2 = (1 - s) D0^2 + s D1^2 - s (1 - s) (2 h)^2,

with the gap 2 h between the points. If both ends keep a_i <= v sqrt(1 - (h / D_i)^2), then a(s) <= v for every s: the root is
concave, and 4 s (1 - s) <= 1. Equality midway, at D0 = D1. Beside a plane the directions agree, and the factor is not needed.
"""

import jax.numpy as jnp
import numpy as np

from hrcjax.numerics import safe_sqrt
from hrcjax.typing import Array, Float


def between_factor(D: Float[Array, "*#point"], half_gap: Float[Array, "*#point"]) -> Float[Array, "*#point"]:
    """Factor on the limit of a control point that covers the link to its neighbours: sqrt(1 - (h / D)^2) [1].

    Args:
        D: distance of the control point itself, not of its sphere's surface; nearer than h: 0 [m].
        half_gap: h, half of the distance to the farther of its neighbours on the link, `half_gaps` [m].
    """
    far = half_gap < D
    ratio = jnp.where(far, half_gap / jnp.where(far, D, 1.0), 1.0)
    return jnp.where(jnp.isnan(D), D, safe_sqrt(1.0 - ratio * ratio))


def half_gaps(links: tuple[int, ...], offsets: np.ndarray) -> np.ndarray:
    """Half of the distance of every control point to the farther of those before and after it on the same link [m].

    Args:
        links: of the control points, in order along the arm.
        offsets: (point 3) in the frames of their links [m].
    """
    same = np.array(links[1:]) == np.array(links[:-1])
    gap = np.where(same, np.linalg.norm(np.diff(offsets, axis=0), axis=1), 0.0)
    return np.maximum(np.append(gap, 0.0), np.append(0.0, gap)) / 2
