"""An object at rest on the table, with the gripper above it, as a MuJoCo model."""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from hrcjax.grasp.gripper import Gripper
from hrcjax.grasp.gripper_mjcf import gripper_xml

from .objects import Shape, object_xml

WORK = (0.0, 0.5)
"""Middle of the places where objects stand, before the arm's base [m]."""
SPREAD = 0.04
"""Half the range of these places along x and y [m]."""
TABLE_FRICTION = 0.5
"""Between object and table [1]."""
TIMESTEP = 0.001
"""[s]"""
AWAY = (0.0, 0.0, 1.0)
"""Where the gripper waits [m]."""
REST_SECONDS = 0.6
"""In which the object comes to rest [s]."""


@dataclass(frozen=True)
class Scene:
    """A model and its state with the object at rest."""

    model: mujoco.MjModel
    data: mujoco.MjData

    @property
    def body(self) -> int:
        """The object."""
        return int(mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, "object"))

    @property
    def geoms(self) -> NDArray:
        """Parts of the object."""
        return np.flatnonzero(self.model.geom_bodyid == self.body)

    def centre(self) -> NDArray:
        """Centre of mass of the object [m]."""
        return np.array(self.data.xipos[self.body])


def scene_xml(shape: Shape, pose: tuple[NDArray, float, int], gripper: Gripper, friction: float | None = None) -> str:
    """MJCF of table, object and gripper.

    Args:
        pose: place on the table (2) [m], yaw [rad], number of the rest.
        friction: of the pads; None: the gripper's own [1].
    """
    place, yaw, rest = pose
    at = (float(place[0]), float(place[1]), 0.11)
    assets, body = object_xml(shape, at, yaw, shape.rests[rest % len(shape.rests)], TABLE_FRICTION)
    hand, beside = gripper_xml(gripper, friction)
    return f"""<mujoco>
<compiler angle="radian" autolimits="true"/>
<option timestep="{TIMESTEP}" integrator="implicitfast" cone="elliptic" impratio="20" gravity="0 0 -9.81"/>
<asset>{assets}</asset>
<worldbody>
<geom name="table" type="plane" size="1 1 0.1" friction="{TABLE_FRICTION} 0.002 0.0002" condim="4"/>
{body}
{hand}
</worldbody>
{beside}
</mujoco>"""


def make_scene(shape: Shape, pose: tuple[NDArray, float, int], gripper: Gripper, friction: float | None = None) -> Scene:  # fmt: skip
    """The object lowered onto the table and at rest, the gripper out of the way."""
    model = mujoco.MjModel.from_xml_string(scene_xml(shape, pose, gripper, friction))
    data = mujoco.MjData(model)
    scene = Scene(model, data)
    hand = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "hand")
    data.mocap_pos[0] = AWAY
    first = model.jnt_qposadr[model.body_jntadr[hand]]
    data.qpos[first : first + 3] = AWAY
    mujoco.mj_forward(model, data)
    down = min(_lowest(scene, g) for g in scene.geoms)
    address = model.jnt_qposadr[model.body_jntadr[scene.body]]
    data.qpos[address + 2] += 0.001 - down
    for _ in range(round(REST_SECONDS / TIMESTEP)):
        mujoco.mj_step(model, data)
    data.qvel[:] = 0
    data.qacc_warmstart[:] = 0
    mujoco.mj_forward(model, data)
    return scene


def _lowest(scene: Scene, geom: int) -> float:
    """Height of the lowest point of a part over the table [m]."""
    fromto = np.zeros(6)
    table = mujoco.mj_name2id(scene.model, mujoco.mjtObj.mjOBJ_GEOM, "table")
    return float(mujoco.mj_geomDistance(scene.model, scene.data, table, int(geom), 1.0, fromto))


def draw_poses(seed: int | list[int], count: int) -> list[tuple[NDArray, float, int]]:
    """Places, yaws and rests of one shape."""
    chance = np.random.default_rng(seed)
    return [(np.array(WORK) + chance.uniform(-SPREAD, SPREAD, 2), chance.uniform(-np.pi, np.pi), k) for k in range(count)]  # fmt: skip
