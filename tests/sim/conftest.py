"""One small world, sensed once and coarsely: a short episode, the person standing in the way from the start."""

import jax
import jax.numpy as jnp
import pytest
from coarse_sensing import COARSE, coarse_world

from hrcjax.plan import PathParams, PlanSizes
from hrcjax.robot import load_arm, with_tool
from hrcjax.sim import Cell, World, potential_planner
from hrcjax.world import motion_named, scene_named


@pytest.fixture(scope="session")
def cell() -> Cell:
    arm = with_tool(load_arm("ur5"), 0.12, 0.03)
    return Cell(
        arm=arm,
        ticks=60,
        substeps=2,
        plan=potential_planner(PlanSizes(steps=100, waypoints=24, iterations=10)),
        **COARSE,
    )


@pytest.fixture(scope="session")
def world(cell: Cell) -> World:
    scene = scene_named("robotica", 0)
    person = jax.jit(lambda: motion_named("stand_and_work", scene, 0, 2.0, 30.0))()
    return coarse_world(cell, scene, person)


@pytest.fixture(scope="session")
def float_params() -> object:
    from hrcjax.sim import Params

    return jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), Params(plan=PathParams()))
