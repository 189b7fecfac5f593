"""Constraints of the path optimiser: obstacles as half-spaces, the distance asked for, and the smooth penalty."""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from hrcjax.plan.potential import DistancesFn
from hrcjax.typing import Array, Float, Scalar, Vector3

_FAR = 10.0
"""Distance beyond which a constraint is as good as absent: keeps infinite bounds out of the derivatives [m]."""


class HalfSpaces(NamedTuple):
    """For every sample of a path and every obstacle the half-space through the obstacle's nearest point: normal . x +
    offset >= 0. A convex obstacle lies wholly behind it. Sample is the last axis, so that sums over obstacles run over
    whole vectors."""

    normal: Float[Array, "3 obstacle sample"]
    """Unit normals, away from the obstacle [1]."""
    offset: Float[Array, "obstacle sample"]
    """Distance at the origin of the world [m]."""

    def gap(self, samples: Float[Array, "sample 3"]) -> Float[Array, "obstacle sample"]:
        """Distance of every sample from its half-spaces [m]."""
        return self.offset + jnp.sum(self.normal * samples.T[:, None, :], axis=0)


def half_spaces(distances: DistancesFn, samples: Float[Array, "sample 3"]) -> HalfSpaces:
    """The half-spaces of the obstacles as they are seen from the samples of a path."""

    def gaps_and_normals(x: Vector3) -> tuple[Float[Array, "obstacle"], Float[Array, "3 obstacle"]]:
        return jax.vmap(lambda e: jax.jvp(distances, (x,), (e,)), out_axes=(None, 0))(jnp.eye(3, dtype=x.dtype))

    gap, normal = jax.vmap(gaps_and_normals, out_axes=(1, 2))(samples)
    return HalfSpaces(normal, gap - jnp.sum(normal * samples.T[:, None, :], axis=0))


def attainable_gap(
    required: Float[Array, "*k"],
    start: Float[Array, "*k"],
    goal: Float[Array, "*k"],
    opening: Scalar,
    length: Array,
    place: Float[Array, "sample"],
) -> Float[Array, "*k sample"]:
    """The required gap, or what can be attained by opening from a smaller one at start or goal [m].

    Args:
        required: gap asked for away from the ends [m].
        start, goal: gap at the ends [m].
        opening: growth of the gap per length of path [1].
        length: of the path [m].
        place: of the samples along the path, 0 at the start and 1 at the goal [1].
    """
    grown = opening * length * place
    rising, falling = start[..., None] + grown, goal[..., None] + opening * length - grown
    return jnp.minimum(required[..., None], jnp.minimum(rising, falling))


def push_back(spare: Array, stiffness: Array, unit: Array, softness: Array) -> tuple[Array, Array]:
    """Force of the smooth penalty on a constraint, and its stiffness.

    The push > 0 solves push = stiffness (excess - spare), push excess = unit softness^2: it grows with a violation like
    a spring and fades like 1 / spare where the constraint is kept.

    Args:
        spare: how far the constraint is kept; negative: violated [m].
        stiffness: of the spring.
        unit: stiffness of the path to a wave.
        softness: reach of the push where the constraint is kept [m].
    """
    spare = jnp.minimum(spare, _FAR)
    root = jnp.sqrt((stiffness * spare) ** 2 + 4 * stiffness * unit * softness * softness)
    larger = (root + jnp.abs(stiffness * spare)) / 2
    push = jnp.where(spare > 0, stiffness * unit * softness * softness / larger, larger)
    return push, stiffness * push / root
