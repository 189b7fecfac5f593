"""The cell as the sweep runs it: settings get the status that their metrics call for."""

import re
import shlex
from dataclasses import replace
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.sweep.config import DESCRIPTION, parse
from hrcjax.cells import CELLS, NamedCell, build_world, make_cell
from hrcjax.cells.people import recording_notes
from hrcjax.cells.problem import build_problem
from hrcjax.cells.results import STATUSES, evaluate
from hrcjax.lab.errors import UsageError
from hrcjax.lab.parameters import set_leaves
from hrcjax.numerics import unrolled_options
from hrcjax.sim import Params
from hrcjax.sweeps.settings import make_settings
from hrcjax.sweeps.store import open_run
from hrcjax.sweeps.sweepable import NOT_FINITE


@pytest.fixture(scope="module")
def problem():
    return build_problem(("robotica",), ("nobody",), (0,))


def test_examples_of_the_help_are_accepted(problem) -> None:
    """Every command in --help and in the README means settings that this cell takes."""
    cell = problem
    readme = (Path(__file__).parents[2] / "README.md").read_text()
    commands = re.findall(r"python -m experiments\.sweep( --[^#\n]*)", DESCRIPTION + readme)
    assert len(commands) >= 6
    for command in commands:
        config = parse(shlex.split(command))
        if config.cell not in CELLS:
            continue  # the user's own; the page on own parts has its test
        settings = make_settings(
            config.grid,
            cell.params,
            aliases=cell.aliases,
            domains=cell.domains,
            samples=config.sobol,
            quick=config.quick,
        )
        assert settings.count > 0
    for metric in re.findall(r"\)\.(\w+)\.sel|ds\.(\w+)\.sel", DESCRIPTION + readme + str(open_run.__doc__)):
        assert "".join(metric) in cell.metrics


@pytest.fixture(scope="module")
def cell_and_world():
    """An episode long enough to arrive in, nobody there."""
    with jax.enable_x64(False):
        cell = replace(make_cell(), ticks=450)
        return cell, build_world(cell, "robotica", "nobody", 0)


@pytest.fixture(scope="module")
def results(cell_and_world):
    """(world) -> results of four settings: near the columns, too slow, good, and one that is not a number."""
    cell, _ = cell_and_world
    axes = {
        "potential.zeta": [0.5, 5.0, 5.0, 5.0],
        "potential.k_att": [0.2, 0.03, 0.2, 0.2],
        "motion.speed": [0.4, 0.4, 0.4, 0.4],
        "policy.target.kp": [10.0, 10.0, 10.0, np.nan],
        "field.length_scale": [Params().field.length_scale]
        * 4,  # each setting fits its own fields; the noise is shared
    }
    with jax.enable_x64(False):
        params = set_leaves(Params(), {name: jnp.asarray(values, jnp.float32) for name, values in axes.items()})
        program = jax.jit(
            lambda params, world: evaluate(NamedCell(cell), params, world), compiler_options=unrolled_options()
        )

    def run(world):
        with jax.enable_x64(False):
            return {name: np.asarray(value) for name, value in program(params, world).items()}

    return run


@pytest.mark.slow
def test_status_says_what_happened(cell_and_world, results) -> None:
    """Past the columns, which the arm avoids, though the plan may touch them; too slow to reach the goal in time; wide and fast."""
    _, world = cell_and_world
    out = results(world)
    assert [STATUSES.get(int(code)) for code in out["status"]] == [
        "ok", "goal not reached in time", "ok", None,
    ]  # fmt: skip
    assert out["status"][3] == NOT_FINITE and np.isfinite(out["tool"]).all()
    assert out["clearance"].min() > 0
    assert out["success"].tolist() == [1, 0, 1, 0]
    assert (np.diff(out["plan_length"][:2]) > 0.05).all()  # a wider berth is a longer way
    np.testing.assert_allclose(out["tool"][2, -1], np.asarray(world.scene.goal), atol=0.02)
    assert (out["zone"] == 0).all()  # nobody there: green
    assert np.isnan(out["separation"]).all()
    assert out["plan_status"].tolist()[:3] == [15, 15, 15]  # where five radii are not to be had, what can be had counts
    seldom = out["clearance_t"].min(axis=1)  # of every tenth tick
    assert (out["clearance"] <= seldom).all() and (seldom - out["clearance"] < 0.01).all()
    np.testing.assert_allclose(out["speed"][2].max(), 0.4, atol=0.02)


@pytest.mark.slow
def test_status_of_an_obstacle_that_nobody_knew(cell_and_world, results) -> None:
    """The columns are 16 cm thicker than cameras and planner say: touched by all that pass them."""
    _, world = cell_and_world
    out = results(eqx.tree_at(lambda w: w.scene.size, world, world.scene.size.at[:, 0].add(0.16)))
    assert out["status"].tolist() == [2, 2, 2, NOT_FINITE] and (out["clearance"][:3] < 0).all()
    assert STATUSES[2] == "the arm touched an obstacle"


@pytest.mark.slow
def test_status_of_a_touch(cell_and_world, results) -> None:
    """A person whom no camera saw, about the arm all the time: touched wherever it moves, and worse than an obstacle."""
    _, world = cell_and_world
    everywhere = jnp.full_like(world.person.radius, 4.0), jnp.ones_like(world.person.present)
    out = results(eqx.tree_at(lambda w: (w.person.radius, w.person.present), world, everywhere))
    assert out["status"].tolist() == [3, 3, 3, NOT_FINITE]
    assert STATUSES[3] == "the arm touched the person while it moved"
    assert (out["separation"] < 0).all() and (out["separation_t"] < 0).all()
    assert out["success"].tolist() == [1, 0, 1, 0]


@pytest.mark.slow
def test_a_cell_without_obstacles_has_no_clearance(cell_and_world, results) -> None:
    _, world = cell_and_world
    out = results(eqx.tree_at(lambda w: w.scene.mask, world, jnp.zeros_like(world.scene.mask)))
    assert np.isnan(out["clearance"]).all()
    assert out["status"].tolist()[1:] == [1, 0, NOT_FINITE]


def test_recordings_are_described(shared_data: Path) -> None:
    """The glitchy recording is named as such; both say that they are longer than an episode."""
    folder = shared_data / "human_motion"
    good, bad = (
        recording_notes(str(folder / name), 10.0) for name in ("ObjectInspection_2.bvh", "PickPlaceCloseHuman_0.bvh")
    )
    assert len(good) == 2 and "lengths in mm, y up" in good[0] and "the first 10 s of" in good[1]
    assert len(bad) == 3 and "the recording jumps" in bad[2]
    short = recording_notes(str(folder / "ObjectInspection_2.bvh"), 100.0)
    assert "s long; the last pose is held to 100 s" in short[1]


def test_no_parameter_may_be_negative(problem) -> None:
    with pytest.raises(UsageError, match="outside its domain"):
        make_settings(["policy.collision.r_act=-1,0"], problem.params, domains=problem.domains)
