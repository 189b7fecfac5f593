"""The program from recording to folder: a box on a table whose distances are known, and everything that can go wrong."""

import json
import signal
import sys
import types
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.map import run as program
from experiments.map.__main__ import main
from experiments.map.choices import beyond_neighbours, choose_layout, choose_params, levels_for
from experiments.map.config import MapConfig
from experiments.map.frame_check import farthest_coordinate
from experiments.map.mapper import Mapper
from experiments.map.notices import EACH, MOST, Notices
from hrcjax.io.map_file import open_map
from hrcjax.io.recordings.frame import InputFrame, Intrinsics
from hrcjax.io.recordings.open_input import open_input
from hrcjax.io.recordings.source import InputSource
from hrcjax.lab.errors import UsageError
from hrcjax.map import DYNAMIC, MapLayout, MapParams, StreamParams, labelled_points, map_distance
from hrcjax.sense import d435i
from hrcjax.sense.camera import render_scene
from hrcjax.world.scene import BOX
from hrcjax.world.scenes import Obstacle, make_scene

BOX_AT, HALF = (0.05, 0.1, 0.1), (0.12, 0.1, 0.1)
TOP = 0.2
SMALL = ("--lower", "-0.8", "-0.8", "-0.2", "--shape", "8", "8", "4", "--spacing", "0.05")


@pytest.fixture(scope="module")
def images():
    """Camera, the image of the table with the box, and without it."""
    camera = d435i(jnp.asarray([0.0, -0.6, 0.9], jnp.float32), jnp.asarray([0.0, 0.05, 0.0], jnp.float32), 5)
    room = ((0.0,) * 3, (0.1,) * 3, (0.0,) * 3, (1.0,) * 3)
    scenes = [make_scene(boxes, *room) for boxes in ([Obstacle(BOX, BOX_AT, HALF, 0.0, 0.1)], [])]
    return camera, *(np.asarray(render_scene(camera, scene)) for scene in scenes)


@pytest.fixture
def record(images, tmp_path):
    """(images by letter: b box, t table alone, n nothing) -> an NPZ file of that recording."""
    camera, box, table = images
    known = {"b": box, "t": table, "n": np.zeros_like(table)}

    def write(letters: str, name: str = "cell", stamp=None):
        path = tmp_path / f"{name}.npz"
        np.savez(
            path,
            depth=np.stack([known[letter] for letter in letters]),
            intrinsics=np.array([float(v) for v in (camera.fx, camera.fy, camera.cx, camera.cy)]),
            rotation=np.asarray(camera.rotation, float),
            position=np.asarray(camera.position, float),
            stamp=np.arange(len(letters)) / 30 + 1.7e9 if stamp is None else np.asarray(stamp, float),
        )
        return path

    return write


@pytest.fixture
def run(tmp_path, capsys):
    """(options) -> exit status, stdout, stderr; into the folder out."""

    def call(*options, folder: str = "out", layout=SMALL):
        words = [str(word) for word in ("--output", tmp_path / folder, *layout, "--no-figures", *options)]
        capsys.readouterr()
        status = main(words)
        printed = capsys.readouterr()
        return status, printed.out, printed.err

    return call


def box_of(points: np.ndarray) -> np.ndarray:
    """Which points lie on the box, off the table."""
    near = (np.abs(points - np.asarray(BOX_AT)) < np.asarray(HALF) + 0.03).all(axis=1)
    return near & (points[:, 2] > 0.06)


def test_a_box_on_a_table(record, run, tmp_path) -> None:
    status, out, err = run("--input", record("bbbb"))
    assert status == 0 and "4 of 4 frames used" in out and "frames" in err
    layout, params, state = open_map(tmp_path / "out" / "map.npz")
    assert layout.lower == (-0.8, -0.8, -0.2) and layout.shape == (8, 8, 4) and layout.spacing == 0.05
    points, _ = labelled_points(state)
    top = points[box_of(points) & (np.abs(points[:, :2] - BOX_AT[:2]) < 0.08).all(axis=1)]
    assert len(points) > 150 and len(top) > 5 and np.abs(top[:, 2] - TOP).max() < 0.01
    assert np.abs(points[np.abs(points[:, 0]) > 0.3][:, 2]).max() < 0.01
    read = jax.jit(jax.value_and_grad(lambda x: map_distance(layout, state.levels, params.ratio, x)))
    for place, distance in (((0.05, 0.1, 0.3), 0.1), ((-0.4, 0.0, 0.1), 0.1)):
        d, g = read(jnp.asarray(place, jnp.float32))
        assert float(d) == pytest.approx(distance, abs=0.02) and float(g[2]) == pytest.approx(1.0, abs=0.05)
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["cloud.ply", "map.npz", "statistics.json"]


def test_points_file_opens_again_and_has_colours(record, run, tmp_path) -> None:
    run("--input", record("bbbt"), "--param", "patience=2")
    _, _, state = open_map(tmp_path / "out" / "map.npz")
    points, labels = labelled_points(state)
    (frame,) = list(open_input(tmp_path / "out" / "cloud.ply"))
    np.testing.assert_allclose(frame.cloud, points, atol=1e-6)
    import trimesh

    cloud = trimesh.load(tmp_path / "out" / "cloud.ply")
    of_box = np.asarray(cloud.colors)[box_of(points) & (labels == DYNAMIC)]
    assert len(of_box) > 10 and (of_box[:, 0] > of_box[:, 2]).all()  # vermilion


def test_what_went_is_dynamic_and_then_gone_and_the_table_stays(record, run, tmp_path) -> None:
    run("--input", record("bbbt"), "--param", "patience=2")
    points, labels = labelled_points(open_map(tmp_path / "out" / "map.npz")[2])
    assert (labels == DYNAMIC).sum() > 10 and box_of(points)[labels == DYNAMIC].mean() > 0.9
    table = (np.abs(points[:, 2]) < 0.02) & ~box_of(points)
    status, _, _ = run("--input", record("bbbtttt"), folder="later")
    assert status == 0
    after, labels = labelled_points(open_map(tmp_path / "later" / "map.npz")[2])
    assert box_of(after).sum() <= 0.1 * box_of(points).sum() and (labels == DYNAMIC).sum() <= 2
    assert (np.abs(after[:, 2]) < 0.02).sum() >= table.sum()


def test_statistics_on_stdout_are_those_in_the_folder(record, run, tmp_path) -> None:
    status, out, err = run("--input", record("bbnt"), "--json", "--param", "patience=2")
    found = json.loads(out)
    assert status == 0 and found == json.loads((tmp_path / "out" / "statistics.json").read_text())
    assert "3 of 4 frames used" in err
    frames, totals = found["frames"], found["totals"]
    assert frames["stamp"] == pytest.approx([0, 1 / 30, 2 / 30, 3 / 30], abs=1e-6)
    assert frames["refused"] == ["", "", "too few pixels with depth", ""]
    assert totals["used"] == 3 and totals["refused"] == {"too few pixels with depth": 1}
    points, labels = labelled_points(open_map(tmp_path / "out" / "map.npz")[2])
    assert totals["points"] == len(points) and totals["points_dynamic"] == (labels == DYNAMIC).sum() > 0
    assert totals["dynamic"] == sum(frames["dynamic"]) > 0 == totals["lost"]
    assert len(frames["ms"]) == 4 and totals["ms_median"] <= totals["ms_p95"] < 1e3 * totals["compile_s"] + 1e4


def test_going_on_is_the_same_as_going_through(record, run, tmp_path) -> None:
    path = record("bbbbt")
    run("--input", path, folder="whole")
    run("--input", path, "--frames", 2, folder="first")
    on = ("--input", path, "--start", 2, "--continue-from", tmp_path / "first" / "map.npz")
    status, out, _ = run(*on, folder="second", layout=())
    assert status == 0 and "3 of 3 frames" in out
    whole, second = (open_map(tmp_path / name / "map.npz") for name in ("whole", "second"))
    assert whole[0] == second[0]
    for a, b in zip(labelled_points(whole[2]), labelled_points(second[2]), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6)
    assert run(*on, "--capacity", 100, folder="third", layout=())[0] == 2
    assert run(*on, "--param", "ratio=0.9", folder="third", layout=())[0] == 2
    assert run(*on, "--param", "ratio=0.7", "far=3", folder="third", layout=())[0] == 0


def test_a_folder_is_not_overwritten_unasked_and_foreign_files_stay(record, run, tmp_path) -> None:
    path = record("bb")
    assert run("--input", path)[0] == 0
    out = tmp_path / "out"
    (out / "notes.txt").write_text("mine")
    (out / "bound.png").write_text("of an earlier run")
    before = (out / "map.npz").read_bytes()
    status, _, err = run("--input", path, "--frames", 1)
    assert status == 2 and "holds a map" in err and err.count("\n") == 1 and (out / "map.npz").read_bytes() == before
    assert run("--input", path, "--frames", 1, "--overwrite")[0] == 0
    assert (out / "notes.txt").read_text() == "mine" and not (out / "bound.png").exists()
    assert json.loads((out / "statistics.json").read_text())["totals"]["frames"] == 1
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.txt").write_text("mine")
    status, _, err = run("--input", path, "--overwrite", folder="other")
    assert status == 2 and "thesis.txt" in err and [p.name for p in (tmp_path / "other").iterdir()] == ["thesis.txt"]


def test_stamps_of_a_clock_go_on_and_repeated_ones_are_named(record, run) -> None:
    """In single precision all stamps of this clock would be the same."""
    stamps = 1.7e9 + np.array([0.0, 0.03, 0.03, 0.06, 0.01, 0.09])
    _, out, err = run("--input", record("bbbbbb", stamp=stamps))
    assert "4 of 6 frames used" in out
    assert "frame 2 at 0.030 s: time stamp repeated" in err and "frame 4 at 0.010 s: time stamp before" in err


def test_many_refusals_make_few_lines() -> None:
    lines = []
    notices = Notices(lines.append)
    for k in range(50):
        notices.add_line(f"{k}.png: broken")
        notices.add(f"frame {k}", f"reason {k}")
    assert sum("broken" in line for line in lines) == EACH and len(lines) == MOST
    assert notices.reasons["broken"] == 50 and notices.text().startswith("50 x broken")


@pytest.fixture
def played(monkeypatch, images):
    """Replaces the recording by frames made here."""

    def play(read, length=None, kind="test"):
        source = InputSource("nowhere", kind, length, read)
        monkeypatch.setattr(program, "recording", lambda config: source)

    return play


def frame_of(images, k: int, camera: str = "") -> InputFrame:
    model, box, _ = images
    intrinsics = Intrinsics(*(float(v) for v in (model.fx, model.fy, model.cx, model.cy)), model.width, model.height)
    pose = np.asarray(model.rotation, float), np.asarray(model.position, float)
    return InputFrame(k / 30, camera, box.astype(np.float32), None, intrinsics, *pose)


def test_an_interrupt_writes_what_there_is(images, played, run, tmp_path) -> None:
    def read(skip):
        for k in range(100):
            if k == 3:
                signal.raise_signal(signal.SIGINT)
            yield frame_of(images, k)

    played(read)
    handler = signal.getsignal(signal.SIGINT)
    status, out, err = run("--input", tmp_path, "--every", 1)
    assert status == 130 and "4 of 4 frames used" in out and "--start 4" in err and "--continue-from" in err
    assert signal.getsignal(signal.SIGINT) is handler
    assert len(labelled_points(open_map(tmp_path / "out" / "map.npz")[2])[0]) > 100


def test_frames_before_a_broken_one_are_kept(images, played, run, tmp_path) -> None:
    def read(skip):
        skip("0.png at 0 s: no pose")
        yield frame_of(images, 0)
        yield frame_of(images, 1)
        raise UsageError("2.png cannot be read: accepted is a whole one")

    played(read, 5)
    status, out, err = run("--input", tmp_path)
    assert status == 2 and "2 of 2 frames used" in out and "after 2 frames, whose results are written: 2.png" in err
    assert "no pose" in err and "1 x no pose" in out
    assert (tmp_path / "out" / "map.npz").is_file()


def test_nothing_taken_writes_nothing(record, run, tmp_path) -> None:
    status, _, err = run("--input", record("bb"), "--start", 7)
    assert status == 2 and "no frame was used" in err and not (tmp_path / "out").exists()


def test_each_camera_has_a_stream_of_its_own(images) -> None:
    layout = MapLayout((-0.8, -0.8, -0.2), (8, 8, 4), 0.05, 256, 2, 256, 256, 256)
    mapper = Mapper(layout, MapParams(), StreamParams())
    two = [mapper.take(frame_of(images, 0, name)) for name in ("left", "right")]
    assert [taken.refused for taken in two] == ["", ""]
    assert mapper.take(frame_of(images, 0, "left")).refused == "time stamp repeated"
    assert mapper.take(frame_of(images, 1, "right")).refused == ""
    assert len(mapper.programs.compiled) == 1


def test_the_box_is_fitted_wherever_the_recording_is(images, played, run, tmp_path) -> None:
    away = np.array([120.0, -35.0, 7.0])

    def read(skip):
        for k in range(3):
            frame = frame_of(images, k)
            yield replace(frame, position=frame.position + away)

    played(read, 3)
    status, out, err = run("--input", tmp_path, "--fit", "--spacing", 0.05, "--param", "far=4", layout=())
    assert status == 0 and "fitted" in err and "note" not in out
    layout, _, state = open_map(tmp_path / "out" / "map.npz")
    points, _ = labelled_points(state)
    upper = np.asarray(layout.lower) + 4 * layout.spacing * np.asarray(layout.shape)
    assert (points > layout.lower).all() and (points < upper).all() and len(points) > 150
    assert np.median(points[:, 2]) == pytest.approx(7.0, abs=0.02) and max(layout.shape) < 40


def test_hints_name_the_option_that_helps(record, run) -> None:
    path = record("bb")
    box = ("--lower", "-0.2", "-0.2", "-0.2", "--shape", "2", "2", "2", "--spacing", "0.05")
    _, out, _ = run("--input", path, layout=box)
    assert "outside of the mapped box" in out and "--fit" in out
    _, out, _ = run("--input", path, "--capacity", 4, folder="few")
    assert "raise --capacity (now 4)" in out
    _, out, _ = run("--input", path, "--param", "far=0.9", folder="near")
    assert "outside of the depth range 0.28 to 0.9 m" in out and "--param near" in out


def ply(path, points) -> None:
    header = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    path.write_text(header + "\n".join(" ".join(f"{v:.5f}" for v in p) for p in points) + "\n")


def board(x: float, half: float, step: float = 0.02) -> np.ndarray:
    """A square across x."""
    a = np.arange(-half, half + step / 2, step)
    y, z = np.meshgrid(a, a)
    return np.stack([np.full(y.size, x), y.ravel(), z.ravel()], axis=1)


CLOUD_BOX = ("--lower", "-1.6", "-0.8", "-0.8", "--shape", "14", "8", "8", "--spacing", "0.05")


@pytest.fixture
def clouds(tmp_path):
    """A near and a far board, on both sides of the origin and behind each other; then the far ones alone, twice."""
    folder = tmp_path / "plys"
    folder.mkdir()
    near, far = board(0.5, 0.1), np.concatenate([board(1.0, 0.6), board(-1.5, 0.6)])
    ply(folder / "0.ply", np.concatenate([near, far]))
    for k in (1, 2, 3):
        ply(folder / f"{k}.ply", far)
    return folder


def boards(folder) -> list[int]:
    points, _ = labelled_points(open_map(folder / "map.npz")[2])
    return [int((np.abs(points[:, 0] - x) < 0.05).sum()) for x in (0.5, 1.0, -1.5)]


def test_clouds_of_an_unknown_sensor_count_all_around_and_make_nothing_free(clouds, run, tmp_path) -> None:
    status, out, err = run("--input", clouds, layout=CLOUD_BOX)
    assert status == 0 and "--origin" in err and "0 in free space, 0 removed" in out and "note" not in out
    found = boards(tmp_path / "out")
    assert found[0] >= 16 and found[1] == found[2] >= 500


def test_clouds_of_a_known_sensor_make_free_what_their_rays_pass(clouds, run, tmp_path) -> None:
    status, out, err = run("--input", clouds, "--origin", 0, 0, 0, layout=CLOUD_BOX)
    assert status == 0 and "--origin" not in err and "note" not in out
    found = boards(tmp_path / "out")
    assert found[0] == 0 and found[1] == found[2] >= 500
    run("--input", clouds, "--origin", 0, 0, 0, "--see-through", "never", folder="kept", layout=CLOUD_BOX)
    kept = boards(tmp_path / "kept")
    assert kept[0] >= 16 and kept[1:] == found[1:]


def test_figures_are_drawn(record, run, tmp_path) -> None:
    status, out, _ = run("--input", record("bbt"), "--figures", "--bound", "--slice-at", 0, 0.1, 0.1)
    assert status == 0 and "slices.png" in out
    for name in ("slices.png", "bound.png", "cloud.png"):
        assert (tmp_path / "out" / name).read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "no recording"),
        (("--input", "absent"), "nothing at absent"),
        (("--input", ".", "--fit", "--lower", "0", "0", "0"), "either --fit or --lower"),
        (("--input", ".", "--every", "0"), "--every 0"),
        (("--input", ".", "--param", "speed=1"), "no parameter 'speed'"),
        (("--input", ".", "--param", "far=x"), "NAME=NUMBER"),
        (("--input", ".", "--param", "far=-1"), "not negative"),
        (("--input", ".", "--spacing", "0"), "--spacing 0"),
        (("--input", ".", "--spacing", "nan"), "--spacing nan"),
        (("--input", ".", "--spacing", "2"), "from 0.001 to 1"),
        (("--input", ".", "--param", "patience=0"), "from 1 to 127"),
        (("--input", ".", "--param", "patience=200"), "from 1 to 127"),
        (("--input", ".", "--lower", "500000", "5000000", "0"), "subtract an offset"),
        (("--input", ".", "--slice-at", "1e5", "0", "0"), "--slice-at 100000 0 0: accepted is a point near"),
        (("--input", ".", "--shape", "4000", "4000", "4000"), "raise --spacing"),
        (("--input", ".", "--shape", "0", "1", "1"), "at least 1"),
        (("--input", ".", "--continue-from", "a", "--fit"), "not accepted with --continue-from"),
        (("--input", ".", "--evaluate"), "without --input"),
        (("--inptu", "."), "--input"),
    ],
)
def test_wrong_options_are_told_in_one_line(options, said, tmp_path, monkeypatch, capsys, played) -> None:
    monkeypatch.chdir(tmp_path)
    if "absent" not in options:
        played(lambda skip: iter(()))
    assert main(list(options)) == 2
    err = capsys.readouterr().err
    assert said in err and err.count("\n") <= 2 and "Traceback" not in err and not any(tmp_path.iterdir())


def test_places_that_single_precision_does_not_tell_apart_are_refused(images, tmp_path, run, played) -> None:
    wall = np.stack(np.meshgrid(np.linspace(-1, 1, 20), np.linspace(-1, 1, 20), [1.5]), axis=-1).reshape(-1, 3)
    utm = np.array([5e5, 5e6, 0.0])
    np.savez(tmp_path / "points.npz", points=wall + utm)
    np.savez(tmp_path / "pose.npz", points=wall, position=utm)
    for name in ("points", "pose"):
        for layout in (SMALL, ("--fit",)):
            status, _, err = run("--input", tmp_path / f"{name}.npz", layout=layout)
            assert status == 2 and "5000000 m" in err.replace("5000001", "5000000") and "subtract an offset" in err
            assert err.count("\n") == 2 and not (tmp_path / "out").exists()
    played(lambda skip: (replace(frame_of(images, k), position=utm) for k in range(2)), 2)
    status, _, err = run("--input", tmp_path)
    assert status == 2 and "its sensor" in err and err.count("\n") == 2
    for spacing in (0.025, 0.05):
        limit = np.float32(farthest_coordinate(spacing))
        assert np.spacing(np.nextafter(limit, np.float32(0))) <= spacing / 20 < np.spacing(limit)


@pytest.mark.parametrize("shape", [(3, 3), (3, 640), (640, 3)])
def test_images_smaller_than_a_tile_are_refused(shape, tmp_path, run) -> None:
    np.savez(tmp_path / "tiny.npz", depth=np.ones(shape, np.float32), intrinsics=np.array([300.0, 300.0, 1.0, 1.0]))
    status, _, err = run("--input", tmp_path / "tiny.npz")
    assert status == 2 and f"{shape[1]} x {shape[0]} pixels; accepted are 4 x 4" in err and err.count("\n") == 2


def test_distances_beyond_the_neighbouring_voxels_are_named() -> None:
    texts = ["clear_distance=0.2", "new_distance=0.1", "far=6"]
    params, _ = choose_params(texts, MapParams(), continued=False)
    assert beyond_neighbours(texts, params, 0.05).startswith("clear_distance=0.2: ")
    assert "clear_distance=0.2, new_distance=0.1" in beyond_neighbours(texts, params, 0.025)
    assert beyond_neighbours([], MapParams(), 0.01) == ""


def test_levels_follow_the_size_of_the_box() -> None:
    assert [levels_for(shape) for shape in ((2, 2, 2), (40, 40, 24), (120, 120, 40))] == [2, 3, 4]
    assert choose_layout(MapConfig(), clouds=False) == MapLayout()


def test_help_and_list(capsys) -> None:
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    for word in ("Examples", "--continue-from", "--fit", "--world-frame", "--evaluate"):
        assert word in out
    assert main(["--list"]) == 0
    out = capsys.readouterr().out
    assert "top_speed" in out and "patience" in out and "[" not in out


def test_the_evaluation_is_printed(monkeypatch, capsys) -> None:
    asked = []

    def run_evaluation(progress: bool):
        asked.append(progress)
        return {"error_p95": {"value": 0.004, "unit": "m", "bar": "< 0.01"}, "frames": {"value": 12, "unit": "1"}}

    report = types.ModuleType("experiments.map.evaluate.report")
    report.run_evaluation = run_evaluation  # pyright: ignore[reportAttributeAccessIssue]
    monkeypatch.setitem(sys.modules, "experiments.map.evaluate", types.ModuleType("experiments.map.evaluate"))
    monkeypatch.setitem(sys.modules, "experiments.map.evaluate.report", report)
    assert main(["--evaluate"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any("error_p95" in line and "0.004" in line and "target < 0.01" in line for line in lines)
    assert main(["--evaluate", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["error_p95"]["value"] == 0.004 and asked == [True, False]


def test_real_frames(shared_data, run, tmp_path) -> None:
    """Four overlapping frames of a room: the map lies on what the last one sees, and most of it is not taken for gone."""
    recording = shared_data / "rgbd"
    options = ("--input", recording, "--rate", 1, "--start", 1, "--fit", "--spacing", 0.1, "--param", "far=6")
    status, out, _ = run(*options, layout=())
    assert status == 0 and "4 of 4 frames used" in out
    points, _ = labelled_points(open_map(tmp_path / "out" / "map.npz")[2])
    found = json.loads((tmp_path / "out" / "statistics.json").read_text())["totals"]
    assert len(points) > 2000 and found["removed"] < 0.1 * len(points) and found["lost"] == 0
    last = list(open_input(recording))[-1]
    v, u = np.mgrid[0:480:8, 0:640:8]
    z, i = last.depth[::8, ::8], last.intrinsics
    local = np.stack([(u - i.cx) / i.fx * z, (v - i.cy) / i.fy * z, z], -1)[(z > 0.3) & (z < 5)]
    world = local @ last.rotation.T + last.position
    from scipy.spatial import KDTree

    distance = KDTree(points).query(world)[0]
    assert np.median(distance) < 0.06 and np.quantile(distance, 0.9) < 0.12
