"""The cell and its world: arm, scene, person, and the camera's frames of them."""

from dataclasses import dataclass
from typing import Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from hrcjax.body import BodyParams
from hrcjax.field.grid import GridLayout
from hrcjax.map import MapLayout
from hrcjax.presence import CELL_VOXELS, VoxelLayout
from hrcjax.robot import Arm
from hrcjax.sim.default_parts import ARM_PLANNER, GP_FIELD, SEPARATION_MONITOR, rmp_policy
from hrcjax.sim.parts import FieldPart, PlanFn, PolicyFn, SafetyPart
from hrcjax.sim.sensing import MOVING_CAPACITY, Frames
from hrcjax.sim.survey import SCENE_LAYOUT
from hrcjax.typing import Array, Float, Int, Joints
from hrcjax.world import CAPACITY, Person, Scene

TOOL_REACH = 0.5
"""Distance of the two points that fix the tool's orientation, along its x and y axes (as in the HRI paper's system) [m]."""

CONTACT_MASSES = ("standard", "reflected")
"""Values of `Cell.contact_mass`."""

ARM_GRID = GridLayout((-1.2, -1.2, -0.1), (97, 97, 57), 0.025)
"""Everything that a UR5 reaches, at the map's spacing."""


class World(eqx.Module):
    """One scene with one person, sensed once and shared by all settings."""

    scene: Scene
    """Exact obstacles: ground truth of the metrics, and what the cameras look at."""
    person: Person
    """Exact person: ground truth of the metrics only."""
    frames: Frames
    """The camera's frames: static and moving points, stamps, validity."""
    q_start: Joints
    """Joint angles at the start [rad]."""
    known: Scene
    """The task-space map that the planner is given; unless told otherwise, the exact obstacles."""

    def __init__(
        self, scene: Scene, person: Person, frames: Frames, q_start: Joints, known: Scene | None = None
    ) -> None:
        self.scene, self.person, self.frames, self.q_start = scene, person, frames, q_start
        self.known = scene if known is None else known


@dataclass(frozen=True)
class Cell:
    """Everything static: the arm, the parts, the rates and the sizes of arrays. Programs close over it."""

    arm: Arm
    plan: PlanFn = ARM_PLANNER
    """The planner."""
    field: FieldPart = GP_FIELD
    """The distance field that policy and safety read."""
    policy: PolicyFn = rmp_policy
    """The motion policy."""
    safety: SafetyPart = SEPARATION_MONITOR
    """The safety monitor."""
    ticks: int = 1000
    """Control ticks of an episode."""
    dt: float = 0.008
    """Control period: 125 Hz, as of a UR5 controller [s]."""
    substeps: int = 4
    """Steps of the arm's dynamics in a control period."""
    latency: float = 0.05
    """Time from the exposure of a frame to its use [s]."""
    metric_stride: int = 10
    """Ticks between two evaluations of the exact distances for the metrics."""
    motion: Literal["both", "path", "reactive"] = "both"
    """How the arm moves: the path as reference of policies that may leave it ("both"), the path as planned, where only the clock
    reacts ("path"), or policies alone, without a path ("reactive"). See `hrcjax.sim.guide`."""
    contact_mass: str = "standard"
    """The mass of the arm in a contact, which bounds the speed in red and in a stop: half of the arm and the payload, as the standard
    has it ("standard"), or what a push at the point in the direction of the person feels in this posture ("reflected")."""
    backend: str = "folded"
    """Dynamics of the arm: "folded" or "mjx"."""
    linear_servo: bool = False
    """Derivatives of the joint servo: those that hold while no torque is clipped, which are cheap (the status of a tick tells
    whether one was), or always the exact ones."""
    moving_points: int = MOVING_CAPACITY
    """Capacity of the cloud of moving points, per person. The points nearest to the robot's base are kept; the others are
    farther from it, which bounds their distance."""
    obstacles: int = CAPACITY
    """Obstacles that the planner is given, the first of the scene: its time grows with them."""
    people: int = 1
    """Largest number of people in the cell at once."""
    layout: MapLayout = SCENE_LAYOUT
    """Box, spacing and capacities of the map of what stands; if a capacity is exceeded, the arm holds."""
    grid: GridLayout = ARM_GRID
    """Where the map's distance is sampled for the arm: everything that it can reach."""
    voxels: VoxelLayout = CELL_VOXELS
    """Voxels in which people are followed."""
    body: BodyParams | None = None
    """Follow the body of a person in the images (`hrcjax.body`): where the track is sure, the monitor takes the measured speed of its
    parts in place of an assumed one, the contact speed of the nearest region, and stops near the head. None: none of it."""

    def __post_init__(self) -> None:
        if self.contact_mass not in CONTACT_MASSES:
            raise ValueError(f"contact_mass {self.contact_mass!r}; accepted: {', '.join(CONTACT_MASSES)}")

    @property
    def control_offsets(self) -> np.ndarray:
        """Positions of the control points and the three tool points in their link frames [m]."""
        tool = self.arm.tool_offset + TOOL_REACH * np.stack([np.zeros(3), *self.arm.tool_axes.T[:2]])
        return np.concatenate([self.arm.control_offsets, tool])

    @property
    def times(self) -> np.ndarray:
        """Time at the start of each tick [s]."""
        return np.arange(self.ticks) * self.dt


def newest_frame(
    stamp: Float[Array, "frame"], valid: Array, t: Float[Array, "time"]
) -> tuple[Int[Array, "time"], Float[Array, "time"]]:
    """Index of the newest valid frame with stamp <= t, and its age [s]; no such frame: index 0 and age infinite.

    Args:
        t: latest exposure times of usable frames [s].
    """
    usable = valid[None, :] & (stamp[None, :] <= t[:, None])
    newest = jnp.argmax(jnp.where(usable, stamp[None, :], -jnp.inf), axis=1)
    age = jnp.where(jnp.any(usable, axis=1), t - stamp[newest], jnp.inf)
    return newest.astype(jnp.int32), age
