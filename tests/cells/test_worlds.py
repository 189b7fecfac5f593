"""What is stored of a world, who is in it, and which settings it takes."""

import dataclasses
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.cells import CELLS, make_cell, worlds
from hrcjax.cells.people import PERSON_RATE, make_people, make_person
from hrcjax.cells.problem import build_problem
from hrcjax.cells.results import BROKEN
from hrcjax.cells.worlds import DESCRIBED, describe
from hrcjax.field import GridLayout, fit_grid
from hrcjax.geom.cloud import Cloud
from hrcjax.lab.errors import UsageError
from hrcjax.robot import load_arm
from hrcjax.sense.rig import cell_rig
from hrcjax.sim import Frames, World
from hrcjax.sim.tick import NOT_FINITE_COMMAND, NOT_FINITE_TORQUE, TORQUE_LIMITED
from hrcjax.sweeps.settings import make_settings
from hrcjax.world import scene_named


@pytest.fixture(scope="module")
def problem():
    return build_problem(("robotica",), ("reach_in", "nobody"), (0, 3))


@pytest.fixture
def unchecked(monkeypatch: pytest.MonkeyPatch) -> None:
    """The cell's parts are traced once, for `problem`, and not for every other one."""
    monkeypatch.setattr("hrcjax.cells.problem.check_cell", lambda named: None)


def test_what_is_stored_of_a_world_is_the_world() -> None:
    scene = scene_named("clutter", 1)
    person = make_people("reach_in", scene, 1, 2.0, 1)
    no, row, one = jnp.zeros(1, bool), jnp.zeros(1), jnp.zeros(1, jnp.int32)
    field = fit_grid(GridLayout((0.0, 0.0, 0.0), (4, 4, 4), 0.1), jnp.zeros((4, 4, 4)))
    frames = Frames(field, Cloud(jnp.zeros((1, 1, 3)), no[None]), row, row, one, no, one[None], no, no[0])
    kept = {name: np.asarray(array) for name, array in describe(World(scene, person, frames, jnp.zeros(6))).items()}
    assert list(kept) == list(DESCRIBED)
    for name, trace in DESCRIBED.items():
        assert kept[name].ndim == len(trace[0]), name
    for name in ("start", "goal"):
        np.testing.assert_array_equal(kept[name], getattr(scene, name))
    for name in ("kind", "center", "size", "yaw", "mask"):
        np.testing.assert_array_equal(kept[f"obstacle_{name}"], getattr(scene, name))
    for name in ("a", "b", "radius"):
        np.testing.assert_array_equal(kept[f"person_{name}"], getattr(person, name))


def test_a_world_is_sensed_with_its_own_scene_people_camera_and_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worlds, "make_world", lambda *arguments, known: (*arguments, known))
    cell = replace(make_cell(), ticks=250, people=2)
    got, scene, person, rig, key, known = worlds.build_world(cell, "clutter", "reach_in", 3)  # pyright: ignore[reportGeneralTypeIssues]
    assert got is cell and known is None
    np.testing.assert_array_equal(scene.center, scene_named("clutter", 3).center)
    assert person.a.shape[0] == round(250 * 0.008 * PERSON_RATE) + 1, "as long as the episode"
    expected = make_people("reach_in", scene, 3, 2.0, 2)
    np.testing.assert_array_equal(person.a, expected.a)
    np.testing.assert_array_equal(person.radius, expected.radius)
    np.testing.assert_array_equal(rig.cameras.position, cell_rig(scene).cameras.position)
    assert rig.rates == (15.0, 15.0) and rig.hand is not None
    np.testing.assert_array_equal(jax.random.key_data(key), jax.random.key_data(jax.random.key(3)))


def test_several_people_have_seeds_of_their_own_and_the_first_the_world_s() -> None:
    scene = scene_named("robotica", 0)
    both = make_people("reach_in+reach_in", scene, 5, 2.0, 3)
    alone = [make_person("reach_in", scene, seed, 2.0) for seed in (5, 1005)]
    count = alone[0].radius.shape[0]
    assert both.a.shape[1] == both.radius.shape[0] == 3 * count
    for k, person in enumerate(alone):
        part = slice(k * count, (k + 1) * count)
        np.testing.assert_array_equal(both.a[:, part], person.a)
        np.testing.assert_array_equal(both.radius[part], person.radius)
    assert (np.asarray(both.radius[2 * count :]) < 0).all(), "nobody in the third place"
    assert not np.array_equal(alone[0].a, alone[1].a)
    with pytest.raises(ValueError, match="2 people, the cell has capacity for 1"):
        make_people("reach_in+nobody", scene, 0, 2.0, 1)


@pytest.mark.parametrize("name", ["ur5", "ur5e"])
def test_built_in_cells_carry_a_tool_of_twelve_centimetres(name: str) -> None:
    """Twelve seconds at 125 Hz; between the tool's point and the flange 12 cm, and a radius of 3 cm."""
    cell = CELLS[name]().cell
    bare = load_arm(name)
    np.testing.assert_allclose(cell.arm.tool_offset - bare.tool_offset, [0.0, 0.0, 0.12])
    assert cell.arm.capsule_radii[-1] == 0.03 and cell.arm.variant == name
    assert (cell.ticks, cell.dt, cell.backend) == (1500, 0.008, "folded")


def test_coordinates_fit_what_is_stored(problem) -> None:
    cell = make_cell()
    person = make_people("reach_in", scene_named("robotica", 0), 0, cell.ticks * cell.dt, 1)
    frames, times = problem.coords["frame"][0], problem.coords["time"][0]
    assert len(frames) == person.a.shape[0] and frames[1] == pytest.approx(1 / PERSON_RATE)
    assert float(person.rate) == PERSON_RATE
    np.testing.assert_allclose(times, np.arange(0, cell.ticks, cell.metric_stride) * cell.dt)
    assert [labels["seed"] for labels, _ in problem.worlds] == [0, 3, 0, 3]
    assert [labels["person"] for labels, _ in problem.worlds] == ["reach_in"] * 2 + ["nobody"] * 2


@pytest.mark.usefixtures("unchecked")
@pytest.mark.parametrize("backend", ["folded", "mjx"])
def test_the_backend_is_the_one_asked_for(backend: str) -> None:
    asked = build_problem(("robotica",), ("nobody",), (0,), backend)
    assert asked.evaluate.args[0].cell.backend == backend  # pyright: ignore[reportFunctionMemberAccess]
    assert backend in str(asked.identity)


def test_what_makes_a_result_worthless() -> None:
    """Numbers that are not finite do; a torque at its limit does not."""
    assert BROKEN & NOT_FINITE_COMMAND and BROKEN & NOT_FINITE_TORQUE and not BROKEN & TORQUE_LIMITED
    assert 0 not in (NOT_FINITE_COMMAND, NOT_FINITE_TORQUE, TORQUE_LIMITED)


def test_a_cell_has_places_for_the_largest_company(problem, unchecked) -> None:
    """All worlds of a sweep have the same shapes, so the cell of every one holds as many people as any has."""
    company = build_problem(("robotica",), ("reach_in", "nobody+reach_in+pass_by", "nobody+nobody"), (0,))
    assert [build.args[0].people for _, build in company.worlds] == [3, 3, 3]
    assert [build.args[0].people for _, build in problem.worlds] == [1] * 4


@pytest.mark.parametrize(
    ("name", "inside", "outside"),
    [
        ("zeta", (1.0, 10.0), (0.99, 10.1)),
        ("K_att", (1e-4, 1.0), (9e-5, 1.01)),
        ("K_rep", (0.0, 1.0), (-1e-9, 1.01)),
        ("omega1", (1e-6, 1e3), (0.0, 1001.0)),
        ("omega2", (0.0, 1e3), (-0.1, 1001.0)),
        ("length_scale", (0.01, 0.2), (0.009, 0.21)),
        ("field.noise", (0.0, 1.0), (-0.1, 1.1)),
        ("motion.speed", (0.01, 1.5), (0.009, 1.51)),
    ],
)
def test_settings_without_a_meaning_are_refused(problem, name: str, inside: tuple, outside: tuple) -> None:
    def settings(value: float):
        return make_settings([f"{name}={value}"], problem.params, aliases=problem.aliases, domains=problem.domains)

    for value in inside:
        assert settings(value).count == 1
    for value in outside:
        with pytest.raises(UsageError, match="outside its domain"):
            settings(value)


def test_parameters_are_numbers_alone(problem) -> None:
    assert all(isinstance(leaf, float) for leaf in jax.tree.leaves(problem.params))
    assert dataclasses.is_dataclass(problem.params)
