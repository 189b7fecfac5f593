"""The program that lifts objects: physics, rows on cases made by hand. What compiles for long is in `test_grasp_motion.py`."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from experiments.grasp.config import GraspConfig, parse
from experiments.grasp.lift import RISEN, lift
from experiments.grasp.objects import NAMES, SHAPES, shape_named
from experiments.grasp.page import page
from experiments.grasp.picture import Viewpoint
from experiments.grasp.rows import BARS, all_rows, definition, holds, lower_limit
from experiments.grasp.run import run
from experiments.grasp.scene import WORK, draw_poses, make_scene
from hrcjax.grasp.gripper import Gripper
from hrcjax.lab.errors import UsageError

DOWN = np.column_stack([[1.0, 0, 0], [0, -1.0, 0], [0, 0, -1.0]])
"""Axes of a gripper that comes straight down and closes along y."""
PLACE = np.array(WORK)


def test_friction_lifts_and_nothing_else_does() -> None:
    """The same grasp of a box with pads of rubber, and with none."""
    for name in ("box", "ball"):
        rubber = make_scene(shape_named(name), (PLACE, 0.0, 0), Gripper())
        held = lift(rubber, DOWN, rubber.centre(), 0.085)
        assert held.lifted and held.risen == pytest.approx(0.15, abs=0.01) and held.pushed < 1e-3
        ice = make_scene(shape_named(name), (PLACE, 0.0, 0), Gripper(), 0.0)
        slipped = lift(ice, DOWN, ice.centre(), 0.085)
        assert not slipped.lifted and slipped.risen < 0.02


def test_nothing_is_welded_to_the_object() -> None:
    scene = make_scene(shape_named("box"), (PLACE, 0.0, 0), Gripper())
    for k in range(scene.model.neq):
        if scene.model.eq_type[k] == mujoco.mjtEq.mjEQ_WELD:
            assert scene.body not in (scene.model.eq_obj1id[k], scene.model.eq_obj2id[k])


def test_a_grasp_beside_the_object_does_not_lift() -> None:
    scene = make_scene(shape_named("box"), (PLACE, 0.0, 0), Gripper())
    missed = lift(scene, DOWN, scene.centre() + np.array([0.15, 0, 0]), 0.085)
    assert not missed.lifted and missed.risen < 0.2 * RISEN and not missed.held


@pytest.mark.parametrize("shape", SHAPES, ids=NAMES)
def test_every_shape_comes_to_rest_on_the_table(shape) -> None:
    for rest in range(len(shape.rests)):
        scene = make_scene(shape, (PLACE, 0.7, rest), Gripper())
        assert 0.01 < scene.centre()[2] < 0.06
        np.testing.assert_allclose(scene.centre()[:2], PLACE, atol=0.02)
        before = scene.centre()
        for _ in range(100):
            mujoco.mj_step(scene.model, scene.data)
        np.testing.assert_allclose(scene.centre(), before, atol=5e-4)


def test_poses_are_drawn_by_their_seed() -> None:
    one, two = draw_poses([3, 1], 4), draw_poses([3, 1], 2)
    assert [p[1] for p in one[:2]] == [p[1] for p in two] and len({p[1] for p in one}) == 4
    assert draw_poses([4, 1], 1)[0][1] != one[0][1]


def test_the_picture_of_a_point_is_where_the_pinhole_puts_it() -> None:
    view = Viewpoint(np.array([0.0, -1.0, 0.0]), np.zeros(3), 200, 100, 300.0)
    np.testing.assert_allclose(view.project(np.array([[0, 0, 0], [0.1, 0, 0], [0, 0, 0.1]])), [[100, 50], [130, 50], [100, 20]])  # fmt: skip


def made_case(lifted: bool, taken: int = 0) -> dict[str, np.ndarray]:
    case: dict[str, np.ndarray] = {
        "mask": np.array([True, True, False]),
        "looks_reached": np.array([True, False, True]),
    }
    for way, off in (("hessian", 2.0), ("pca", 4.0), ("nearest", 20.0)):
        case |= {
            f"{way}_ok": np.array([True, way != "hessian", False]), f"{way}_error": np.deg2rad([off, 3 * off, 90.0]),
            f"{way}_lifted": np.array([lifted, False]), f"{way}_taken": np.array(taken), f"{way}_free": np.array([True, True, False]),
            f"{way}_true_angle": np.array(np.deg2rad(off) if taken >= 0 else np.nan),
            f"{way}_pushed": np.array([0.001, 0]), f"{way}_turned": np.array([0.1, 0]), f"{way}_settled": np.array([0.2, 0]),
            f"{way}_true_angles": np.deg2rad([off, 10 * off, 0.0]), f"{way}_pull": np.array(8.0 * lifted),
        }  # fmt: skip
        case |= {f"{way}_fixed_{key}": case[f"{way}_{key}"] for key in ("ok", "error", "free", "taken", "true_angles", "true_angle", "lifted")}  # fmt: skip
    case |= {"aim": np.array([0.003, 0.504]), "place": np.array([0.0, 0.5])}
    if taken >= 0:
        touched = 0.002 if lifted else -0.001
        moved = {
            "off": 0.001,
            "twist": np.deg2rad(0.5),
            "free": touched,
            "links": 0.05,
            "top_speed": 0.6,
            "lifted": lifted,
            "seconds": 4.0,
        }
        case |= {f"moved_{key}": np.array(value) for key, value in moved.items()}
    return case


def test_rows_of_cases_made_by_hand() -> None:
    cases = {
        "box/0": made_case(True),
        "box/1": made_case(False),
        "mug/0": made_case(True),
        "mug/1": made_case(False, -1),
    }
    rows = all_rows(cases, (0.8, 0.3))
    value = {name: entry["value"] for name, entry in rows.items()}
    assert value["objects"] == 4 and value["lifted_share"] == 0.5 and value["found_share"] == 0.75
    assert value["lifted_of_found"] == pytest.approx(2 / 3) and value["lifted_share_friction030"] == 0
    assert value["lifted_share_low"] == pytest.approx(0.0976, abs=1e-4)  # 2 of 4; of 4 of 4 0.05^(1/4)
    assert lower_limit(4, 4) == pytest.approx(0.05**0.25) and lower_limit(0, 4) == 0
    assert value["lifted_share_box"] == 0.5 and value["lifted_share_mug_pca"] == 0.5
    assert value["normal_error"] == pytest.approx(2) and value["normal_error_pca"] == pytest.approx(8)
    assert value["normal_error_same_pca"] == pytest.approx(4) and value["true_angle_nearest"] == pytest.approx(20)
    assert value["pushed"] == pytest.approx(1) and value["looks_reached_share"] == pytest.approx(2 / 3)
    assert holds("lifted_share", 0.5) is False and holds("lifted_share", 0.8) and holds("points", 0) is None
    # angles of 2 and 20 degrees are within 26.6, those of 4 and 40 half, those of 20 and 200 half
    assert [value[f"antipodal_share{end}"] for end in ("", "_pca", "_nearest")] == [1, 0.5, 0.5]
    assert value["pull"] == 4 and value["pull_p10"] == 0 and value["settled"] == pytest.approx(np.rad2deg(0.2))
    assert value["lifted_share_fixed_pca"] == 0.5 and value["found_share_fixed"] == 0.75
    assert (
        value["reached"] == pytest.approx(2 / 3)
        and value["reach_touched"] == 1
        and value["reach_lifted"] == pytest.approx(2 / 3)
    )
    assert value["reach_error_mm"] == pytest.approx(1) and value["reach_error_deg"] == pytest.approx(0.5)
    assert value["aim_error"] == pytest.approx(5) and value["reach_seconds"] == 4
    assert value["normal_error_mug_pca"] == pytest.approx(8)
    assert set(BARS) <= set(rows) and all(definition(name) for name in rows)
    text = page(rows, GraspConfig(), ["figures/grasp-lift.gif"])
    assert "(missed)" in text and "![figures/grasp-lift.gif]" in text and text.count("| lifted_share_friction030") == 3
    assert "0.667 of the grasps" in text and "less than the plane on box, mug;" in text
    worse = {name: entry | {"value": 90.0} if name == "normal_error_box" else entry for name, entry in rows.items()}
    assert "less than the plane on mug; not less on box." in " ".join(page(worse, GraspConfig()).split())


def test_options_are_checked() -> None:
    assert parse([]) == GraspConfig() and parse(["--quick"]).poses == 1
    for wrong in (
        {"shapes": ("cube",)},
        {"shapes": ("box", "box")},
        {"poses": 0},
        {"friction": -1.0},
        {"slippery": (0.8,)},
        {"slippery": (0.301, 0.3)},  # one row for both
        {"friction": float("nan")},
        {"seed": -1},
    ):
        with pytest.raises(UsageError):
            run(replace(GraspConfig(), **wrong))
