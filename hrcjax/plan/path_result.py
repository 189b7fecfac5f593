"""A path, what it costs, and which of its constraints it keeps."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.bending_energy import bending_energy
from hrcjax.geom.length import length
from hrcjax.plan.curve import path_curve
from hrcjax.plan.params import PlanParams
from hrcjax.plan.potential import DistancesFn
from hrcjax.typing import Array, Bool, Float, Int, Vector3


class PathResult(eqx.Module):
    """A path and what can be said of it."""

    waypoints: Float[Array, "waypoint 3"]
    """Equally spaced points, start and goal among them [m]."""
    length: Float[Array, ""]
    """Length [m]."""
    bending_energy: Float[Array, ""]
    """Bending energy [1/m]."""
    clearance: Float[Array, ""]
    """Smallest distance of the curve from the surface of any obstacle; negative inside [m]."""
    violation: Float[Array, ""]
    """Most that the required distance from an obstacle is missed by; 0 if kept [m]."""
    reached: Bool[Array, ""]
    """Whether the descent of the potential field reached the goal."""
    clear: Bool[Array, ""]
    """Whether the distances required by zeta are kept."""
    inside: Bool[Array, ""]
    """Whether the curve stays within the bounds."""
    joints: Float[Array, "waypoint joint"] | None = None
    """Joint positions at the waypoints, if the whole arm was planned for [rad]."""
    ratio: Float[Array, "waypoint"] | None = None
    """U_rep / U_att at the waypoints, by which the law of motion slows; None: 0 [1]."""
    free: Bool[Array, ""] | None = None
    """Whether no two links touch that are not neighbours; None: not looked at."""

    @property
    def status(self) -> Int[Array, "*batch"]:
        """Bits: 1 the descent reached the goal, 2 the required distances are kept, 4 within the bounds, 8 no link touches
        another; without 1 the path is as good, as other guesses led to it."""
        bits = [self.reached, self.clear, self.inside, jnp.ones_like(self.clear) if self.free is None else self.free]
        return sum((bit.astype(jnp.int32) << k for k, bit in enumerate(bits)), jnp.zeros_like(bits[0], jnp.int32))


def required_distance(params: PlanParams, radius: Float[Array, "obstacle"]) -> Float[Array, "obstacle"]:
    """Smallest surface distance allowed to each obstacle: (zeta - 1) radius, so that its centre is zeta radius away
    [m]."""
    return (params.potential.zeta - 1) * radius


def judge(
    params: PlanParams,
    waypoints: Float[Array, "waypoint 3"],
    distances: DistancesFn,
    radius: Float[Array, "obstacle"],
    lower: Vector3,
    upper: Vector3,
    reached: Bool[Array, ""] | None = None,
) -> PathResult:
    """What can be said of a path: distances are measured on its smooth curve, four times to a segment."""
    curve = path_curve(waypoints)
    places = curve.length * jnp.linspace(0, 1, 4 * (waypoints.shape[0] - 1) + 1, dtype=waypoints.dtype)
    points = jax.vmap(curve.point)(places)
    gap = jax.vmap(distances)(points)
    violation = jnp.maximum(jnp.max(required_distance(params, radius) - gap, initial=0.0), 0)
    outside = jnp.max(jnp.maximum(lower - points, points - upper))
    return PathResult(
        waypoints,
        length(waypoints),
        bending_energy(waypoints),
        jnp.min(gap, initial=jnp.inf),
        violation,
        jnp.asarray(True) if reached is None else reached,
        violation <= params.path.tolerance,
        outside <= params.path.tolerance,
    )
