"""Self-collision: the collision leaf between the arm's own control spheres."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.point_motion import PointMotion
from hrcjax.numerics import safe_norm, unit
from hrcjax.policy.collision import CollisionParams, collision
from hrcjax.policy.pullback import Pulled, pullback_points
from hrcjax.typing import Array, Float


def pairs_apart(links: Sequence[int], least: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of control points on links that are at least so many joints apart: first and second (pair).

    Neighbours overlap by design. Which pairs beyond can touch at all is for the caller to know.

    Args:
        links: link of every control point.
        least: 2: all but those on one link and on neighbours.
    """
    first, second = np.triu_indices(len(links), 1)
    apart = np.abs(np.subtract.outer(links, links))[first, second] >= least
    return first[apart], second[apart]


def relative(body: PointMotion, first: np.ndarray, second: np.ndarray) -> PointMotion:
    """Motion of the first point of every pair as seen from the second: a task like any other.

    Args:
        first, second: (pair) indices of points.
    """
    return jax.tree.map(lambda a: a[first] - a[second], body)


def self_collision(
    params: CollisionParams, body: PointMotion, radii: Float[Array, "point"], first: np.ndarray, second: np.ndarray
) -> Pulled:
    """The pullback of the collision leaf of every pair of control spheres: they push each other off and brake their approach.

    Args:
        params: of the leaf; `r_act` well below the least distance of the pairs in a usual posture, or it never rests.
        body: motion of the control points.
        radii: of their spheres [m].
        first, second: (pair) indices of the points that must not touch, as of `pairs_apart`.

    Not finite if: as `collision`. Two centres that coincide have no direction and are not pushed.
    """
    between = relative(body, first, second)
    d = jax.vmap(safe_norm)(between.x) - radii[first] - radii[second]
    M, a = jax.vmap(lambda *pair: collision(params, *pair))(d, jax.vmap(unit)(between.x), between.xd)
    return pullback_points(between.J, between.Jd_qd, M, jnp.asarray(a))
