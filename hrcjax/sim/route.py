"""The route of the arm: the reference motion of tool and joints along a path, by the length travelled."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.plan import PathCurve, PathResult, equally_spaced, path_curve
from hrcjax.robot import Arm, tool_frame
from hrcjax.sim.cell import TOOL_REACH
from hrcjax.sim.joints_along import joints_along
from hrcjax.typing import Array, Float, Joints, Matrix3, Scalar, Vector3

JOINT_LENGTH = 0.1
"""Length that a joint's radian counts in the length of a route, so that a turn in place takes time too [m/rad]."""


class Route(eqx.Module):
    """A path with the arm's joints. Its length counts tool and joints: dl^2 = |dx|^2 + (JOINT_LENGTH |dq|)^2."""

    curve: PathCurve
    """Tool point and the two points `TOOL_REACH` along its x and y axes [m], then joints [rad], by the length travelled."""
    ratio: Float[Array, "waypoint"]
    """U_rep / U_att at equally spaced places, from start to goal [1]."""
    end: Float[Array, "3 3"]
    """The three tool points at the goal [m]."""

    @property
    def length(self) -> Float[Array, ""]:
        """Length of the route [m]."""
        return self.curve.length

    def ratio_at(self, s: Scalar) -> Float[Array, ""]:
        """U_rep / U_att after the length s, linear between waypoints [1]."""
        count = self.ratio.shape[0] - 1
        u = jnp.clip(s / jnp.where(self.length > 0, self.length, 1) * count, 0, count)
        index = jnp.minimum(u.astype(jnp.int32), count - 1)
        low, high = self.ratio[index], self.ratio[index + 1]
        return low + (u - index.astype(u.dtype)) * (high - low)


def tool_axes(x: Vector3, R: Matrix3, reach: float = TOOL_REACH) -> Float[Array, "3 3"]:
    """The tool point and the points `reach` along its x and y axes: three goal points that fix a pose [m]."""
    return x + reach * jnp.stack([jnp.zeros_like(x), R[:, 0], R[:, 1]])


def make_route(arm: Arm, q_start: Joints, path: PathResult) -> Route:
    """The route along a path; where the planner gave no joints, they follow the tool with the orientation of the start."""
    if path.joints is None:
        joints = joints_along(arm, q_start, path.waypoints)
        measured = equally_spaced(jnp.concatenate([path.waypoints, JOINT_LENGTH * joints], axis=1))
        joints = measured[:, 3:] / JOINT_LENGTH
    else:
        joints = path.joints
        measured = jnp.concatenate([path.waypoints, JOINT_LENGTH * joints], axis=1)

    def points(q: Joints) -> Float[Array, "9"]:
        R, x = tool_frame(arm, q)
        return tool_axes(x, R).reshape(-1)

    tool = jax.vmap(points)(joints)
    curve = path_curve(jnp.concatenate([tool, joints], axis=1), measured)
    slow = jnp.zeros_like(joints[:, 0]) if path.ratio is None else path.ratio
    return Route(curve, slow, tool[-1].reshape(3, 3))
