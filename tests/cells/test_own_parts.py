"""The page on parts of one's own: its code runs as a user's would, and changes the motion; no part switches a guard off."""

import importlib
import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from straight import straight_plan, straight_route

from hrcjax.cells.check import check_cell
from hrcjax.cells.digest import cell_digest
from hrcjax.cells.named_cell import NamedCell, find_cell
from hrcjax.cells.results import evaluate
from hrcjax.cells.ur5 import CELLS, make_cell
from hrcjax.field import FAR
from hrcjax.lab.errors import UsageError
from hrcjax.lab.parameters import batch_params, leaf_names
from hrcjax.numerics import unrolled_options
from hrcjax.plan import PotentialParams
from hrcjax.robot import COVER_MARGIN, arm_capsules, arm_from_model, control_points, load_arm, tool_frame, ur_xml
from hrcjax.safety import SafetyDecision, SsmParams
from hrcjax.sense.rig import cell_rig
from hrcjax.sim import (
    GP_FIELD,
    Cell,
    FieldPart,
    Params,
    SafetyPart,
    SenseParams,
    Task,
    World,
    follow,
    make_world,
    tick,
)
from hrcjax.sim.tick import NOT_FINITE_COMMAND, NOT_FINITE_READING, Sensed, initial_state, unit_where_long
from hrcjax.sweeps.sweepable import Metric
from hrcjax.world import capsules_obstacle_distances, motion_named, obstacle_distances, scene_named, together

SHORT = SenseParams(settled=1000.0)
"""The set-up ends with the scan, though in small images the map has not settled."""
PAGE = Path(__file__).parents[2] / "docs" / "own-parts.md"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The page's modules and its MJCF file, in the current folder of a user."""
    folder = tmp_path_factory.mktemp("own")
    text = PAGE.read_text(encoding="utf-8")
    for name, code in re.findall(r"```python\n# (\w+\.py)\n(.*?)```", text, re.DOTALL):
        with open(folder / name, "a", encoding="utf-8") as file:
            file.write(code)
    (folder / "seven.xml").write_text(re.findall(r"```xml\n(.*?)```", text, re.DOTALL)[0])
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.syspath_prepend(folder)
        yield folder
    for name in ("my_cell", "map_cell", "seven_cell", "slow_cell", "one_episode"):
        sys.modules.pop(name, None)


@pytest.fixture(scope="module")
def own(folder: Path) -> dict[str, NamedCell]:
    return {name: find_cell(f"{name}:build", CELLS) for name in ("my_cell", "map_cell", "seven_cell")}


@pytest.fixture(scope="module")
def together_cell(own: dict[str, NamedCell]) -> NamedCell:
    """All four at once: a policy, a planner, the fused map and a seven-joint arm; short, so that it compiles soon."""
    mine, mapped, seven = (own[name] for name in ("my_cell", "map_cell", "seven_cell"))
    field = {"field": mapped.cell.field, "layout": mapped.cell.layout}
    cell = replace(mine.cell, arm=seven.cell.arm, ticks=60, substeps=2, **field)
    return replace(mine, cell=cell, params=eqx.tree_at(lambda p: p.field, mine.params, mapped.params.field))


def small_world(cell: Cell, decimation: int) -> World:
    """Nobody is there, and nothing is taken for somebody."""
    scene = scene_named("robotica", 0)
    person = motion_named("nobody", scene, 0, 2.0, 30.0)
    world = make_world(cell, scene, person, cell_rig(scene, decimation=decimation), jax.random.key(0), SHORT)
    return eqx.tree_at(lambda w: w.frames.moving.mask, world, jnp.zeros_like(world.frames.moving.mask))


@pytest.fixture(scope="module")
def world(together_cell: NamedCell) -> World:
    return small_world(together_cell.cell, 4)


def test_leaves_of_own_parts_have_dotted_names_and_domains(own: dict[str, NamedCell]) -> None:
    mine = own["my_cell"]
    names = leaf_names(mine.params)
    assert names["policy.stiffness"] == 25.0 and names["plan.rise"] == 0.1
    assert not any(name.startswith(("plan.omega1", "policy.target")) for name in names)
    assert mine.known_domains()["plan.rise"] == (0.0, 0.5) and mine.known_domains()["policy.push"][0] == -np.inf
    aliases = mine.known_aliases()
    assert aliases["K_att"] == "potential.k_att" and aliases["length_scale"] == "field.length_scale"


def test_digest_of_a_cell_follows_all_that_decides_its_results(folder: Path, own: dict[str, NamedCell]) -> None:
    seven = own["seven_cell"]
    before = cell_digest(seven)
    assert cell_digest(find_cell("seven_cell:build", CELLS)) == before and seven.identity is None
    assert cell_digest(CELLS["ur5"]()) == ""
    text = (folder / "seven.xml").read_text()
    (folder / "seven.xml").write_text(text + "\n")
    assert cell_digest(seven) != before, "a file that the cell names"
    (folder / "seven.xml").write_text(text.replace('range="-1.7 1.7"', 'range="-1.5 1.5"'))
    assert cell_digest(replace(find_cell("seven_cell:build", CELLS), files=())) != cell_digest(replace(seven, files=()))
    (folder / "seven.xml").write_text(text)
    assert cell_digest(replace(seven, cell=replace(seven.cell, ticks=7))) != before
    arrays = [replace(seven, params=Params(policy={"w": np.full(3, v)})) for v in (1.0, 2.0)]
    assert cell_digest(arrays[0]) != cell_digest(arrays[1]), "arrays, which are not swept"
    module = (folder / "map_cell.py").read_text()  # imported by this process
    (folder / "map_cell.py").write_text(module + "\n")
    with pytest.raises(UsageError, match=r"map_cell\.py was edited after this process had imported it"):
        cell_digest(seven)
    (folder / "map_cell.py").write_text(module)
    assert cell_digest(seven) == before


def nested(params, arm, goal, clearance, limits):
    return arm.q


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"policy": lambda p, arm, goal, room, limits: p["gain"]},
            "policy: returns an array of shape (); accepted: (6,)",
        ),
        ({"policy": lambda p, arm, goal, room, limits: arm.q[:3]}, "policy: returns an array of shape (3,)"),
        ({"policy": lambda p, arm, goal, room, limits: None}, "policy: returns NoneType"),
        (
            {"plan": lambda p, task: jnp.zeros((4, 3))},
            "planner: returns an array of shape (4, 3); accepted: a PathResult",
        ),
        (
            {"safety": SafetyPart(lambda dtype: (), lambda p, m, s: (m, 0.1))},
            "monitor: returns an array of shape (); accepted: a Safety",
        ),
        ({"safety": SafetyPart(lambda dtype: (), lambda p, m, s: m)}, "monitor: returns tuple; accepted: (memory, Saf"),
    ],
)
def test_parts_that_return_something_else_are_named_before_a_world_is_built(change: dict, words: str) -> None:
    with pytest.raises(UsageError) as refused:
        params = Params(policy={"gain": 1.0}) if "policy" in change else Params()
        check_cell(NamedCell(replace(make_cell(), **{"plan": straight_plan, **change}), params))
    assert words in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"params": Params(policy={"on": True})}, "parameter policy.on is a bool"),
        ({"params": Params(policy={"mode": "soft"})}, "parameter policy.mode is a str"),
        ({"params": Params(policy=object())}, "parameter policy is a object"),
        ({"params": Params(policy={"a.b": 1.0, "a": {"b": 2.0}})}, "policy.a.b: two leaves"),
        ({"domains": {"motion.sped": (0.0, 1.0)}}, "domains of the cell: no parameter 'motion.sped'"),
        ({"aliases": {"g": "policy.gian"}}, "aliases of the cell: no parameter 'policy.gian'"),
        ({"metrics": {"tool": (Metric("m", "low", ""), abs)}}, "metric 'tool': results have this name already"),
        ({"metrics": {"mine": abs}}, "metric 'mine': accepted is (Metric("),
    ],
)
def test_faults_of_names_and_leaves_are_told(change: dict, words: str) -> None:
    cell = replace(make_cell(), policy=nested)
    with pytest.raises(UsageError) as refused:
        check_cell(NamedCell(**{"cell": cell, "params": Params(policy={"gain": 1.0}), **change}))
    assert words in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("ur6", "no cell 'ur6'; accepted: ur5, ur5e, ur5-reflected, ur5-body, or MODULE:FUNCTION"),
        ("no_module_here:build", "ModuleNotFoundError"),
        ("my_cell:nothing", "has no attribute 'nothing'"),
        ("my_cell:Spring", "returns Spring; accepted: a Cell or a NamedCell"),
        ("my_cell:spring", "TypeError"),
    ],
)
def test_cells_that_are_none_are_refused_in_one_line(folder: Path, name: str, words: str) -> None:
    with pytest.raises(UsageError) as refused:
        find_cell(name, CELLS)
    assert words in str(refused.value) and "\n" not in str(refused.value)


def test_the_planner_of_the_page_draws_the_arch_it_says(own: dict[str, NamedCell]) -> None:
    scene = scene_named("robotica", 0)
    cell = own["my_cell"].cell
    task, plan = Task(scene, jnp.zeros(6), PotentialParams(), cell.arm), own["my_cell"].cell.plan
    flat, arch = (plan({"rise": jnp.asarray(rise, jnp.float32)}, task) for rise in (0.0, 0.2))
    np.testing.assert_allclose(flat.length, np.linalg.norm(np.subtract(scene.goal, scene.start)), rtol=1e-5)
    assert float(flat.bending_energy) < 1e-6 < float(arch.bending_energy)
    line = np.asarray(flat.waypoints)
    np.testing.assert_allclose(np.max(np.asarray(arch.waypoints)[:, 2] - line[:, 2]), 0.2, rtol=0.02)
    u = np.linspace(0, 1, 16)
    np.testing.assert_allclose(arch.waypoints[:, 2], line[:, 2] + 0.2 * np.sin(np.pi * u), atol=1e-6)


@pytest.mark.slow
def test_all_four_parts_move_the_arm_and_their_leaves_are_swept(together_cell: NamedCell, world: World) -> None:
    values = {"policy.stiffness": np.array([25.0, 25.0, 100.0]), "plan.rise": np.array([0.0, 0.2, 0.0])}
    batch = batch_params(together_cell.params, values)
    program = jax.jit(lambda batch, world: evaluate(together_cell, batch, world))
    out = program.lower(batch, world).compile(compiler_options=unrolled_options())(batch, world)
    assert out["plan"].shape == (3, 16, 3) and np.isfinite(out["tool"]).all()
    lengths = np.asarray(out["plan_length"])
    assert lengths[1] > lengths[0] + 0.05 and lengths[2] == lengths[0]
    tool, start = np.asarray(out["tool"]), np.asarray(world.scene.start)
    assert np.linalg.norm(tool[:, 0] - start, axis=1).max() < 2e-3
    moved = np.linalg.norm(tool[:, -1] - start, axis=1)
    assert (moved > 0.01).all()
    assert tool[1, -1, 2] > tool[0, -1, 2] + 0.005, "the arm follows the planner's arch"
    assert np.abs(tool[2, -1] - tool[0, -1]).max() > 1e-5, "the policy's stiffness reaches the motion"


@pytest.mark.slow
def test_the_episode_the_monitor_and_the_metric_of_the_page(folder: Path, ur5_world: tuple[Cell, World]) -> None:
    """The monitor's speed is kept, the metric is that of the record, and the page's program runs with both."""
    one_episode = importlib.import_module("one_episode")
    slow, world = find_cell("slow_cell:build", CELLS), ur5_world[1]
    cell = replace(slow.cell, ticks=ur5_world[0].ticks, substeps=2, plan=straight_plan)  # the planner is not the page's
    check_cell(replace(slow, cell=cell))
    one_episode.cell, params = cell, jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), slow.params)
    tool = jax.jit(lambda p: one_episode.tool_path(p, world))(params)  # as a notebook does: the world closed over
    speed = np.linalg.norm(np.diff(tool, axis=0), axis=1) / cell.dt
    assert tool.shape == (cell.ticks, 3) and 0.02 < speed.max() < 0.12
    record = SimpleNamespace(tool=jnp.zeros((5, 3)), reference=jnp.asarray([[3.0, 0, 4.0]] * 5))
    assert float(slow.metrics["tracking_error"][1](params, cell, world, SimpleNamespace(record=record))) == 5.0


def test_the_fused_map_reads_the_scene(own: dict[str, NamedCell], together_cell: NamedCell, world: World) -> None:
    """Beside the columns, on the sides of both cameras, as far as small images show them."""
    mapped, scene = own["map_cell"], world.scene
    fields = mapped.cell.field.fit(mapped.params.field, world.frames)
    now = eqx.tree_at(lambda f: f.moving, fields, jax.tree.map(lambda a: a[0], fields.moving))
    cameras = np.asarray(cell_rig(scene).cameras.position)
    read = jax.jit(lambda x: mapped.cell.field.read(mapped.params.field, now, x))
    there = np.asarray(scene.mask)
    columns = zip(np.asarray(scene.center)[there], np.asarray(scene.size)[there], strict=True)
    for (centre, size), camera in product(columns, cameras):
        towards = (camera - centre)[:2] / np.linalg.norm((camera - centre)[:2])
        for gap in (0.05, 0.1):
            x = np.array([*(centre[:2] + (size[0] + gap) * towards), min(0.12, 1.6 * centre[2])], np.float32)
            reading, exact = read(jnp.asarray(x)), float(np.min(obstacle_distances(scene, jnp.asarray(x))))
            assert abs(float(reading.distance) - exact) < 0.03
            across = np.asarray(reading.gradient)[:2]
            assert across @ towards / np.linalg.norm(across) > 0.9 or gap > 0.05 or exact < gap - 1e-3
        assert float(reading.person_distance.min()) > 5.0


@pytest.fixture(scope="module")
def ur5_world() -> tuple[Cell, World]:
    cell = replace(make_cell(), ticks=60, substeps=2)
    return cell, small_world(cell, 8)


@pytest.fixture(scope="module")
def one_tick(ur5_world: tuple[Cell, World]):
    """Cell -> (params, speed of the joints) -> record of one tick of an arm that moves, with nobody near, along the straight path."""
    cell, world = ur5_world
    route = straight_route(cell, world)
    fields = cell.field.fit(Params().field, world.frames)
    now = eqx.tree_at(lambda f: f.moving, fields, jax.tree.map(lambda a: a[0], fields.moving))
    no = jnp.asarray(False)
    sensed = Sensed(now, jnp.asarray(0.05, jnp.float32), ~no, no, jnp.zeros((), jnp.int32))

    def program(changed: Cell):
        @partial(jax.jit, compiler_options=unrolled_options())
        def run(params, qd):
            state = initial_state(changed, world.q_start)
            state = eqx.tree_at(lambda s: s.arm.qd, state, jnp.full_like(world.q_start, qd))
            return tick(params, changed, route, sensed, state)[1]

        return lambda params, qd=0.3: run(jax.tree.map(jnp.float32, params), jnp.float32(qd))

    return program


def test_a_policy_cannot_pass_the_guards(ur5_world: tuple[Cell, World], one_tick) -> None:
    cell, _ = ur5_world
    policy = lambda params, arm, goal, clearance, limits: params["gain"] * arm.q + params["push"]  # noqa: E731
    program = one_tick(replace(cell, policy=policy))
    record = program(Params(policy={"gain": np.nan, "push": 0.0}))
    assert int(record.status) & NOT_FINITE_COMMAND and np.all(np.asarray(record.qdd) < -5.0)
    record = program(Params(policy={"gain": 0.0, "push": 1e6}), 3.1)
    after = np.asarray(record.qd) + cell.dt * np.asarray(record.qdd)
    assert np.all(np.abs(record.qdd) <= cell.arm.qdd_max + 1e-3) and np.all(after <= cell.arm.qd_max + 1e-4)


@pytest.fixture(scope="module")
def lax_cell(ur5_world: tuple[Cell, World]) -> Cell:
    """A monitor that lets everything pass; what the parameters multiply by NaN is not finite."""
    cell, _ = ur5_world

    def allow(params, memory, separation):
        d = separation.distance
        no = jnp.zeros((), jnp.int32)
        return memory, SafetyDecision(
            zone=no, speed_limit=10.0 * params["speed_limit"], point_limit=jnp.full_like(d, 10.0) * params["point_limit"],
            scale=jnp.ones((), d.dtype), hold=jnp.asarray(False), reasons=no,
        )  # fmt: skip

    def read(params, fields, x):
        reading = cell.field.read(params["own"], fields, x)
        return eqx.tree_at(lambda r: r.person_distance, reading, reading.person_distance * params["distance"])

    safety = SafetyPart(lambda dtype: jnp.zeros((), dtype), allow)
    still = lambda params, arm, goal, clearance, limits: jnp.zeros_like(arm.q)  # noqa: E731
    return replace(cell, safety=safety, field=replace(cell.field, read=read), policy=still)


@pytest.fixture(scope="module")
def lax(one_tick, lax_cell: Cell):
    return one_tick(lax_cell)


@pytest.mark.parametrize("broken", ["", "distance", "speed_limit", "point_limit"])
def test_a_reading_or_limit_that_is_not_finite_holds_the_arm(lax, lax_cell: Cell, broken: str) -> None:
    """Also under a monitor that lets everything pass."""
    factor = {name: np.nan if name == broken else 1.0 for name in ("distance", "speed_limit", "point_limit")}
    field = {"own": Params().field, "distance": factor.pop("distance")}
    held = lax(Params(policy={"gain": 1.0}, field=field, safety=factor))
    if broken:
        np.testing.assert_allclose(held.qdd, -15.0, rtol=1e-3)
    else:
        assert np.abs(held.qdd).max() < 10.0
    assert int(held.status) == (NOT_FINITE_READING if broken else 0)
    assert lax_cell.safety.yardstick(None) == SsmParams()


def test_gradients_of_a_part_are_made_unit_where_they_have_a_direction() -> None:
    g = jnp.asarray([[0.6, 0.0, 0.0], [0.0, 3.0, 4.0], [0.0, 0.0, 0.4], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(unit_where_long(g), [[1, 0, 0], [0, 0.6, 0.8], [0, 0, 0.4], [0, 0, 0]])
    assert GP_FIELD.unit_gradients and not FieldPart(GP_FIELD.fit, GP_FIELD.read, unit_gradients=False).unit_gradients


def test_rows_that_are_not_one_per_frame_are_refused(ur5_world: tuple[Cell, World]) -> None:
    cell, world = ur5_world
    fields = cell.field.fit(Params().field, world.frames)
    half = replace(fields, moving=jax.tree.map(lambda a: a[::2], fields.moving))
    with pytest.raises(ValueError, match="one per frame"):
        follow(Params(), cell, straight_route(cell, world, 8), world.frames, world.q_start, half)


def test_two_people_are_held(ur5_world: tuple[Cell, World]) -> None:
    """Where one person's places would not do for both."""
    cell = replace(ur5_world[0], people=2, moving_points=400)
    scene = ur5_world[1].scene
    both = together(
        [motion_named(name, scene, seed, 2.0, 30.0) for seed, name in enumerate(("reach_in", "stand_and_work"))]
    )
    assert both.radius.shape == (28,) and len(both.regions) == 28
    assert bool((together([both, motion_named("nobody", scene, 0, 2.0, 30.0)]).radius[28:] == -1).all())
    frames = make_world(cell, scene, both, cell_rig(scene, decimation=8), jax.random.key(0), SHORT).frames
    counts = np.asarray(frames.moving.mask).sum(axis=1)
    assert frames.moving.mask.shape[1] == 2 * 400 and counts.max() > 400
    assert (np.asarray(frames.beyond)[counts < 2 * 400] == FAR).all(), "everybody has points"
    with pytest.raises(ValueError, match="records of one length"):
        together([both, motion_named("nobody", scene, 0, 1.0, 30.0)])


# arms from models -----------------------------------------------------------------------------------------------------


def test_a_seven_joint_arm_is_where_mujoco_has_it(own: dict[str, NamedCell]) -> None:
    arm = own["seven_cell"].cell.arm
    data, random = mujoco.MjData(arm.model), np.random.default_rng(0)
    for _ in range(10):
        q = random.uniform(arm.q_min, arm.q_max)
        data.qpos[:] = q
        mujoco.mj_kinematics(arm.model, data)
        R, p = tool_frame(arm, jnp.asarray(q))
        np.testing.assert_allclose(p, data.site("tool").xpos, atol=1e-9)
        np.testing.assert_allclose(R, data.site("tool").xmat.reshape(3, 3), atol=1e-9)
        capsules = arm_capsules(arm, jnp.asarray(q))
        for k, name in enumerate(arm.capsule_names):
            geom = data.geom(name)
            np.testing.assert_allclose((capsules.a[k] + capsules.b[k]) / 2, geom.xpos, atol=1e-9)
            axis = geom.xmat.reshape(3, 3)[:, 2] * arm.model.geom(name).size[1]
            np.testing.assert_allclose((capsules.b[k] - capsules.a[k]) / 2, axis, atol=1e-9)
    assert arm.chain.size == 7 and arm.tau_max.tolist() == [87.0] * 4 + [12.0] * 3
    np.testing.assert_array_equal(arm.q_min[[1, 3, 5]], [-1.7, -3.0, 0.0])
    np.testing.assert_array_equal(arm.q_max[[1, 3, 5]], [1.7, 0.0, 3.7])


def test_control_spheres_cover_every_moving_capsule(own: dict[str, NamedCell]) -> None:
    arm = own["seven_cell"].cell.arm
    q = jnp.asarray(arm.home)
    capsules, centres = arm_capsules(arm, q), np.asarray(control_points(arm, q))
    random = np.random.default_rng(0)
    for k, link in enumerate(arm.capsule_links):
        if link < 0:
            continue
        a, b, r = (np.asarray(v[k]) for v in (capsules.a, capsules.b, capsules.radius))
        way = random.normal(size=(2000, 3))
        x = a + random.uniform(0, 1, (2000, 1)) * (b - a) + r * way / np.linalg.norm(way, axis=1, keepdims=True)
        outside = np.min(np.linalg.norm(x[:, None] - centres, axis=2) - arm.control_radii, axis=1)
        assert outside.max() < COVER_MARGIN


def test_the_ur5_read_from_its_own_model_is_the_ur5() -> None:
    table = load_arm("ur5")
    arm = arm_from_model(mujoco.MjModel.from_xml_string(ur_xml("ur5")), "ur5")  # pyright: ignore[reportAttributeAccessIssue]
    q = jnp.asarray(np.random.default_rng(1).uniform(-1, 1, 6), jnp.float32)
    for ours, theirs in zip(tool_frame(arm, q), tool_frame(table, q), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-6)
    scene = scene_named("robotica", 0)
    gaps = [np.sort(np.min(capsules_obstacle_distances(scene, arm_capsules(one, q)), axis=1)) for one in (arm, table)]
    np.testing.assert_allclose(gaps[0], gaps[1], atol=1e-6)
    np.testing.assert_array_equal(arm.tau_max, table.tau_max)
    np.testing.assert_allclose(arm.home, table.home)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("<site", "<!-- <site"), "no site 'tool'"),
        (('name="home"', 'name="rest"'), "no keyframe 'home'; accepted: rest"),
        (('<motor joint="j3"/>', ""), "states no torque of joint 'j3'"),
        (('type="capsule"', 'type="box"'), "no geom rides on a moving link"),
        (('name="fore" ', 'name="fore" type="ellipsoid" contype="1" '), "geom fore collides and is no sphere"),
        (('name="fore" ', 'name="fore" type="ellipsoid" '), "no geom rides on the link of joint 'j4'"),
        (('joint="j3"/>', 'joint="j3" forcerange="0 87"/>'), "states no torque of joint 'j3'"),
    ],
)
def test_models_that_are_no_arm_are_refused(folder: Path, change: tuple[str, str], words: str) -> None:
    text = (folder / "seven.xml").read_text()
    if change[0] == "<site":
        text = re.sub("<site[^>]*/>", "", text)
    elif "ellipsoid" in change[1]:
        text = re.sub(r'(name="fore" )fromto="[^"]*" size="([^"]*)"', r'\1size="\2 \2 \2"', text).replace(*change)
    elif "box" in change[1]:
        text = re.sub(r'fromto="[^"]*" size="([^"]*)"', r'size="\1 \1 \1"', text).replace(*change)
    else:
        text = text.replace(*change)
    model = mujoco.MjModel.from_xml_string(text)  # pyright: ignore[reportAttributeAccessIssue]
    with pytest.raises(ValueError, match=re.escape(words)):
        arm_from_model(model, "seven")
