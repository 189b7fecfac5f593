"""Hands in an image: features of their landmarks, gestures, and commands by votes over frames."""

from hrcjax.hand.classifier import Classifier, calibration_error
from hrcjax.hand.commands import (
    COMMANDS,
    GO,
    HOME,
    NO_COMMAND,
    POINT,
    STOP,
    CommandParams,
    CommandRule,
    CommandState,
    frame_votes,
    initial_commands,
    update_commands,
)
from hrcjax.hand.features import extended_fingers, pair_distances, rule_gesture
from hrcjax.hand.landmarks import (
    BONES,
    CLOSED,
    FINGERS,
    GESTURES,
    LANDMARKS,
    NONE,
    OPEN,
    PALM,
    POINTING,
    WRIST,
)
from hrcjax.hand.pointing import (
    Line,
    Pointed,
    PointingParams,
    PointingState,
    drifts,
    held_covariances,
    held_line,
    held_points,
    initial_pointing,
    line_along,
    pointed_place,
    spread,
    update_pointing,
)

__all__ = [
    "BONES", "CLOSED", "COMMANDS", "FINGERS", "GESTURES", "GO", "HOME", "LANDMARKS", "NONE", "NO_COMMAND", "OPEN", "PALM",
    "POINT", "POINTING", "STOP", "WRIST", "Classifier", "CommandParams", "CommandRule", "CommandState", "Line", "Pointed",
    "PointingParams", "PointingState", "calibration_error", "drifts", "extended_fingers", "frame_votes", "held_covariances", "held_line", "held_points",
    "initial_commands", "initial_pointing", "line_along", "pair_distances", "pointed_place", "rule_gesture", "spread", "update_commands",
    "update_pointing",
]  # fmt: skip
