"""The Robotica paper's scene, obstacles read as columns: length and bending energy of the best of many starts."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.plan import PlanParams, PlanSizes, plan_multi_start
from hrcjax.world import first_obstacles, obstacle_distances, robotica

from .curve import Curve
from .ours import STARTS
from .scenes import PointScene

OBSTACLES = 4
CLEARANCES = {"touching": 1.0, "clear_3cm": 2.0}
"""Name -> zeta: the paper's own reading asks only for no contact; with 3 cm the surface is as far away as the radius."""


def paper_rows() -> dict[str, dict[str, Any]]:
    """Length [cm], bending energy [1/cm] and least surface distance [cm] for each clearance, with the weights by default."""
    scene = first_obstacles(robotica("columns"), OBSTACLES)
    start, goal, center, size, yaw, lower, upper = (
        np.asarray(x, float)
        for x in (scene.start, scene.goal, scene.center, scene.size, scene.yaw, scene.lower, scene.upper)
    )
    plain = PointScene(start, goal, np.asarray(scene.kind), center, size, yaw, lower, upper)

    def planned(zeta: jax.Array) -> jax.Array:
        params = jax.tree.map(jnp.float32, PlanParams())
        params = eqx.tree_at(lambda p: p.potential.zeta, params, zeta)
        return plan_multi_start(
            params, scene.start, scene.goal, lambda x: obstacle_distances(scene, x), scene.radius, scene.lower, scene.upper,
            PlanSizes(), STARTS,
        ).waypoints  # fmt: skip

    program = jax.jit(planned)
    rows: dict[str, dict[str, Any]] = {}
    for name, zeta in CLEARANCES.items():
        curve = Curve(np.asarray(program(jnp.float32(zeta)), float))
        rows |= {
            f"point_paper_length_{name}": {"value": 100 * curve.length(), "unit": "cm"},
            f"point_paper_bending_{name}": {"value": curve.bending_energy() / 100, "unit": "1/cm"},
            f"point_paper_distance_{name}": {
                "value": 100 * float(plain.distances(curve.sampled()).min()),
                "unit": "cm",
            },
        }
    return rows
