"""Keep away: the tool holds a pose, and gives it up as far as a person comes nearer than a set distance.

The goal stands; the distance leaf of the composition (`KeepDistanceParams`, weight above 0) does the rest: the tool slides off along the
person's surface or back, and returns when there is room. Keep the distance above that at which the red zone of the safety layer begins,
0.5 m by default: in it all motion is slowed, the retreat too.
"""

from hrcjax.interact.reference import Reference, ReferenceParams, Tool, led_to
from hrcjax.typing import Scalar, Vector3


def keep_away(params: ReferenceParams, now: Reference, tool: Tool, pose: Vector3, dt: Scalar) -> Reference:
    """The led point after a tick: it goes to the pose, on a short leash, so that a tool which has kept away comes back without haste. It does
    not know of people.

    Args:
        pose: place of the tool point [m].
        dt: length of the tick [s].
    """
    still = now.x * 0
    return led_to(params, now, tool, pose, still, still, dt)
