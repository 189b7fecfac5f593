"""Names of shapes. Axes are named by words: point, joint, waypoint, time, capsule, frame."""

from collections.abc import Callable

from jaxtyping import Array, ArrayLike, Bool, Float, Int, PRNGKeyArray, UInt

Scalar = Float[ArrayLike, ""]
Vector3 = Float[Array, "3"]
Matrix3 = Float[Array, "3 3"]
Points = Float[Array, "point 3"]
Mask = Bool[Array, "point"]
Joints = Float[Array, "joint"]

DistanceFn = Callable[[Vector3], Float[Array, ""]]
"""A field of distance: point [m] -> distance [m]. All that policies, planners and safety know of perception."""

__all__ = [
    "Array",
    "ArrayLike",
    "Bool",
    "DistanceFn",
    "Float",
    "Int",
    "Joints",
    "Mask",
    "Matrix3",
    "PRNGKeyArray",
    "Points",
    "Scalar",
    "UInt",
    "Vector3",
]  # fmt: skip
