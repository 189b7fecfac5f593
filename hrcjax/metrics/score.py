"""The Robotica paper's performance score (tables IX and X), out of 100.

The printed formulas don't say how a series over time becomes one score; the readings here are named with each function.
Where the paper divides by a maximum, the maximum over the run itself is the default; give one fixed number to compare
runs. The paper's "83.87 % improvement" is `relative_score` of the run with zones to the run without zones and without
a person: a loss of 16 %.
"""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.metrics.energy import power
from hrcjax.metrics.samples import difference_mask, differences, masked_max, masked_mean
from hrcjax.numerics import safe_divide
from hrcjax.typing import Array, Bool, Float, Scalar


class ScoreParams(eqx.Module):
    """Weights of the score (Robotica paper, section 5)."""

    navigation: float = 0.4
    """Of safe navigation efficiency in safety [1]."""
    proximity: float = 0.3
    """Of obstacle proximity in safety [1]."""
    collision: float = 0.3
    """Of time to collision in safety [1]."""
    time: float = 0.3
    """Of the task time in efficiency [1]."""
    power: float = 0.3
    """Of power efficiency in efficiency [1]."""
    trajectory: float = 0.1
    """Of trajectory smoothness in efficiency [1]."""
    joint: float = 0.3
    """Of joint smoothness in efficiency [1]."""
    safety: float = 0.8
    """A, of safety in the whole [1]."""
    efficiency: float = 0.2
    """B, of efficiency in the whole [1]."""
    horizon: float = 5.0
    """Times to collision longer than this count as this; our choice, the paper has none [s]."""


def safety_score(params: ScoreParams, navigation: Scalar, proximity: Scalar, collision: Scalar) -> Float[Array, ""]:
    """.4 SNE + .3 OPM + .3 CRM, each out of 100."""
    return jnp.asarray(params.navigation * navigation + params.proximity * proximity + params.collision * collision)


def efficiency_score(
    params: ScoreParams, time: Scalar, power: Scalar, trajectory: Scalar, joint: Scalar
) -> Float[Array, ""]:
    """.3 time + .3 power + .1 trajectory smoothness + .3 joint smoothness, each out of 100."""
    return jnp.asarray(
        params.time * time + params.power * power + params.trajectory * trajectory + params.joint * joint
    )


def overall_score(params: ScoreParams, safety: Scalar, efficiency: Scalar) -> Float[Array, ""]:
    """.8 safety + .2 efficiency, out of 100."""
    return jnp.asarray(params.safety * safety + params.efficiency * efficiency)


def relative_score(score: Scalar, reference: Scalar) -> Float[Array, ""]:
    """A run's score as percentage of a reference run's. Not an improvement. Not finite if: the reference is 0."""
    return jnp.asarray(100 * score / reference)


def task_time_score(ideal_time: Scalar, total_time: Scalar) -> Float[Array, ""]:
    """E = 100 T_ideal / T_total from two times [s]. Not finite if: T_total is 0."""
    return jnp.asarray(100 * ideal_time / total_time)


def power_score(
    tau: Float[Array, "time joint"],
    qd: Float[Array, "time joint"],
    mask: Bool[Array, "time"] | None = None,
    largest: Scalar | None = None,
) -> Float[Array, ""]:
    """100 times the mean over the largest power; 0 where nothing moves.

    Reading of TW / max TW: the mean over time. More power for longer scores higher, so read the energy [J] beside it.

    Args:
        tau: joint torques [N m].
        qd: joint speeds [rad/s].
        mask: samples that count.
        largest: max TW; None: of this run [W].
    """
    each = power(tau, qd)
    top = jnp.maximum(masked_max(each, mask), 0.0) if largest is None else jnp.asarray(largest, each.dtype)
    return 100 * safe_divide(masked_mean(each, mask), top)


def trajectory_smoothness(qdd: Float[Array, "time joint"], mask: Bool[Array, "time"] | None = None) -> Float[Array, ""]:
    """S_i = sum over time of |change of the acceleration of joint i|, scaled over the joints to 1..100, averaged.

    Misprint in table IX: "* 99 + 13" is "* 99 + 1" and the number of the next formula. A run is scaled by its own
    joints, so this can't rank runs: a run ten times rougher has the same score. 1 where all joints are alike.

    Args:
        qdd: joint accelerations [rad/s^2].
        mask: samples that count.
    """
    change = jnp.abs(differences(qdd, 1))
    counts = difference_mask(mask, 1)
    S = jnp.sum(change if counts is None else jnp.where(counts[:, None], change, 0), axis=0)
    least = jnp.min(S)
    return jnp.mean(safe_divide(S - least, jnp.max(S) - least) * 99 + 1)


def joint_smoothness(
    q: Float[Array, "time joint"], dt: Scalar, mask: Bool[Array, "time"] | None = None, largest: Scalar | None = None
) -> Float[Array, ""]:
    """100 mean(omega) / max(omega) over the joints, omega_i = travel_i / time; 0 where nothing moves.

    It tells how evenly the joints share the motion; how smooth it is, it does not tell.

    Args:
        q: joint positions [rad].
        dt: time of a sample [s].
        mask: samples that count.
        largest: max omega; None: of this run [rad/s].
    """
    step = jnp.abs(differences(q, 1))
    counts = difference_mask(mask, 1)
    omega = jnp.stack([masked_mean(step[:, i], counts) for i in range(q.shape[1])]) / dt
    top = jnp.max(omega) if largest is None else jnp.asarray(largest, q.dtype)
    return 100 * safe_divide(jnp.mean(omega), top)


def safe_navigation(
    separation: Float[Array, "time"], unsafe_distance: Scalar, mask: Bool[Array, "time"] | None = None
) -> Float[Array, ""]:
    """SNE = 100 - percentage of the time nearer to the person than `unsafe_distance` [m], from separations [m]."""
    unsafe = (separation < unsafe_distance).astype(separation.dtype)
    return 100 - 100 * masked_mean(unsafe, mask)


def obstacle_proximity(
    separation: Float[Array, "time"],
    obstacle_distances: Float[Array, "time obstacle"],
    mask: Bool[Array, "time"] | None = None,
    largest: Scalar | None = None,
) -> Float[Array, ""]:
    """OPM = distance to the person plus the sum of the distances to the obstacles: 100 times its mean over its largest.

    Args:
        separation: distance to the person [m].
        obstacle_distances: distance to every obstacle of the scene; leave out slots without one [m].
        mask: samples that count.
        largest: None: of this run [m].
    """
    total = separation + jnp.sum(obstacle_distances, axis=-1)
    top = masked_max(total, mask) if largest is None else jnp.asarray(largest, total.dtype)
    return 100 * safe_divide(masked_mean(total, mask), jnp.where(jnp.isfinite(top), top, 0.0))


def time_to_collision(
    separation: Float[Array, "time"], closing_speed: Float[Array, "time"], horizon: Scalar
) -> Float[Array, "time"]:
    """CRM_i: distance over closing speed (robot and person together), at most the horizon; 0 in contact [s].

    Args:
        separation: distance to the person [m].
        closing_speed: V_r + V_h, positive for an approach [m/s].
        horizon: largest time to collision; longer ones count as this [s].
    """
    gap = jnp.maximum(separation, 0.0)
    soon = (closing_speed > 0) & (gap < closing_speed * horizon)
    away = jnp.where(separation > 0, horizon, 0.0)
    return jnp.where(soon, gap / jnp.where(soon, closing_speed, 1.0), away)


def collision_risk(
    separation: Float[Array, "time"],
    closing_speed: Float[Array, "time"],
    horizon: Scalar,
    mask: Bool[Array, "time"] | None = None,
) -> Float[Array, ""]:
    """100 times the mean time to collision over the horizon: 100 where no collision is in sight; arguments as there."""
    return 100 * masked_mean(time_to_collision(separation, closing_speed, horizon), mask) / horizon
