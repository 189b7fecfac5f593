"""The numbers of body tracking. Values without another source are our choice."""

import equinox as eqx

from hrcjax.body.skeleton import LENGTH_SPREADS, USUAL_LENGTHS, USUAL_RADII
from hrcjax.typing import Scalar


class BodyParams(eqx.Module):
    """Weights of points and priors, motion, and when a track counts."""

    point: Scalar = 0.03
    """Standard deviation of a point from the surface, noise and shape together; neighbours err alike, hence more than a camera's noise [m]."""
    doubt: Scalar = 0.06
    """Points farther from the surface than this weigh little (Geman-McClure) [m]."""
    lengths: tuple[Scalar, ...] = USUAL_LENGTHS
    """Lengths of the bones before anything is known [m]."""
    radii: tuple[Scalar, ...] = USUAL_RADII
    """Radii of the parts before anything is known [m]."""
    length_spreads: tuple[Scalar, ...] = LENGTH_SPREADS
    """Standard deviations of people's lengths [m]."""
    radius_spread: Scalar = 0.05
    """The same of radii, as a share [1]."""
    length_drift: Scalar = 0.002
    """Standard deviation that lengths and radii gain in the root of a second: they are learnt slowly [m/s^0.5]."""
    bone: Scalar = 0.005
    """Standard deviation of a bone's length about the learnt one [m]."""
    collar: Scalar = 0.03
    """The same of shoulders about neck and each other: they shrug [m]."""
    wrist: Scalar = 0.05
    """How far the fingers may be beside the forearm's line [m]."""
    head: Scalar = 0.15
    """How far the crown may be beside the trunk's line [m]."""
    settle: Scalar = 0.002
    """Standard deviation that places of joints gain in a frame besides [m]."""
    lean: Scalar = 0.7
    """Tilt of the trunk from upright [rad]."""
    hip_height: Scalar = 0.93
    """Of a standing person's hip over the floor [m]."""
    hip_spread: Scalar = 0.08
    """Standard deviation of it [m]."""
    limit: Scalar = 0.02
    """How far a joint limit may be exceeded [m]."""
    rest: Scalar = 0.25
    """How far a hand may be from where it hangs [m]."""
    patience: Scalar = 1.0
    """The weak priors (rest, lean, hip height, head) count once in this time, as what they say is no new measurement [s]."""
    acceleration: tuple[Scalar, ...] = (3.0, 3.0, 4.0, 4.0, 6.0, 10.0, 10.0)
    """Standard deviation of the acceleration of hip, neck, crown, shoulders, elbows, wrists and fingers [m/s^2]."""
    scatter_time: Scalar = 0.2
    """Time over which corrections of joints are compared with their variances: as long as a movement of a person takes to begin. Chosen among
    0.1, 0.2 and 0.4 s with the people of docs/body.md [s]."""
    scatter_limits: tuple[Scalar, Scalar] = (0.02, 9.0)
    """Least ratio of them that counts, and the greatest of one frame [1]."""
    forget: Scalar = 1.0
    """Time in which the speed of what is not seen falls to 1/e; what is seen keeps its speed [s]."""
    least_points: Scalar = 20.0
    """Points with which a body is looked for [1]."""
    close: Scalar = 0.03
    """Points this near to the surface are explained [m]."""
    strange: Scalar = 0.1
    """Points farther from it may be somebody else's, or a thing's that the person holds [m]."""
    explained: Scalar = 0.5
    """Share of the points that must be explained for the track to hold [1]."""
    doubtful: Scalar = 0.9
    """Share under which other bodies are tried besides [1]."""
    young: Scalar = 1.0
    """Age of a track up to which they are, too [s]."""
    bad_frames: Scalar = 2.0
    """Frames in a row without it, or without points, after which the track is lost [1]."""
    part_points: Scalar = 3.0
    """Points that make a part seen in a frame [1]."""
    better: Scalar = 3.0
    """A new guess of an arm is taken if it lowers the cost by this [1]."""
    sure_age: Scalar = 1.0
    """Age of a track from which on its speeds count: `young`, as until then other bodies are still tried [s]."""
    sure_position: Scalar = 0.04
    """Largest standard deviation of a part's place with which its speed counts [m]."""
    sure_unseen: Scalar = 0.07
    """Time for which a part may be unseen and its speed still counts: two images [s]."""
    sure_explained: Scalar = 0.85
    """Share of the points that must be explained for speeds to count [1]."""
    rivals: Scalar = 0.06
    """Parts whose distance is greater than the least by less than this may be the nearest [m]."""
    deviations: Scalar = 2.5
    """Standard deviations by which a measured speed is raised [1]."""
    human_acceleration: Scalar = 4.0
    """Gain of speed that is counted on over the reaction time [m/s^2]."""
    iterations: int = eqx.field(static=True, default=6)
    """Steps of Levenberg-Marquardt in a frame."""
    start_iterations: int = eqx.field(static=True, default=10)
    """The same of another body."""
    guesses: int = eqx.field(static=True, default=2)
    """Other bodies that are fitted beside a doubtful track."""
    rival_frames: int = eqx.field(static=True, default=3)
    """Frames over which each of them is, before others are begun: few steps find a body from a first guess, many do."""
    warm: bool = eqx.field(static=True, default=True)
    """Whether a frame starts where the last one ended."""
