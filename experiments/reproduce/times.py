"""Times to goal of all rows of tables I to VII in one reading: improved potential field and gradient descent, and their paths."""

from collections.abc import Mapping, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.plan import (
    GradientDescentParams,
    PotentialParams,
    gradient_descent_path,
    potential_path,
    time_to_goal,
    unit_step,
)
from hrcjax.plan.descent import STEP_TIME
from hrcjax.typing import Array, Bool, Float, Int
from hrcjax.world.scene import Scene, obstacle_distances

from .printed import TIMES, TimeRow
from .readings import row_scene, stacked

STEPS = 300
"""Steps of the improved field; its slowest row takes 143."""
GRADIENT_STEPS = 1600
"""Steps of gradient descent; without obstacles its slowest row takes 1,463."""


class Timed(eqx.Module):
    """One row, timed."""

    iapf: Float[Array, ""]
    """Time to goal; infinite if not reached in `STEPS` [s]."""
    iapf_path: Float[Array, "iapf_point 3"]
    """Start and the point after each step [m]."""
    iapf_steps: Int[Array, ""]
    """Steps to the goal."""
    gda: Float[Array, ""]
    """Time to goal; infinite if not reached in `GRADIENT_STEPS` [s]."""
    gda_path: Float[Array, "gda_point 3"]
    """Start and the point after each step [m]."""
    gda_steps: Int[Array, ""]
    """Steps to the goal."""
    gda_reached: Bool[Array, ""]


def improved_params(row: TimeRow) -> PotentialParams:
    """The improved field of a row, in metres; n = 2."""
    made = PotentialParams(k_att=row.k_att, k_rep=row.k_rep * 0.01**2, zeta=row.zeta)
    return jax.tree.map(lambda x: jnp.asarray(x, jnp.float64), made)


def gradient_params(row: TimeRow) -> GradientDescentParams:
    """Gradient descent of a row, in metres."""
    made = GradientDescentParams(k_att=row.gda_k_att, k_rep=row.gda_k_rep * 0.01**4)
    return jax.tree.map(lambda x: jnp.asarray(x, jnp.float64), made)


def timed(improved: PotentialParams, gradient: GradientDescentParams, scene: Scene) -> Timed:
    """Both descents of one row: one unit step every 1/30 s until 1 cm from the goal."""

    def distances(x: Float[Array, "3"]) -> Float[Array, "obstacle"]:
        return obstacle_distances(scene, x)

    ends = (scene.start, scene.goal, distances, scene.radius)
    ours = potential_path(improved, *ends, STEPS, unit_step)
    plain = gradient_descent_path(gradient, *ends, GRADIENT_STEPS)
    return Timed(
        iapf=time_to_goal(improved, *ends, STEPS, unit_step),
        iapf_path=ours.waypoints,
        iapf_steps=ours.arrival,
        gda=jnp.where(plain.reached, plain.arrival.astype(scene.goal.dtype) * STEP_TIME, jnp.inf),
        gda_path=plain.waypoints,
        gda_steps=plain.arrival,
        gda_reached=plain.reached,
    )


def times_case(reading: str, rows: Sequence[TimeRow] = TIMES) -> Mapping[str, NDArray]:
    """Arrays of `Timed` with a leading axis of rows."""
    with jax.enable_x64(True):
        batch: Any = [
            jax.tree.map(lambda *x: jnp.stack(x), *map(make, rows)) for make in (improved_params, gradient_params)
        ]
        found = jax.jit(jax.vmap(timed))(*batch, stacked([row_scene(reading, row) for row in rows]))
        return {name: np.asarray(getattr(found, name)) for name in found.__dataclass_fields__}
