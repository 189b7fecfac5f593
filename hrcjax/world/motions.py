"""Our own motions of a person: reach in, pass by, stand and work, nobody. Position is twice differentiable in time.

Each is made once for a scene, at a fixed rate, and can be jitted as a whole by the caller. A seed varies timing, side and target a little; the same seed gives the
same motion.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.numerics import safe_norm
from hrcjax.typing import Array, Float, Scalar
from hrcjax.world.person import RADII, REGIONS, Person
from hrcjax.world.place import path_middle, standing_place
from hrcjax.world.scene import FLOOR_Z, Scene
from hrcjax.world.skeleton import FOREARM, HAND, HIP_HEIGHT, SHOULDER, TORSO, UPPER_ARM, Pose, body_capsules, body_of

REST = (0.15, 0.06, -0.57)
"""A hanging hand as seen from its shoulder: forward, outside, up [m]."""
PROP = (0.10, 0.10, -0.48)
"""The other hand, propped on the table while the body leans over it: the same [m]."""

REACH_TIME = 6.0
"""Time in which a reach would come and go, of a hand that stays [s]."""


def smooth_step(t: Scalar, start: Scalar, end: Scalar) -> Float[Array, ""]:
    """From 0 at `start` to 1 at `end`, with zero speed and acceleration at both (minimum jerk, Flash and Hogan 1985)."""
    u = jnp.clip((t - start) / (end - start), 0, 1)
    return u * u * u * (10 + u * (6 * u - 15))


def bump(t: Scalar, rise: float, top: float, leave: float, end: float) -> Float[Array, ""]:
    """From 0 to 1 between `rise` and `top`, back to 0 between `leave` and `end`."""
    return smooth_step(t, rise, top) - smooth_step(t, leave, end)


def frame_count(duration: float, rate: float) -> int:
    """Frames of a record from 0 to `duration`, both ends included.

    Raises:
        ValueError: a duration or rate that is not positive.
    """
    if not (duration > 0 and rate > 0):
        raise ValueError(f"duration {duration} s and rate {rate} Hz must be positive")
    return round(duration * rate) + 1


def record(pose_at: Callable[[Float[Array, ""]], Pose], duration: float, rate: float, dtype: jnp.dtype) -> Person:
    """The person who takes the pose of every moment."""
    times = jnp.asarray(np.arange(frame_count(duration, rate)) / rate, dtype)
    capsules = jax.vmap(lambda t: body_capsules(body_of(pose_at(t))))(times)
    return Person(
        a=capsules.a,
        b=capsules.b,
        radius=capsules.radius[0],
        rate=jnp.asarray(rate, dtype),
        present=jnp.ones(times.shape, bool),
    )


def reach_in(scene: Scene, seed: int = 0, duration: float = 8.0, rate: float = 30.0) -> Person:
    """Steps up to the table and puts one hand into the middle of the robot's path, then draws back and steps away.

    The hand is in the path from about 0.42 to 0.62 of the duration. A target out of reach is approached on the straight
    line from the shoulder, as far as the arm goes.
    """
    return _reach(scene, seed, duration, rate, duration, stays=False)


def reach_and_stay(scene: Scene, seed: int = 0, duration: float = 8.0, rate: float = 30.0) -> Person:
    """The same, but the hand stays in the path to the end. It is there after 2.5 s, or 0.42 of a duration under 6 s."""
    return _reach(scene, seed, duration, rate, min(duration, REACH_TIME), stays=True)


def _reach(scene: Scene, seed: int, duration: float, rate: float, span: float, stays: bool) -> Person:
    """A hand reaches into the path.

    Args:
        span: time from before the first step to after the last [s].
        stays: the hand does not leave.
    """
    draw = np.random.default_rng(seed)
    dtype = scene.start.dtype
    shift = float(draw.uniform(-0.02, 0.02)) if seed else 0.0
    along = 0.5 + (float(draw.uniform(-0.15, 0.15)) if seed else 0.0)
    side = int(draw.integers(2)) if seed else 1
    middle = scene.start + along * (scene.goal - scene.start)
    forward = jnp.asarray([0.0, -1.0], dtype)
    place, lean, retreat = standing_place(scene), 0.5, 0.6
    sign = 1.0 if side == 0 else -1.0
    # the reaching shoulder as body_of puts it, leaning, at the table
    shoulder = jnp.stack(
        [
            place[0] + sign * SHOULDER,
            place[1] - math.sin(lean) * (TORSO - 0.05),
            jnp.asarray(FLOOR_Z + HIP_HEIGHT + math.cos(lean) * (TORSO - 0.05), dtype),
        ]
    )
    way = middle - shoulder
    way = way * jnp.minimum(1, 0.97 * (UPPER_ARM + FOREARM + HAND) / safe_norm(way))
    target = jnp.stack([-way[1], sign * way[0], way[2]])  # forward is -y, left is +x

    def pose_at(t: Float[Array, ""]) -> Pose:
        f = t / span + shift
        here = smooth_step(f, 0.08, 0.30) if stays else bump(f, 0.08, 0.30, 0.68, 0.92)
        reach = smooth_step(f, 0.26, 0.42) if stays else bump(f, 0.26, 0.42, 0.62, 0.78)
        rest, prop = jnp.asarray(REST, dtype), jnp.asarray(PROP, dtype)
        moving, other = rest + reach * (target - rest), rest + reach * (prop - rest)
        return Pose(
            hip=place - (1 - here) * retreat * forward,
            forward=forward,
            lean=lean * reach,
            hand=(moving, other) if side == 0 else (other, moving),
            stride=0.35 * here * (1 - here) * 4,
        )

    return record(pose_at, duration, rate, dtype)


def pass_by(scene: Scene, seed: int = 0, duration: float = 8.0, rate: float = 30.0) -> Person:
    """Walks past the table at 1.2 m/s, on a line 1.35 m (1.25 to 1.5 m by seed) from the base; nearest at half time."""
    draw = np.random.default_rng(seed)
    dtype = scene.start.dtype
    distance = float(draw.uniform(1.25, 1.5)) if seed else 1.35
    way = float(draw.choice([-1.0, 1.0])) if seed else 1.0
    speed, pace = 1.2, 2 * np.pi * 0.85  # 0.85 double steps a second
    middle = path_middle(scene)[0]
    forward = jnp.asarray([way, 0.0], dtype)

    def pose_at(t: Float[Array, ""]) -> Pose:
        swing = jnp.sin(pace * t)
        rest, ahead = jnp.asarray(REST, dtype), jnp.asarray([0.22, 0.0, 0.04], dtype)
        hip = jnp.stack([middle + way * speed * (t - duration / 2), jnp.asarray(distance, dtype)])
        return Pose(
            hip=hip,
            forward=forward,
            lean=0.05,
            hand=(rest - swing * ahead, rest + swing * ahead),
            stride=0.27 * swing,
        )

    return record(pose_at, duration, rate, dtype)


def stand_and_work(scene: Scene, seed: int = 0, duration: float = 8.0, rate: float = 30.0) -> Person:
    """Stands beside the path's far end and moves both hands over the table's edge, about 1 m from the base."""
    phase = float(np.random.default_rng(seed).uniform(0, 2 * np.pi)) if seed else 0.0
    dtype = scene.start.dtype
    place = standing_place(scene, aside=0.6)
    forward = jnp.asarray([0.0, -1.0], dtype)

    def pose_at(t: Float[Array, ""]) -> Pose:
        def hand(rate_hz: float, offset: float) -> Array:
            turn = 2 * np.pi * rate_hz * t + (phase + offset)
            return jnp.stack(
                [0.36 + 0.10 * jnp.sin(turn), 0.07 * jnp.cos(turn) - 0.04, 0.06 * jnp.sin(2 * turn) - 0.36]
            )

        return Pose(
            hip=place,
            forward=forward,
            lean=0.15 + 0.05 * jnp.sin(2 * np.pi * 0.2 * t + phase),
            hand=(hand(0.40, 0.0), hand(0.31, 2.0)),
            stride=jnp.zeros_like(t),
        )

    return record(pose_at, duration, rate, dtype)


def nobody(scene: Scene, seed: int = 0, duration: float = 8.0, rate: float = 30.0) -> Person:
    """An empty cell, as a person of the usual shapes who is never present."""
    dtype = scene.start.dtype
    frames = frame_count(duration, rate)
    nowhere = jnp.zeros((frames, len(REGIONS), 3), dtype)
    return Person(
        a=nowhere,
        b=nowhere,
        radius=jnp.asarray([RADII[region] for region in REGIONS], dtype),
        rate=jnp.asarray(rate, dtype),
        present=jnp.zeros((frames,), bool),
    )


class MotionEntry(NamedTuple):
    """A named motion."""

    make: Callable[[Scene, int, float, float], Person]
    """The person of (scene, seed, duration [s], rate [Hz])."""
    description: str
    """One line."""

    def __call__(self, scene: Scene, seed: int = 0, duration: float = 8.0, rate: float = 30.0) -> Person:
        return self.make(scene, seed, duration, rate)


MOTIONS: dict[str, MotionEntry] = {
    "reach_in": MotionEntry(reach_in, "steps up and puts a hand into the robot's path"),
    "pass_by": MotionEntry(pass_by, "walks past the table at 1.2 m/s"),
    "stand_and_work": MotionEntry(stand_and_work, "stands at the table and moves both hands over it"),
    "reach_and_stay": MotionEntry(reach_and_stay, "steps up and puts a hand into the robot's path, where it stays"),
    "nobody": MotionEntry(nobody, "an empty cell"),
}


def motion_named(name: str, scene: Scene, seed: int = 0, duration: float = 8.0, rate: float = 30.0) -> Person:
    """The person of a named motion in a scene.

    Raises:
        ValueError: an unknown name.
    """
    if name not in MOTIONS:
        raise ValueError(f"unknown motion {name!r}: accepted are {', '.join(MOTIONS)}, or a BVH file")
    return MOTIONS[name](scene, seed, duration, rate)
