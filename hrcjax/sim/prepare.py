"""Preparation of a world for episodes: start configuration of the arm, and sensing before and during its motion."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial import KDTree

from hrcjax.body import BodyParams
from hrcjax.field.grid import GridField, fit_grid, grid_nodes
from hrcjax.geom.segment import FAR
from hrcjax.map import sample_map
from hrcjax.presence import VoxelLayout, centres
from hrcjax.robot import Arm, arm_capsules, inverse_kinematics, tool_frame
from hrcjax.sense import FaultSchedule, no_faults
from hrcjax.sense.rig import Rig, exposures
from hrcjax.sim.cell import Cell, World
from hrcjax.sim.scan import scan_postures
from hrcjax.sim.sensing import Frames, sense_sequence
from hrcjax.sim.survey import SenseParams, Survey, survey
from hrcjax.sim.watch import Stage, stage_of
from hrcjax.typing import Array, Float, Int, Joints, PRNGKeyArray, Vector3
from hrcjax.world import Person, Scene, capsules_obstacle_distances

NOMINAL = 6.0
"""Time of the nominal robot's motion in the images, or 0.6 of a shorter episode [s]."""
LEAD = 0.2
"""Time before the episode from which on the cameras watch: images are there when it starts [s]."""
POSE_ERROR = (1e-3, 1e-2)
"""Tolerances of position [m] and rotation [rad] for a pose to count as reached."""


def posture_at(cell: Cell, x: Vector3) -> Joints:
    """Joint positions with the tool at x pointing down, elbow up as in the home posture [rad].

    Raises:
        ValueError: out of reach, or only beyond the range of a joint. Needs concrete values: call it outside jit.
    """
    arm = cell.arm
    q, position_error, rotation_error = _reach(arm, x)
    if not (position_error < POSE_ERROR[0] and rotation_error < POSE_ERROR[1]):
        place = ", ".join(f"{v:.3f}" for v in np.asarray(x))
        raise ValueError(
            f"the {arm.variant} can't reach ({place}) m with the tool down; nearest {position_error:.3f} m away"
        )
    beyond = np.maximum(np.asarray(q) - arm.q_max, arm.q_min - np.asarray(q))
    if beyond.max() > 0:
        place, joint = ", ".join(f"{v:.3f}" for v in np.asarray(x)), int(np.argmax(beyond)) + 1
        raise ValueError(
            f"the {arm.variant} reaches ({place}) m with the tool down only {beyond.max():.3f} rad beyond the range of joint {joint}"
        )
    return q


def check_start(cell: Cell, scene: Scene, q: Joints) -> None:
    """Refuses a start at which the arm touches an obstacle. Needs concrete values: call it outside jit. At the goal the paper's scene
    with grown obstacles has the arm inside one: that is for the planner to say.

    Raises:
        ValueError: which link, and how deep.
    """
    distances = np.array(_to_obstacles(cell.arm, scene, q))
    distances[np.asarray(cell.arm.capsule_links) < 0] = FAR
    link, obstacle = np.unravel_index(int(distances.argmin()), distances.shape)
    if distances[link, obstacle] < 0:
        raise ValueError(
            f"at the start the {cell.arm.capsule_names[link]} of the arm is {-1e3 * distances[link, obstacle]:.0f} mm inside obstacle "
            f"{obstacle + 1}; accepted is a scene in which it touches none"
        )


def frame_stamps(cell: Cell, rig: Rig) -> tuple[np.ndarray, np.ndarray]:
    """When the cameras take images, from shortly before the episode to its end [s], and which of them."""
    return exposures(rig.rates, -LEAD, cell.ticks * cell.dt)


def nominal_motion(
    q_start: Joints, q_goal: Joints, t: Float[Array, "frame"], duration: float
) -> Float[Array, "frame joint"]:
    """Nominal robot motion in the camera images: straight in joint space from start to goal with minimum jerk [rad].

    Sensing is shared by all settings of a world, so the images show this robot and not that of each setting.
    """
    u = jnp.clip(t / duration, 0.0, 1.0)[:, None]
    return q_start + (10 * u**3 - 15 * u**4 + 6 * u**5) * (q_goal - q_start)


class Surveyed(eqx.Module):
    """A cell after its set-up, with the people who will come, before any image of them."""

    scene: Scene
    """Exact obstacles: for planner and metrics."""
    q_start: Joints
    """Joint positions at the start [rad]."""
    survey: Survey
    """What is known of the empty cell."""
    field: GridField
    """Distance to everything that stands."""
    hidden: GridField | None
    """Distance to space where somebody may be unseen; None: nobody is there."""
    stage: Stage
    """What the cameras look at."""


def survey_world(
    cell: Cell,
    scene: Scene,
    person: Person,
    rig: Rig,
    key: PRNGKeyArray,
    params: SenseParams | None = None,
    faults: FaultSchedule | None = None,
) -> Surveyed:
    """The set-up: the empty cell surveyed by all cameras.

    Args:
        rig: the cameras.
        faults: of the stationary cameras, later; None: they work.

    Raises:
        ValueError: the start is out of the arm's reach, or the arm touches an obstacle there.
    """
    sense: SenseParams = eqx.tree_at(lambda p: p.delay, SenseParams() if params is None else params, cell.latency)
    q_start = posture_at(cell, scene.start)
    check_start(cell, scene, q_start)
    postures = scan_postures(cell.arm, scene, q_start)
    surveyed = survey(cell.arm, cell.layout, cell.voxels, rig, scene, postures, key, sense)
    field = scene_field(cell, sense, surveyed)
    stage = stage_for(rig, scene, person, no_faults(rig.count, q_start.dtype) if faults is None else faults)
    return Surveyed(scene, q_start, surveyed, field, hidden_field(cell, sense, surveyed), stage)


def make_world(
    cell: Cell,
    scene: Scene,
    person: Person,
    rig: Rig,
    key: PRNGKeyArray,
    params: SenseParams | None = None,
    faults: FaultSchedule | None = None,
    known: Scene | None = None,
) -> World:
    """Sense a scene with a person in it, once for all settings: the set-up, then every image of the episode.

    Args:
        rig: the cameras.
        faults: of the stationary cameras; None: they work.
        known: the obstacles that the planner is told of; None: those of the scene.

    Raises:
        ValueError: start or goal out of the arm's reach, or the arm touches an obstacle at the start.
    """
    params = SenseParams() if params is None else params
    survey_key, frame_key = jax.random.split(key)
    found = survey_world(cell, scene, person, rig, survey_key, params, faults)
    q_goal = posture_at(cell, scene.goal)
    stamps, cameras = frame_stamps(cell, rig)
    times, cameras = jnp.asarray(stamps, q_goal.dtype), jnp.asarray(cameras)
    q = nominal_motion(found.q_start, q_goal, times, min(0.6 * cell.ticks * cell.dt, NOMINAL))
    sizes = (cell.voxels, cell.moving_points * cell.people, cell.latency)
    frames = _sense(cell.arm, sizes, found, q, times, cameras, frame_key, params, cell.body)
    return World(scene, person, frames, found.q_start, known)


def scene_field(cell: Cell, params: SenseParams, surveyed: Survey) -> GridField:
    """The distance field of the set-up's map, sampled for the arm; with unseen space as an obstacle, if so told."""
    values = sample_map(cell.layout, surveyed.map, params.frame.map.ratio, cell.grid)
    if params.unseen_obstacle:
        values = jnp.minimum(values, unseen_distance(cell, surveyed))
    return fit_grid(cell.grid, values)


def unseen_distance(cell: Cell, surveyed: Survey) -> Float[Array, "x y z"]:
    """Distance of the grid's nodes to the middles of the nearest unseen voxels, less half an edge [m]."""
    unseen, voxels = np.asarray(surveyed.unseen), cell.voxels
    dtype = surveyed.map.levels[0].rows.dtype
    if not unseen.any():
        return jnp.full(cell.grid.shape, FAR, dtype)
    middles = np.asarray(centres(voxels, dtype))[unseen]
    d = KDTree(middles).query(np.asarray(grid_nodes(cell.grid, dtype)), workers=-1)[0]
    return jnp.asarray((d - 0.5 * voxels.edge).reshape(cell.grid.shape), dtype)


def hidden_field(cell: Cell, params: SenseParams, surveyed: Survey) -> GridField | None:
    """Distance to unseen space, if somebody may be there."""
    return fit_grid(cell.grid, unseen_distance(cell, surveyed)) if params.unseen_person else None


stage_for = jax.jit(stage_of)


@partial(jax.jit, static_argnums=(0, 1, 8))
def _sense(
    arm: Arm,
    sizes: tuple[VoxelLayout, int, float],
    known: Surveyed,
    q: Float[Array, "frame joint"],
    stamps: Float[Array, "frame"],
    cameras: Int[Array, "frame"],
    key: PRNGKeyArray,
    params: SenseParams,
    body: BodyParams | None = None,
) -> Frames:
    """One compiled program for all worlds of one size: without jit this would take minutes."""
    robot = jax.vmap(lambda one: arm_capsules(arm, one))(q)
    return sense_sequence(
        *sizes, known.survey, known.field, known.stage, robot, stamps, cameras, key, params, known.hidden, body
    )  # fmt: skip


@partial(jax.jit, static_argnums=0)
def _to_obstacles(arm: Arm, scene: Scene, q: Joints) -> Float[Array, "capsule obstacle"]:
    return capsules_obstacle_distances(scene, arm_capsules(arm, q))


@partial(jax.jit, static_argnums=0)
def _reach(arm: Arm, x: Vector3) -> tuple[Joints, Array, Array]:
    """Joint positions with the tool down at x, and the errors of position [m] and rotation [rad]."""
    home = jnp.asarray(arm.home, x.dtype)
    _, p_home = tool_frame(arm, home)
    turn = jnp.arctan2(x[1], x[0]) - jnp.arctan2(p_home[1], p_home[0])
    guess = home.at[0].add(jnp.arctan2(jnp.sin(turn), jnp.cos(turn)))
    R, _ = tool_frame(arm, guess)
    return inverse_kinematics(arm, R, x, guess)
