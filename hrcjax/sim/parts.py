"""The interfaces of the exchangeable parts of a cell.

A part is a function, or a few that belong together. Its first argument is its own parameters: `Params.plan`, `Params.field`,
`Params.policy` or `Params.safety`, any pytree of floats whose leaves a sweep and a gradient access by their dotted names.
The guards are in the control tick, outside of the parts: commands and readings that are not finite, joint limits, the speed
governor. No part can disable them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax.numpy as jnp

from hrcjax.geom.point_motion import PointMotion
from hrcjax.numerics import safe_norm
from hrcjax.plan import PathResult, PlanParams, PotentialParams, judge
from hrcjax.policy import JointLimits
from hrcjax.robot import Arm
from hrcjax.safety import ContactMobility, SafetyDecision, SsmParams
from hrcjax.sim.sensing import Frames
from hrcjax.typing import Array, Bool, Float, Joints, Scalar, Vector3
from hrcjax.world import Scene, obstacle_distances


class Task(eqx.Module):
    """A planning problem: the path of an arm from start to goal among known obstacles."""

    scene: Scene
    """Start, goal, bounds and obstacles: the task-space map."""
    q_start: Joints
    """Joint positions at the start [rad]."""
    potential: PotentialParams
    """The potential field: `Params.potential`."""
    arm: Arm = eqx.field(static=True)
    """The arm."""

    def distances(self, x: Vector3) -> Float[Array, "obstacle"]:
        """Signed distance from x to every obstacle [m]; an absent one is far away."""
        return obstacle_distances(self.scene, x)


PlanFn = Callable[[Any, Task], PathResult]
"""(Params.plan, task) -> the path. `path_through` builds the result from the tool's waypoints; the joints then follow the tool with
the orientation of the start."""


def path_through(task: Task, waypoints: Float[Array, "waypoint 3"]) -> PathResult:
    """A path with its length, bending energy and clearance; "clear" means that the tool point touches no obstacle.

    Args:
        waypoints: from start to goal, no two alike, at least 4 [m].
    """
    touching = PlanParams(potential=PotentialParams(zeta=1.0))
    scene = task.scene
    return judge(touching, waypoints, task.distances, scene.radius, scene.lower, scene.upper)


class Fields(eqx.Module):
    """Fields fitted to all frames of a world, shared by all settings with the same field parameters."""

    static: Any
    """Any pytree that does not depend on time, such as the field of the scene without the person."""
    moving: Any
    """Any pytree whose leaves have one row per frame; a tick gets the row of the newest frame."""


class Reading(eqx.Module):
    """Reading of the field at one point. Gradients point away from the surface.

    Of people there may be one surface, of shape (), or some near ones in different directions, of shape (surface,), the
    nearest first.
    """

    distance: Float[Array, "*point"]
    """Distance to the nearest surface, of obstacles or people [m]."""
    gradient: Float[Array, "*point 3"]
    """Its gradient [1]."""
    person_distance: Float[Array, "*surface"]
    """Distance to the person, or to all moving points; should be a lower bound of the true one. Finite: about 10 m
    if nobody is present [m]."""
    person_gradient: Float[Array, "*surface 3"]
    """Its gradient; 0 where there is no surface [1]."""
    standing_distance: Float[Array, "*point"] | None = None
    """Distance to what stands, without people; None: that to everything counts [m]."""
    standing_gradient: Float[Array, "*point 3"] | None = None
    """Its gradient [1]. Between two surfaces it is short, and has no direction: there the whole speed of a point counts as approach."""


def unit_where_long(g: Float[Array, "*point 3"]) -> Float[Array, "*point 3"]:
    """Gradients of at least length 1/2 as unit vectors; shorter ones have no direction and stay [1]."""
    size = safe_norm(g)[..., None]
    return jnp.where(size < 0.5, g, g / jnp.where(size < 0.5, 1.0, size))


FitFn = Callable[[Any, Frames], Fields]
"""(Params.field, frames) -> fields."""
ReadFn = Callable[[Any, Fields, Vector3], Reading]
"""(Params.field, fields with the row of one frame, point [m]) -> reading of one point."""


@dataclass(frozen=True)
class FieldPart:
    """A distance field: fitted once, read at every tick."""

    fit: FitFn
    read: ReadFn
    unit_gradients: bool = True
    """Whether the policy gets the gradient of the distance to the person as a unit vector, wherever it is at least 1/2 long.
    Approach and speed governor always measure along the unit vector: a shorter one would let the arm approach too fast."""


class ArmMotion(eqx.Module):
    """The measured state of the arm."""

    q: Joints
    """Joint positions [rad]."""
    qd: Joints
    """Joint speeds [rad/s]."""
    tool: PointMotion
    """Tool point, and the points `TOOL_REACH` along its x and y axes."""
    body: PointMotion
    """Centres of the control spheres."""


class Goal(eqx.Module):
    """Reference motion of the three tool points."""

    x: Float[Array, "goal 3"]
    """Positions [m]."""
    xd: Float[Array, "goal 3"]
    """Velocities [m/s]."""
    xdd: Float[Array, "goal 3"]
    """Accelerations [m/s^2]."""
    posture: Joints
    """Preferred joint positions, for redundancy [rad]."""
    end: Vector3
    """The goal of the task, where the tool arrives [m]."""
    potential: PotentialParams
    """The potential field: `Params.potential`."""


class Clearance(eqx.Module):
    """Distances of the control spheres."""

    distance: Float[Array, "point"]
    """Distance of each sphere's surface to the nearest surface; negative inside [m]."""
    gradient: Float[Array, "point 3"]
    """Gradient of that distance: away from the obstacle [1]."""
    person_distance: Float[Array, "point"]
    """Distance to the nearest person, less the sphere's radius and `COVER_MARGIN` [m]."""
    person_gradient: Float[Array, "point 3"]
    """Gradient of that distance: away from the person [1]."""
    standing_distance: Float[Array, "point"]
    """Distance of each sphere's surface to what stands, without people; to everything, where the field does not tell them
    apart [m]."""
    standing_gradient: Float[Array, "point 3"]
    """Its gradient, of length 1 where it has a direction [1]."""


PolicyFn = Callable[[Any, ArmMotion, Goal, Clearance, JointLimits], Joints]
"""(Params.policy, arm, goal, clearance, limits) -> desired joint acceleration [rad/s^2]. It need not respect the limits."""


class BodyRows(eqx.Module):
    """What the body of a person, followed from image to image, says at every row of a `Separation`."""

    counts: Bool[Array, "row"]
    """Where the track is sure, and the row's surface lies on the body; elsewhere the speed of a person is to be assumed."""
    v_h: Float[Array, "row part"]
    """Bound of the speed of every part of the body towards the row's point when the image was taken [m/s]."""
    beyond: Float[Array, "row part"]
    """How much farther the part is than the row's distance, at least [m]."""
    distance: Float[Array, "row"]
    """To the nearest part of the body, of the row that is nearest of its point; far of others and without a sure track [m]."""
    head_distance: Float[Array, "point"]
    """Of every control point's surface to the head, until now; far without a sure track [m]."""
    head_gradient: Float[Array, "point 3"]
    """Gradients of these distances; 0 without a sure track [1]."""
    gain: Scalar
    """How much faster a person may become: see `BodyParams.human_acceleration` [m/s^2]."""


class Separation(eqx.Module):
    """Input of a safety monitor in one tick. A row is a control point and one of the surfaces of people near it."""

    distance: Float[Array, "row"]
    """Distance of every control point's surface to the person [m]."""
    approach: Float[Array, "row"]
    """Speed of every control point towards the person [m/s]."""
    age: Float[Array, ""]
    """Age of the person data; infinite: there are none [s]."""
    valid: Bool[Array, ""]
    """False where the map of the scene exceeded a capacity."""
    guarded: Bool[Array, ""]
    """True where a camera is missing, or somebody may be hidden who was measured before: no full speed."""
    dt: Scalar
    """Time since the last tick [s]."""
    mobility: ContactMobility | None = None
    """What a contact at every row feels of the arm's mass; None: the cell does not ask for it (`Cell.contact_mass`)."""
    nearest: Float[Array, "row"] | None = None
    """Distance of the row's control point to the nearest of its surfaces; None: every surface counts by its own distance alone, as where
    a point has one surface [m]."""
    body: BodyRows | None = None
    """The body of the person; None: the cell does not follow it (`Cell.body`)."""


@dataclass(frozen=True)
class SafetyPart:
    """A safety monitor with memory."""

    start: Callable[[Any], Any]
    """(dtype) -> the memory before the first tick: any pytree."""
    decide: Callable[[Any, Any, Separation], tuple[Any, SafetyDecision]]
    """(Params.safety, memory, separation) -> memory after the tick, and the decision for it."""
    yardstick: Callable[[Any], SsmParams] = lambda params: SsmParams()
    """(Params.safety) -> the speed-and-separation parameters that the metrics use."""


def all_finite(*arrays: Array) -> Bool[Array, ""]:
    """Whether every number is finite."""
    return jnp.all(jnp.stack([jnp.all(jnp.isfinite(array)) for array in arrays]))
