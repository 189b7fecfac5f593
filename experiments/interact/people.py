"""People of this program: a hand that is led about before a person who stands, and one that is held out to take something.

Both stand at the table, turned to the robot; one hand goes where it is told, the other hangs. Recorded people come from BVH files.
"""

import math
from collections.abc import Callable

import jax.numpy as jnp
import numpy as np

from hrcjax.typing import Array, Float, Scalar, Vector3
from hrcjax.world import Person, Scene
from hrcjax.world.motions import REST, record, smooth_step
from hrcjax.world.scene import FLOOR_Z
from hrcjax.world.skeleton import HIP_HEIGHT, SHOULDER, TORSO, Pose

RATE = 30.0
"""Poses in a second [Hz]."""
LEAN = 0.25
"""Forward tilt of the trunk [rad]."""
SPEED = 0.3
"""Largest speed of a hand that is followed [m/s]."""


def hand_person(scene: Scene, middle: Float[np.ndarray, "3"], offset_at: Callable[[Float[Array, ""]], Vector3], seconds: float) -> Person:  # fmt: skip
    """A person whose right hand is at `middle` plus an offset that depends on time.

    Args:
        middle: about 0.4 m before the shoulder [m].
        offset_at: time [s] -> offset [m].
    """
    dtype = scene.start.dtype
    hip = jnp.asarray([middle[0] + SHOULDER, middle[1] + 0.45], dtype)
    forward = jnp.asarray([0.0, -1.0], dtype)
    height = FLOOR_Z + HIP_HEIGHT + math.cos(LEAN) * (TORSO - 0.05)
    shoulder = jnp.asarray([middle[0], middle[1] + 0.45 - math.sin(LEAN) * (TORSO - 0.05), height], dtype)

    def pose_at(t: Float[Array, ""]) -> Pose:
        way = jnp.asarray(middle, dtype) + offset_at(t) - shoulder
        led = jnp.stack([-way[1], -way[0], way[2]])  # forward is -y, the body's right -x
        return Pose(hip, forward, LEAN, (jnp.asarray(REST, dtype), led), jnp.zeros((), dtype))

    return record(pose_at, seconds, RATE, dtype)


def stroke(t: Scalar, turn: Scalar, sharpness: float = 0.7) -> Float[Array, ""]:
    """To and fro between -1 and 1, at nearly one speed between soft turns.

    Args:
        turn: rate of the phase [rad/s].
        sharpness: 0 a sine, 1 a triangle [1].
    """
    return jnp.asarray(jnp.arcsin(sharpness * jnp.sin(turn * t)) / math.asin(sharpness))


STROKES = ((0.22, 0.0, 0.0), (0.14, 0.12, 0.0), (0.15, 0.0, 0.13), (0.12, 0.1, 0.08), (0.0, 0.15, 0.0))
"""Half of the way of a followed hand along the axes, by seed: across, aslant, up and down, along all, away and near [m]."""


def under_way(t: Scalar, start: Scalar, end: Scalar) -> Float[Array, ""]:
    """Time that has passed for who sets off between `start` and `end`: the integral of `smooth_step` [s]."""
    u = jnp.clip((t - start) / (end - start), 0, 1)
    return jnp.asarray((end - start) * u**4 * (2.5 + u * (u - 3.0)) + jnp.maximum(t - end, 0.0))


def led_hand(scene: Scene, seed: int, seconds: float) -> Person:
    """A hand that goes to and fro from the second half on of the first 2.5 s, up to `SPEED`; with odd seeds every axis has its own phase."""
    draw = np.random.default_rng(seed)
    middle = np.array([0.4, 0.8, 0.32]) + (draw.uniform(-0.03, 0.03, 3) if seed else 0.0)
    half = np.array(STROKES[seed % len(STROKES)])
    turn = SPEED / (float(np.linalg.norm(half)) * 0.7 / math.asin(0.7))
    lags = np.array([0.0, math.pi / 2, math.pi / 4]) / turn * (seed % 2)

    def offset_at(t: Float[Array, ""]) -> Vector3:
        passed = under_way(t, 0.5, 2.5)
        ways = [h * (stroke(passed + lag, turn) - stroke(lag, turn)) for h, lag in zip(half, lags, strict=True)]
        return jnp.stack(ways).astype(scene.start.dtype)

    return hand_person(scene, middle, offset_at, seconds)


GIVES_UP = 7.5
"""When the hand that was held out moves away [s]."""


def held_out_hand(scene: Scene, seed: int, seconds: float) -> Person:
    """A hand that comes within 1.5 s, holds still up to `GIVES_UP`, with a tremor of some millimetres, and goes aside by 0.3 m."""
    draw = np.random.default_rng(seed)
    middle = np.array([0.3, 0.68, 0.32]) + (draw.uniform(-0.06, 0.06, 3) if seed else 0.0)
    dtype = scene.start.dtype
    aside = jnp.asarray([0.3, 0.05, 0.05], dtype)
    before = jnp.asarray([-0.05, 0.25, -0.3], dtype)
    phases = jnp.asarray(draw.uniform(0, 2 * np.pi, 3), dtype)

    def offset_at(t: Float[Array, ""]) -> Vector3:
        shake = 0.002 * jnp.sin(2 * np.pi * jnp.asarray([1.1, 0.7, 1.6], dtype) * t + phases)
        return (1 - smooth_step(t, 0.3, 1.5)) * before + smooth_step(t, GIVES_UP, GIVES_UP + 1.5) * aside + shake

    return hand_person(scene, middle, offset_at, seconds)
