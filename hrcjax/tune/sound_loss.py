"""A smooth surrogate of the sound score: the same terms with soft minima and shares in place of minima and conditions.

Clearance and contacts are those of the arm's control spheres with the exact obstacles and people, the separation is the sensed one;
a contact is charged by its depth, where the score's term ends at 0; a run succeeds by a share, of the distance to the goal at the
end and of both smallest distances.
"""

import jax
import jax.numpy as jnp

from hrcjax.geom.segment import FAR
from hrcjax.geom.shape import capsule_point_distance
from hrcjax.metrics import ideal_time
from hrcjax.metrics.sound_score import SoundScoreParams, SoundTerms, sound_energy, sound_jerk
from hrcjax.numerics import safe_divide, safe_norm
from hrcjax.robot import control_points
from hrcjax.sim import Cell, Episode, Params, World
from hrcjax.sim.outcome import REACHED
from hrcjax.sim.tick import Record
from hrcjax.tune.losses import away, protective, smooth_energy
from hrcjax.typing import Array, Float, Joints
from hrcjax.world.person import person_at
from hrcjax.world.scene import scene_distance

NEAR = 0.005
"""Width of the soft minimum of the clearance, and of the share of success beside a contact [m]."""
PEAK = 0.02
"""Width of the soft maximum of the tool's speed [m/s]."""


def soft_least(x: Float[Array, "sample"], width: float) -> Float[Array, ""]:
    """A mean that weighs the least samples most: between the least and the mean, the least as the width goes to 0."""
    return jnp.sum(jax.nn.softmax(-x / width) * x)


def obstacle_gap(cell: Cell, world: World, record: Record) -> Float[Array, "sample"]:
    """Least distance of the control spheres to the obstacles that stand, at every `metric_stride`-th tick [m]."""
    radii = jnp.asarray(cell.arm.control_radii, record.q.dtype)

    def at(q: Joints) -> Float[Array, ""]:
        d = jax.vmap(lambda x: scene_distance(world.scene, x, table=False))(control_points(cell.arm, q))
        return jnp.min(d - radii)

    return jax.vmap(at)(record.q[:: cell.metric_stride])


def person_gap(cell: Cell, world: World, record: Record) -> Float[Array, "sample"]:
    """Least distance of the control spheres to people, at every `metric_stride`-th tick; FAR without anybody [m]."""
    radii = jnp.asarray(cell.arm.control_radii, record.q.dtype)
    to_capsules = jax.vmap(capsule_point_distance, in_axes=(None, 0, 0, 0))

    def at(q: Joints, t: Float[Array, ""]) -> Float[Array, ""]:
        body = person_at(world.person, t)
        apart = jax.vmap(lambda x: to_capsules(x, body.a, body.b, body.radius))(control_points(cell.arm, q))
        return jnp.min(jnp.where(body.radius >= 0, apart - radii[:, None], FAR))

    return jax.vmap(at)(record.q[:: cell.metric_stride], jnp.asarray(cell.times[:: cell.metric_stride], record.q.dtype))


def smooth_terms(params: Params, cell: Cell, world: World, run: Episode, clearance: Float[Array, ""]) -> SoundTerms:
    """The terms of the score, each out of 100, less where something is touched.

    Args:
        clearance: least distance to the obstacles [m].
    """
    sound, record, scene = SoundScoreParams(), run.record, world.scene
    share = away(world, run)
    total = jnp.sum(share)
    time = jnp.maximum(total, 1.0) * cell.dt
    u = jnp.minimum(clearance / sound.full_clearance, 1.0)
    apart, needed = protective(params, cell, run)
    missing = jnp.clip(1 - safe_divide(apart, needed), 0.0, 1.0)
    direct = jnp.minimum(safe_divide(safe_norm(scene.goal - record.tool[0]), run.path.length, 1.0), 1.0)
    ideal = direct * ideal_time(run.path.length, params.motion.speed, params.motion.clock.acceleration)
    return SoundTerms(
        clearance=100 * u * (2 - u),
        separation=100 * (1 - safe_divide(jnp.sum(share * missing * (2 - missing)), total)),
        time=100 * jnp.minimum(ideal / time, 1.0),
        jerk=sound_jerk(_log_smoothness(cell, record.tool, share, time), sound.jerk_scale),
        energy=sound_energy(smooth_energy(world, cell, run), sound.half_energy),
    )


def sound(params: Params, cell: Cell, world: World, run: Episode) -> Float[Array, ""]:
    """1 - score / 100 of a smooth surrogate of the sound score."""
    clearance, apart = (soft_least(gap(cell, world, run.record), NEAR) for gap in (obstacle_gap, person_gap))
    rules, terms = SoundScoreParams(), smooth_terms(params, cell, world, run, clearance)
    names = ("clearance", "separation", "time", "jerk", "energy")
    weights = {name: getattr(rules, name) for name in names}
    quality = sum(weights[name] * getattr(terms, name) for name in names) / sum(weights.values()) / 100
    left = jnp.sum(((run.record.tool[-1] - world.scene.goal) / REACHED) ** 2)
    success = jax.nn.sigmoid(clearance / NEAR) * jax.nn.sigmoid(apart / NEAR) / (1 + left)
    score = success * (rules.least + (100 - rules.least) * quality) + (1 - success) * rules.failed * quality
    return 1 - score / 100


def _log_smoothness(
    cell: Cell, tool: Float[Array, "time 3"], share: Float[Array, "time"], time: Float[Array, ""]
) -> Float[Array, ""]:
    """-ln of the dimensionless jerk, each sample by its share; 0 where nothing moves [1]."""
    k = cell.metric_stride
    rate = 1 / (cell.dt * k)
    x, weight = tool[::k], share[::k]
    squared = jnp.sum((jnp.diff(x, n=3, axis=0) * rate**3) ** 2, axis=-1)
    mean = safe_divide(jnp.sum(weight[3:] * squared), jnp.sum(weight[3:]))
    peak = -soft_least(-safe_norm(jnp.diff(x, axis=0)) * rate, PEAK)
    jerk = safe_divide(mean * time**4, peak * peak)
    some = jerk > 0
    return jnp.where(some, -jnp.log(jnp.where(some, jerk, 1.0)), 0.0)
