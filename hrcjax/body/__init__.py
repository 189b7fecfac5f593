"""A person as a body: capsules fitted to the moving points, frame by frame, with lengths learnt and the uncertainty of every joint."""

from hrcjax.body.nearest import NearestPart, ahead, measured_speed, nearest_part
from hrcjax.body.params import BodyParams
from hrcjax.body.priors import Landmarks
from hrcjax.body.skeleton import ARMS, JOINTS, PART_REGION, PARTS, joints_of, part_capsules
from hrcjax.body.state import BodyFit, BodyState, initial_body
from hrcjax.body.track import track_body

__all__ = [
    "ARMS", "JOINTS", "PARTS", "PART_REGION", "BodyFit", "BodyParams", "BodyState", "Landmarks", "NearestPart", "ahead",
    "initial_body", "joints_of", "measured_speed", "nearest_part", "part_capsules", "track_body",
]  # fmt: skip
