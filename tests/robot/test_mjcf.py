"""The model text: what MuJoCo makes of it, against the table."""

import mujoco
import numpy as np
import pytest

from hrcjax.robot import arm_table, ur_xml


def dh(a: float, d: float, alpha: float, q: float) -> np.ndarray:
    """Standard Denavit-Hartenberg transform, from the textbook."""
    c, s, ca, sa = np.cos(q), np.sin(q), np.cos(alpha), np.sin(alpha)
    return np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])


@pytest.mark.parametrize("variant", ["ur5", "ur5e"])
def test_bodies_are_the_frames_of_the_table(variant):
    table = arm_table(variant)
    model = mujoco.MjModel.from_xml_string(ur_xml(variant))
    data = mujoco.MjData(model)
    for seed in range(5):
        q = np.random.default_rng(seed).uniform(-3, 3, 6)
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        T = np.eye(4)
        for i in range(6):
            T = T @ dh(table.a[i], table.d[i], table.alpha[i], q[i])
            np.testing.assert_allclose(data.body(f"frame_{i + 1}").xpos, T[:3, 3], atol=1e-12)
            np.testing.assert_allclose(data.body(f"frame_{i + 1}").xmat.reshape(3, 3), T[:3, :3], atol=1e-12)
            com = T @ [*table.com[i], 1]
            np.testing.assert_allclose(data.body(f"frame_{i + 1}").xipos, com[:3], atol=1e-12)
            turned = data.body(f"frame_{i + 1}").ximat.reshape(3, 3)
            inertia = turned @ np.diag(model.body_inertia[i + 1]) @ turned.T
            np.testing.assert_allclose(inertia, T[:3, :3] @ table.inertia[i] @ T[:3, :3].T, rtol=0, atol=1e-12)
        np.testing.assert_allclose(data.site("tool").xpos, T[:3, 3], atol=1e-12)


def test_model_is_plain(ur5):
    model = ur5.model
    assert (model.nmesh, model.nu, model.nq, model.nsite) == (0, 6, 6, 1)
    assert set(model.geom_type) == {int(mujoco.mjtGeom.mjGEOM_CAPSULE)}
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER
    assert model.opt.gravity.tolist() == [0, 0, -9.81]
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    data.ctrl[:] = 1000.0
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.qfrc_actuator, [150, 150, 150, 28, 28, 28])
    assert data.ncon == 0
    assert data.nefc == 0
    np.testing.assert_allclose(data.site("tool").xmat.reshape(3, 3)[:, 2], [0, 0, -1], atol=1e-12)  # tool down
    np.testing.assert_allclose(model.body_mass[1:], arm_table("ur5").mass)


def test_geoms_are_the_capsules_of_the_table(arm):
    data = mujoco.MjData(arm.model)
    mujoco.mj_forward(arm.model, data)
    for i, name in enumerate(arm.capsule_names):
        geom = arm.model.geom(name)
        assert geom.bodyid[0] == arm.capsule_links[i] + 1
        assert geom.size[0] == arm.capsule_radii[i]
        np.testing.assert_allclose(2 * geom.size[1], np.linalg.norm(arm.capsule_b[i] - arm.capsule_a[i]), atol=1e-12)
        np.testing.assert_allclose(geom.pos, (arm.capsule_a[i] + arm.capsule_b[i]) / 2, atol=1e-12)
