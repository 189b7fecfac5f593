"""The worlds of the tests of losses: a person reaches in while the arm sets off; in float64."""

import jax
import jax.numpy as jnp
import pytest
from coarse_sensing import COARSE, coarse_world

from hrcjax.cells.ur5 import TOOL
from hrcjax.plan import PlanSizes
from hrcjax.robot import load_arm, with_tool
from hrcjax.sim import Cell, World, potential_planner
from hrcjax.world import motion_named, scene_named


@pytest.fixture(scope="session")
def cell() -> Cell:
    arm = with_tool(load_arm("ur5"), *TOOL)
    planner = potential_planner(PlanSizes(steps=60, waypoints=24, iterations=8))
    return Cell(arm=arm, ticks=100, substeps=2, plan=planner, **COARSE)


@pytest.fixture(scope="session", params=["robotica", "hri"])
def world(cell: Cell, request: pytest.FixtureRequest) -> World:
    scene = scene_named(request.param, 0)
    person = jax.jit(lambda: motion_named("reach_in", scene, 0, 10.0, 30.0))()
    sensed = coarse_world(cell, scene, person)
    return jax.tree.map(lambda x: x.astype(jnp.float64) if jnp.issubdtype(x.dtype, jnp.floating) else x, sensed)
