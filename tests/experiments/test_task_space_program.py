"""The program of task-space mapping: tables, matches and rows by hand-made answers, recorded frames, errors in one line."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from experiments.sweep.config import parse as parse_sweep
from experiments.task_space.__main__ import main
from experiments.task_space.config import FRESH, TaskSpaceConfig, parse
from experiments.task_space.evaluate import wanted
from experiments.task_space.figures import grid_image
from experiments.task_space.measures import measure_table, size_error
from experiments.task_space.page import page
from experiments.task_space.recorded import view_of_frame
from experiments.task_space.rows import BARS, WORDS, all_rows, holds
from experiments.task_space.run import run
from experiments.task_space.tables import hull, surface, table_of
from hrcjax.io.recordings.open_input import open_input
from hrcjax.lab.errors import UsageError
from hrcjax.task_space import Instance, ObstacleGrid, Table, TaskSpace, find_table, solid_distances
from hrcjax.world.scene import BOX, COLUMN, SPHERE
from hrcjax.world.scenes import Obstacle

FRAMES = Path(__file__).parents[3] / "shared" / "data" / "rgbd"
FLAT = Table(
    np.array([0.0, 0, 1]), 0.0, 0.001, 1.0, np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]]), np.eye(3), np.zeros(3)
)
BALL = Obstacle(SPHERE, (0.3, 0.4, 0.05), (0.05, 0.05, 0.05), 0.0, 0.05)
CRATE = Obstacle(BOX, (0.6, 0.4, 0.05), (0.06, 0.03, 0.05), 0.4, 0.06)


def instance(kind: int, center: tuple, size: tuple, yaw: float = 0.0) -> Instance:
    nothing = np.full(3, 1e-3)
    return Instance(
        "object", kind, np.array(center), np.array(size), yaw, nothing, nothing, 1e-3, 0.0, np.zeros((1, 3))
    )


def measured(found: list[Instance], things: list[Obstacle]) -> dict:
    return measure_table(things, TaskSpace(FLAT, found, []), [], 0)


def test_tables_are_what_the_page_says() -> None:
    counts = []
    for seed in range(40):
        things = table_of(seed)
        counts.append(len(things))
        for k, o in enumerate(things):
            edges = 2 * np.array(o.size)
            assert edges.min() >= 0.03 and edges.max() <= 0.15 and o.center[2] == o.size[2]
            for other in things[:k]:
                assert (
                    np.hypot(o.center[0] - other.center[0], o.center[1] - other.center[1])
                    >= hull(o) + hull(other) + 0.0019
                )
    assert min(counts) == 1 and max(counts) == 8 and table_of(7) == table_of(7)


@pytest.mark.parametrize("o", [BALL, CRATE, Obstacle(COLUMN, (0.1, 0.2, 0.06), (0.03, 0.03, 0.06), 0.0, 0.03)])
def test_samples_lie_on_the_surface_on_all_sides(o: Obstacle) -> None:
    place = surface(o, np.random.default_rng(0), 4000)
    off = solid_distances(o.kind, np.array(o.center), np.array(o.size), o.yaw, place)
    assert np.abs(off).max() < 1e-9
    np.testing.assert_allclose(place.mean(0), o.center, atol=0.004)
    assert place[:, 2].min() < 0.002 and place[:, 2].max() > 2 * o.center[2] - 0.002


def test_a_right_answer_is_right() -> None:
    found = [instance(SPHERE, (0.304, 0.4, 0.05), (0.048,) * 3), instance(BOX, (0.6, 0.4, 0.05), (0.03, 0.06, 0.05), 0.4 + np.pi / 2)]  # fmt: skip
    got = measured(found, [BALL, CRATE])
    assert got["match"].tolist() == [0, 1] and got["false"] == 0
    np.testing.assert_allclose(got["centre_error"], [0.004, 0.0], atol=1e-12)
    np.testing.assert_allclose(got["size_error"], [0.002, 0.0], atol=1e-12)
    assert (got["covered"] == 1).all() and got["worst"][0] == pytest.approx(0.006, abs=5e-4)


def test_wrong_answers_are_wrong() -> None:
    away = measured([instance(SPHERE, (0.3, 0.4, 0.12), (0.05,) * 3)], [BALL, CRATE])
    assert away["match"].tolist() == [-1, -1] and away["false"] == 1 and not away["merged"].any()
    assert away["false_center"].tolist() == [[0.3, 0.4, 0.12]]
    small = measured([instance(SPHERE, (0.3, 0.4, 0.05), (0.02,) * 3)], [BALL])
    assert small["match"].tolist() == [0] and small["covered"][0] == 0
    twice = measured([instance(SPHERE, (0.3, 0.4, 0.05), (0.05,) * 3)] * 2, [BALL])
    assert twice["false"] == 1
    assert measured([], [BALL])["match"].tolist() == [-1]
    assert size_error(CRATE, BOX, np.array([0.03, 0.06, 0.05]), 0.4) == pytest.approx(0.03)


def test_two_that_touch_may_be_one_that_covers_both() -> None:
    other = CRATE._replace(center=(0.3, 0.4 + 0.05 + 0.031, 0.05), yaw=0.0)
    got = measured([instance(BOX, (0.3, 0.445, 0.05), (0.07, 0.1, 0.06))], [BALL, other])
    assert sorted((got["match"] >= 0) | got["merged"]) == [True, True] and got["false"] == 0
    far = measured([instance(BOX, (0.3, 0.445, 0.05), (0.07, 0.1, 0.06))], [BALL, CRATE])
    assert not far["merged"].any()


def test_rows_and_page() -> None:
    good = measured([instance(SPHERE, BALL.center, BALL.size)], [BALL])
    bad = measured([instance(SPHERE, (0.0, 0.0, 0.05), BALL.size)], [BALL])
    cases = [{k: np.asarray(v) for k, v in (one | {"seconds": 1.0, "offset": 0.001, "normal": FLAT.normal}).items()} for one in (good, bad)]  # fmt: skip
    rows = all_rows(cases)
    assert set(rows) == set(WORDS) and set(BARS) <= set(rows)
    assert rows["found"]["value"] == 50 and rows["false"]["value"] == 50 and rows["covered"]["value"] == 100
    assert (
        rows["table_mm"]["value"] == pytest.approx(1.0) and holds("found", 50.0) is False and holds("kind", 1.0) is None
    )
    text = page(rows, cases, parse(["--evaluate"]), ["f.png"], "")
    assert "| 1 | sphere | 10 x 10 x 10 |" in text and "(missed)" in text and "| 1 | false |" in text


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("found", [[], [instance(SPHERE, (0.0, 0.0, 0.05), BALL.size)]])
def test_where_nothing_was_found_rows_are_no_numbers(found: list[Instance]) -> None:
    case = measured(found, [BALL]) | {"seconds": 1.0, "offset": 0.001, "normal": FLAT.normal}
    rows = all_rows([{name: np.asarray(value) for name, value in case.items()}])
    assert rows["found"]["value"] == 0 and rows["false"]["value"] == 100 * len(found)
    assert all(np.isnan(rows[name]["value"]) for name in ("found_seen", "covered", "covered_points", "worst_mm_p95", "size_mm", "kind"))  # fmt: skip
    assert holds("covered", rows["covered"]["value"]) is False


def test_tables_have_their_numbers_and_fresh_ones_a_column() -> None:
    config = parse(["--evaluate", "--first", "75", "--tables", "1", "--fresh", "1"])
    assert list(wanted((*config.numbers, *config.fresh_numbers), 16)) == ["table 75", f"table {FRESH}"]
    case = measured([], [BALL]) | {"seconds": 1.0, "offset": 0.001, "normal": FLAT.normal}
    cases = [{name: np.asarray(value) for name, value in case.items()}]
    text = page(all_rows(cases), cases, config, [], "", all_rows(cases), cases)
    assert "| 75 | sphere |" in text and f"| {FRESH} | sphere |" in text
    assert (
        f"| row | value | tables from {FRESH} on | unit |" in text and "| found | 0 | 0 | % | >= 95 (missed) |" in text
    )


def test_the_grid_as_a_picture_has_y_upwards() -> None:
    cells = np.zeros((3, 2), np.uint8)
    cells[2, 1] = 1  # greatest x and y
    picture = np.asarray(grid_image(ObstacleGrid(cells, cells > 0, np.zeros(2), 0.1)))
    assert picture.shape == (2, 3) and picture[0, 2] == 255 and picture.sum() == 255
    assert isinstance(grid_image(ObstacleGrid(cells, cells > 0, np.zeros(2), 0.1)), Image.Image)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "nothing to do"),
        (["--input", "/nowhere"], "nothing at /nowhere"),
        (["--input", "x", "--up", "0", "0"], "--up has 2 numbers"),
        (["--input", "x", "--up", "0", "0", "0"], "no direction"),
        (["--input", "x", "--names", "n"], "--names needs --segmenter"),
        (["--input", "x", "--json", "j.json"], "--json needs --evaluate"),
        (["--evaluate", "--tables", "0"], "--tables 0"),
    ],
)
def test_errors_are_one_line(words: list[str], message: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    printed = capsys.readouterr().err
    assert message in printed.splitlines()[-1] and printed.splitlines()[-1].startswith("error: ")


@pytest.mark.skipif(not FRAMES.is_dir(), reason="no recorded frames in ../shared/data/rgbd")
def test_the_dining_table_of_the_first_recorded_frame_is_found() -> None:
    """By hand from the image: the table's edge nearest to the camera is a meter or two away, its top below the camera."""
    view = view_of_frame(next(iter(open_input(FRAMES))), None)
    table = find_table([view], -view.rotation[:, 1], 0.8)
    height = table.normal @ view.position - table.offset
    assert 0.3 < height < 1.0 and table.deviation < 0.01
    assert table.normal @ -view.rotation[:, 1] > 0.85


def test_the_sweep_takes_sensed_obstacles_and_scene_files(capsys: pytest.CaptureFixture[str]) -> None:
    from experiments.sweep.__main__ import main as sweep

    assert parse_sweep([]).obstacles == "known" and parse_sweep(["--obstacles", "sensed"]).obstacles == "sensed"
    assert sweep(["--scene", "/nowhere/s.toml"]) == 2
    assert "error: scene /nowhere/s.toml: " in capsys.readouterr().err


def test_tables_are_not_looked_at_and_fresh_at_once() -> None:
    with pytest.raises(UsageError, match=f"table {FRESH + 3} is among both"):
        run(TaskSpaceConfig(evaluate=True, first=FRESH + 3, tables=2, fresh=10))


def test_the_page_shows_the_command_that_was_run() -> None:
    words = [
        "--evaluate",
        "--first",
        "7",
        "--tables",
        "3",
        "--input",
        "/some/where",
        "--up",
        "0",
        "0.5",
        "1",
        "--page",
        "/p.md",
    ]
    config = parse(words)
    command = "python -m experiments.task_space --evaluate --input FRAMES --tables 3 --first 7 --up 0 0.5 1 --page FILE"
    assert config.command() == command
    assert f"Written by `{command}`; do not edit." in page({}, [], config, [], "")
    again = parse(command.split()[3:])
    assert (again.numbers, again.up, again.input, again.fresh) == (config.numbers, config.up, ("FRAMES",), 0)
    assert parse(["--quick", "--evaluate", "--fresh", "9"]).command().split()[3:] == [
        "--evaluate",
        "--tables",
        "5",
        "--fresh",
        "5",
        "--quick",
    ]
