"""The gripper's body as spheres and as MJCF."""

import mujoco
import numpy as np
import pytest

from hrcjax.grasp.gripper import Gripper
from hrcjax.grasp.gripper_mjcf import gripper_xml


def compiled(gripper: Gripper, friction: float | None = None) -> mujoco.MjModel:
    bodies, beside = gripper_xml(gripper, friction)
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 0"/><worldbody>{bodies}</worldbody>{beside}</mujoco>'
    )


def test_pads_face_each_other_at_the_opening() -> None:
    gripper = Gripper()
    model = compiled(gripper)
    data = mujoco.MjData(model)
    data.qpos[model.jnt_qposadr[[model.joint("left").id, model.joint("right").id]]] = 0.02
    mujoco.mj_forward(model, data)
    for name, side in (("left_pad", 1), ("right_pad", -1)):
        inner = data.geom(name).xpos[1] - side * model.geom(name).size[1]
        assert inner == pytest.approx(side * 0.02, abs=1e-9)
    tip = data.geom("left_finger").xpos[2] + model.geom("left_finger").size[2]
    assert tip - 0.5 == pytest.approx(gripper.pad[1])


def test_spheres_are_within_the_model_and_cover_the_fingers() -> None:
    gripper = Gripper()
    centres, moved, radii = gripper.spheres()
    at = centres + np.outer(moved * 0.03, [0, 1, 0])
    grid = np.stack(np.meshgrid(np.linspace(-1, 1, 9), np.linspace(0, 1, 5), np.linspace(0, 1, 30)), -1).reshape(-1, 3)
    z = gripper.pad[1] - grid[:, 2] * (gripper.pad[1] + gripper.length)
    finger = np.column_stack([grid[:, 0] * gripper.pad[0], 0.03 + grid[:, 1] * gripper.thickness, z])
    least = (np.linalg.norm(finger[:, None] - at[None], axis=2) - radii).min(axis=1)
    assert least.max() < 0.003  # corners stand out by less than the margin
    assert 0 <= (at[:, 2] + radii).max() - gripper.pad[1] < 0.0015
    assert len({len(centres), len(moved), len(radii)}) == 1


def test_closed_the_fingers_press_with_the_stated_force_at_most() -> None:
    gripper = Gripper(force=25.0)
    model = compiled(gripper, 0.3)
    assert model.geom("left_pad").friction[0] == pytest.approx(0.3)
    data = mujoco.MjData(model)
    data.mocap_pos[0] = [0, 0, 0.5]
    data.ctrl[:] = gripper.stroke / 2
    for _ in range(3):
        mujoco.mj_step(model, data)
    assert np.abs(data.actuator_force).max() == pytest.approx(25.0)
