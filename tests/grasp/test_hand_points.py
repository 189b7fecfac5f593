"""Points that ride on the gripper, against the chain's own points and by differences."""

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.point_motion import PointMotion
from hrcjax.grasp.gripper import Gripper
from hrcjax.grasp.hand_points import hand_points, riding_points
from hrcjax.grasp.reach import arm_with_gripper
from hrcjax.policy import turn
from hrcjax.robot import load_arm, point_motion, tool_frame

ARM = arm_with_gripper(load_arm(), Gripper())


def test_they_move_as_points_of_the_last_link() -> None:
    offsets = np.array([[0.01, -0.03, 0.0], [0.0, 0.05, -0.06], [-0.02, 0.0, 0.011]])
    q, qd = jnp.asarray([0.3, -1.2, 1.4, -1.5, -1.2, 0.4]), jnp.asarray([0.5, -0.3, 0.8, 0.2, -0.9, 0.7])

    @jax.jit
    def both(q: jax.Array, qd: jax.Array) -> tuple[PointMotion, PointMotion]:
        on_link = ARM.tool_offset + offsets @ np.asarray(ARM.tool_axes).T
        places = np.concatenate([ARM.tool_offset[None], on_link])
        moving = point_motion(ARM.chain, q, qd, (ARM.tool_link,) * 4, places)
        tool = jax.tree.map(lambda a: a[0], moving)
        frame = turn(lambda at: tool_frame(ARM, at)[0], q, qd)
        return riding_points(tool, frame, jnp.asarray(offsets)), jax.tree.map(lambda a: a[1:], moving)

    ours, theirs = both(q, qd)
    for name in ("x", "xd", "J", "Jd_qd"):
        np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), atol=1e-9, err_msg=name)


def test_the_fingers_open_and_the_palm_does_not() -> None:
    gripper = Gripper()
    closed, opened = (hand_points(gripper, w, jnp.dtype("float64")) for w in (0.0, 0.06))
    moved = np.asarray(opened.offsets - closed.offsets)
    fingers = np.abs(moved[:, 1]) > 0
    np.testing.assert_allclose(np.abs(moved[fingers, 1]), 0.03)
    assert fingers.sum() == (gripper.spheres()[1] != 0).sum()
    inner = np.asarray(opened.offsets)[fingers, 1]
    assert (np.sign(moved[fingers, 1]) == np.sign(inner)).all()  # outwards
    palm = np.asarray(opened.offsets)[~fingers, 2]
    assert palm.max() < -gripper.length and palm.min() > -gripper.length - 2 * gripper.palm[2]
    assert -gripper.length - 2 * gripper.palm[2] - palm.min() < 1e-9 - 0.5 * gripper.palm[0]  # to its back
