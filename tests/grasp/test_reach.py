"""Grasps within and beyond the reach of a UR5."""

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.grasp.approach import gripper_axes
from hrcjax.grasp.gripper import Gripper
from hrcjax.grasp.reach import arm_with_gripper, reach
from hrcjax.robot import load_arm, tool_frame


def test_the_arm_is_where_the_grasp_is_and_comes_along_the_approach() -> None:
    arm = arm_with_gripper(load_arm(), Gripper())
    up = jnp.asarray([0.0, 0.0, 1.0])
    R = jax.vmap(lambda axis: gripper_axes(axis, 0.3, up))(jnp.asarray([[1.0, 0, 0], [0.6, 0.8, 0], [1.0, 0, 0]]))
    p = jnp.asarray([[0.0, 0.5, 0.05], [0.1, 0.45, 0.04], [0.0, 1.2, 0.05]])
    found = jax.jit(jax.vmap(lambda R, p: reach(arm, R, p, 0.1)))(R, p)
    assert found.ok.tolist() == [True, True, False]
    assert (np.abs(np.asarray(found.q)[:2, 0] - arm.home[0]) < np.pi).all()  # the short way round from home
    for k in (0, 1):
        for q, back in ((found.q[k], 0.0), (found.q_before[k], 0.1)):
            R_tool, at = tool_frame(arm, q)
            np.testing.assert_allclose(at, p[k] - back * R[k][:, 2], atol=1e-3)
            np.testing.assert_allclose(np.asarray(R_tool)[:, 2], np.asarray(R[k])[:, 2], atol=0.01)
            assert abs(np.asarray(R_tool)[:, 1] @ np.asarray(R[k])[:, 1]) > 0.999  # either way round
