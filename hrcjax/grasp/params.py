"""The numbers of choosing a grasp."""

import equinox as eqx

from hrcjax.field import FieldParams
from hrcjax.typing import Scalar


def object_field() -> FieldParams:
    """For points about 6 mm apart: a planarity of 0.9 then means radii over 2.5 cm of a ball, 1.7 cm of a cylinder."""
    return FieldParams(length_scale=0.0055, noise=0.05)


class GraspParams(eqx.Module):
    """What candidates are chosen by. Our choice where no source is named."""

    field: FieldParams = eqx.field(default_factory=object_field)
    """Field of the object's points. Its length scale decides what counts as curved: planarity is 1 - 2 l^2 / R^2 on a ball."""
    least_planarity: Scalar = 0.9
    """Of both contacts; the HRI paper's authors keep 0.9 [1]."""
    friction: Scalar = 0.5
    """Coefficient of friction that a grasp must hold with: the closing axis lies within its cones at both contacts [1]."""
    least_width: Scalar = 0.008
    """Between the contacts; less is noise about one surface [m]."""
    clearance: Scalar = 0.008
    """Between pads and contacts on the approach, as far as the stroke allows [m]."""
    least_clearance: Scalar = 0.003
    """And at least [m]."""
    margin: Scalar = 0.003
    """Least distance of the gripper's body from object and table, on the approach and at the grasp [m]."""
    approach: Scalar = 0.1
    """Length of the straight approach; at most twice that of the fingers, or places between the checks are missed [m]."""
    least_down: Scalar = 0.3
    """Least cosine between the approach and straight down [1]."""
    weight_cone: Scalar = 1.0
    """Weight of how far within the cones of friction the closing axis is, from 0 at their edge to 1 [1]."""
    weight_planarity: Scalar = 0.5
    """Weight of the lesser planarity of the contacts, from 0 at the least one allowed to 1 [1]."""
    weight_centre: Scalar = 1.0
    """Weight of how near the middle of the grasp is to that of the object, from 1 down by 1 for every `arm_length` [1]."""
    arm_length: Scalar = 0.04
    """See `weight_centre`: with it weight turns the object in the pads [m]."""
    weight_down: Scalar = 0.5
    """Weight of the cosine between the approach and straight down [1]."""
