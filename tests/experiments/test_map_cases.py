"""Recordings as other people hand them over: what is wrong in them is noticed, named, and told by the exit status."""

import dataclasses
import json
import shutil
import signal

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from experiments.map.__main__ import main
from experiments.map.agreement import MOST, Agreement
from experiments.map.body_check import BodyCheck
from experiments.map.exclusions import Exclusions
from experiments.map.first_look import doubtful_scale
from experiments.map.fit_box import fit_depth
from experiments.map.summary_text import mostly_refused, nothing_taken
from hrcjax.io.map_file import open_map
from hrcjax.io.recordings.frame import InputFrame, Intrinsics
from hrcjax.io.recordings.joints import JointRecord, read_joints
from hrcjax.io.recordings.open_input import open_input
from hrcjax.map import labelled_points, map_distance
from hrcjax.robot import arm_capsules, load_arm

CAMERA = Intrinsics(130, 130, 79.5, 59.5, 160, 120)
GIVEN = ("--intrinsics", "130", "130", "79.5", "59.5", "160", "120")
BOX = ("--lower", "-0.2", "-1.4", "-0.4", "--shape", "10", "14", "8", "--spacing", "0.05", "--capacity", "512")


@pytest.fixture
def run(tmp_path, capsys):
    """(options) -> exit status, stdout, stderr; into the folder out."""

    def call(*options, layout=BOX):
        words = [str(word) for word in ("--output", tmp_path / "out", "--overwrite", *layout, "--no-figures", *options)]
        capsys.readouterr()
        status = main(words)
        printed = capsys.readouterr()
        return status, printed.out, printed.err

    return call


@pytest.fixture
def base(shared_cases, tmp_path):
    folder = tmp_path / "base"
    shutil.copytree(shared_cases / "small_recording" / "base", folder)
    for path in [folder, *folder.rglob("*")]:
        path.chmod(0o755)
    return folder


def read(folder, *places) -> list[float]:
    """Distances of a map [m]."""
    layout, params, state = open_map(folder / "map.npz")
    distance = jax.jit(lambda x: map_distance(layout, state.levels, params.ratio, x))
    return [float(distance(jnp.asarray(x, jnp.float32))) for x in places]


# --- cameras -------------------------------------------------------------------------------------------------------------


def test_a_camera_file_makes_the_distances_right(shared_cases, tmp_path, run) -> None:
    """Distances from the wall (0.2, above the box) and from the box's front and the floor (0.15)."""
    folder = tmp_path / "rs640"
    shutil.copytree(shared_cases / "depth_camera_assumed" / "rs640", folder)
    folder.chmod(0o755)
    places = ((1.0, 0.0, 0.5), (0.9, 0.4, 0.15))  # 0.141 and 0.014 by the camera that is assumed without a file
    (folder / "intrinsics.json").write_text(
        json.dumps({"fx": 383.0, "fy": 383.0, "ppx": 319.5, "ppy": 239.5, "width": 640, "height": 480})
    )
    status, _, err = run("--input", folder)
    assert status == 0 and "(intrinsics.json); 1000 per metre (ASSUMED: --per-metre)" in err
    assert read(tmp_path / "out", *places) == pytest.approx([0.2, 0.15], abs=0.01)


@pytest.mark.parametrize(
    ("metres", "said"), [(1e3, "is outside the range of depth cameras"), (1e-3, "outside the range of depth cameras")]
)
def test_a_scale_that_cannot_be_is_refused_before_work(tmp_path, run, metres, said) -> None:
    np.savez(tmp_path / "a.npz", depth=np.full((2, 120, 160), 1.5 * metres), intrinsics=[130.0, 130, 79.5, 59.5])
    status, _, err = run("--input", tmp_path / "a.npz")
    assert status == 2 and said in err and "--per-metre" in err and not (tmp_path / "out").exists()


def test_scales_of_clouds() -> None:
    def frame(cloud):
        return InputFrame(0.0, "", None, cloud.astype(np.float32), None, np.eye(3), np.zeros(3))

    points = np.random.default_rng(0).uniform(-2, 2, (500, 3))
    assert doubtful_scale(frame(points)) == doubtful_scale(frame(100 * points)) == ""
    assert "from their centre" in doubtful_scale(frame(1000 * points))


# --- poses ---------------------------------------------------------------------------------------------------------------


def inverted(rotation, position):
    return rotation.T, -rotation.T @ position


def scalar_first(rotation, position):
    """What reading qw qx qy qz as qx qy qz qw makes of a pose."""
    x, y, z, w = Rotation.from_matrix(rotation).as_quat()
    return Rotation.from_quat([w, x, y, z]).as_matrix(), position


READINGS = {
    "": lambda *pose: pose,
    "if they are inverted": inverted,
    "if they are scalar first (qw qx qy qz);": scalar_first,
    "scalar first (qw qx qy qz) and inverted": lambda *pose: scalar_first(*inverted(*pose)),
}


@pytest.mark.parametrize("said", READINGS)
@pytest.mark.parametrize("name", ["small", "real"])
def test_poses_of_another_convention_are_noticed(shared_cases, shared_data, name, said) -> None:
    if name == "real":
        frames = list(open_input(shared_data / "rgbd"))
    else:
        frames = list(open_input(shared_cases / "small_recording" / "base", intrinsics=CAMERA))
    agreement = Agreement()
    for frame in frames:
        rotation, position = READINGS[said](frame.rotation, frame.position)
        agreement.add(dataclasses.replace(frame, rotation=rotation, position=position))
    line = agreement.line()
    assert (said in line and "\n" not in line) if said else line == ""


def test_a_camera_that_stands_still_says_nothing_and_few_frames_are_kept(shared_cases) -> None:
    frames = list(open_input(shared_cases / "small_recording" / "base", intrinsics=CAMERA))
    still, long = Agreement(), Agreement()
    for k in range(300):
        still.add(frames[0])
        long.add(dataclasses.replace(frames[k % 6], position=frames[k % 6].position + np.array([0.02 * k, 0, 0])))
    assert still.line() == "" and len(still._kept[""]) == 1 and len(long._kept[""]) <= MOST


def test_inverted_poses_are_told_by_the_program(base, run, tmp_path) -> None:
    rows = np.loadtxt(base / "pose.txt")
    turned = Rotation.from_quat(rows[:, 3:]).inv()
    np.savetxt(base / "pose.txt", np.column_stack([-turned.apply(rows[:, :3]), turned.as_quat()]))
    status, out, _ = run("--input", base, *GIVEN)
    assert status == 0 and out.startswith("WARNING: poses: frames disagree") and "inverted" in out
    found = json.loads((tmp_path / "out" / "statistics.json").read_text())
    assert len(found["warnings"]) == 1 and "fx 130" in found["notes"][0]


# --- the robot -----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def arm():
    return load_arm("ur5")


@pytest.mark.parametrize("frame", ["base", "base_link"])
@pytest.mark.parametrize("alphabet", [False, True])
def test_a_robot_that_is_not_where_it_is_said_is_noticed(shared_cases, arm, frame, alphabet) -> None:
    folder = shared_cases / "joints_base_and_order"
    record = read_joints(folder / "q.npz", arm.q_max)
    q = record.q[:, [2, 1, 0, 3, 4, 5]] if alphabet else record.q
    check = BodyCheck(Exclusions(None, arm, JointRecord(record.path, record.stamps, q), "base"))
    for one in open_input(folder / f"{frame}.npz"):
        check.add(one)
    line = check.line()
    if frame == "base" and not alphabet:
        assert line == "" and check.share(next(iter(check.readings))) > 0.95
        return
    assert "the base frame (--arm-base), the order of the joints" in line
    meant = line.split(" with ")[1]
    assert ("--arm-base base_link" in meant) == (frame == "base_link") and ("alphabet" in meant) == alphabet
    true = BodyCheck(Exclusions(None, arm, record, frame))
    for one in open_input(folder / f"{frame}.npz"):
        true.add(one)
    assert tuple(check.found[check.best()]) == tuple(true.found[next(iter(true.readings))]) and true.line() == ""


def test_a_robot_in_clouds_is_looked_for_along_their_rays(shared_cases, arm) -> None:
    folder = shared_cases / "joints_base_and_order"
    checks = [
        BodyCheck(Exclusions(None, arm, read_joints(folder / "q.npz", arm.q_max), base))
        for base in ("base", "base_link")
    ]
    for frame in open_input(folder / "base.npz"):
        v, u = np.nonzero(frame.depth)
        z, i = frame.depth[v, u], frame.intrinsics
        cloud = np.stack([(u - i.cx) / i.fx * z, (v - i.cy) / i.fy * z, z], axis=1).astype(np.float32)
        for check in checks:
            check.add(InputFrame(frame.stamp, "", None, cloud, None, frame.rotation, frame.position))
    assert checks[0].line() == "" and "--arm-base base" in checks[1].line()


def test_base_link_takes_the_arm_out(shared_cases, run, tmp_path, arm) -> None:
    folder = shared_cases / "joints_base_and_order"
    options = ("--input", folder / "base_link.npz", "--joints", folder / "q.npz", "--param", "far=5")
    layout = ("--lower", -2, -2, -0.4, "--shape", 20, 20, 10, "--spacing", 0.05)
    half_turn = np.array([-1.0, -1.0, 1.0])
    status, out, _ = run(*options, "--arm-base", "base_link", layout=layout)
    assert status == 0 and "WARNING" not in out
    points = labelled_points(open_map(tmp_path / "out" / "map.npz")[2])[0]
    apart = []
    for q in np.load(folder / "q.npz")["q"]:
        body = arm_capsules(arm, jnp.asarray(q, jnp.float32))
        a, b = (np.asarray(end, float)[1:, None] * half_turn for end in (body.a, body.b))
        along = np.clip(((points - a) * (b - a)).sum(axis=2) / ((b - a) ** 2).sum(axis=2), 0, 1)
        apart.append(
            np.linalg.norm(points - a - along[..., None] * (b - a), axis=2) - np.asarray(body.radius)[1:, None]
        )
    assert len(points) > 500 and np.min(apart) > 0.03  # 30 and more points of the arm stay without the half turn


# --- what was taken ------------------------------------------------------------------------------------------------------


def test_a_run_that_takes_nothing_in_is_no_success(base, run, tmp_path) -> None:
    status, _, err = run("--input", base, *GIVEN, "--param", "least_share=2")
    assert status == 2 and "the map has no data" in err and "6 x too few pixels with depth" in err
    assert "--per-metre" in err and not (tmp_path / "out").exists()
    status, _, err = run("--input", base, *GIVEN, layout=("--lower", 5, 5, 5, *BOX[4:]))
    assert status == 2 and "outside of the mapped box: give --fit" in err and not (tmp_path / "out").exists()


def test_what_lies_beyond_the_limits_of_depth_names_the_unit() -> None:
    totals = {"used": 6, "frames": 6, "points": 0, "new": 0, "refused": {}, "beyond": 900, "outside": 0}
    found = {"totals": totals, "params": {"near": 0.28, "far": 3.0}}
    text = nothing_taken(found)
    assert "900 points outside of the depth range 0.28 to 3 m: give --per-metre" in text and "\n" not in text
    assert (
        nothing_taken(found | {"totals": totals | {"new": 1}})
        == nothing_taken(found | {"totals": totals | {"points": 1}})
        == ""
    )


def test_less_than_half_is_most() -> None:
    assert [mostly_refused({"totals": {"used": n, "frames": 5}}) for n in (0, 2, 3, 5)] == [True, True, False, False]


def test_most_frames_refused_is_told_first_and_by_the_status(shared_cases, tmp_path, run) -> None:
    with np.load(shared_cases / "wrong_unit_empty_map" / "mm_uint16.npz") as file:
        arrays = dict(file)
    arrays["stamp"] = np.array([0.0, 0.1, 8.0, 16.0, 24.0, 32.0])
    np.savez(tmp_path / "a.npz", **arrays)
    options = ("--input", tmp_path / "a.npz", "--per-metre", 1000, "--param", "longest_gap=5")
    status, out, _ = run(*options)
    assert status == 3 and out.startswith("WARNING: most frames were refused, 4 of 6") and "not in seconds" in out
    assert (tmp_path / "out" / "map.npz").is_file()


def test_frames_without_stamps_have_no_speeds(base, run) -> None:
    lines = [line.split() for line in (base / "pose.txt").read_text().splitlines()]
    for k, words in enumerate(lines):
        words[1] = str(float(words[1]) + (0.15 if k % 2 else 0.0))  # 4.5 m/s at 30 Hz
    (base / "pose.txt").write_text("\n".join(" ".join(words) for words in lines))
    status, out, err = run("--input", base, *GIVEN)
    assert status == 0 and "6 of 6 frames used" in out and "speeds are not checked" in err
    status, out, _ = run("--input", base, *GIVEN, "--rate", 30)
    assert "6 of 6" not in out and "pose leapt" in out
    status, _, err = run("--input", base, *GIVEN, "--param", "top_speed=1")
    assert status == 2 and "no stamps, so speeds need --rate" in err


@pytest.mark.parametrize(
    ("depths", "expected"),
    [
        (np.linspace(0.5, 2.0, 1000), (0.28, 3.0)),
        (np.linspace(0.5, 8.3, 1000), (0.28, 8.3)),
        (np.linspace(0.12, 2.0, 1000), (0.1, 3.0)),
        (np.linspace(1.0, 60.0, 1000), (0.28, 10.0)),
        (np.append(np.full(999, 1.0), 7.0), (0.28, 3.0)),
        (np.empty(0), (0.28, 3.0)),
    ],
)
def test_limits_of_depth_follow_what_is_measured(depths, expected) -> None:
    assert fit_depth(depths, 0.28, 3.0) == pytest.approx(expected, abs=0.051)


def test_fit_takes_in_what_the_real_frames_measure(shared_data, run, tmp_path) -> None:
    options = ("--input", shared_data / "rgbd", "--start", 1, "--fit", "--spacing", 0.1)
    status, out, err = run(*options, layout=())
    found = json.loads((tmp_path / "out" / "statistics.json").read_text())
    assert status == 0 and "4 of 4 frames used" in out and "depth from 0.28 to 8" in err
    assert found["totals"]["beyond"] < 0.02 * found["totals"]["measured"]
    status, _, err = run(*options, "--param", "far=2", layout=())
    assert "depth from 0.28 to 2 m" in err


# --- folders and signals -------------------------------------------------------------------------------------------------


def test_places_that_take_no_file_are_refused_before_work(base, capsys, tmp_path) -> None:
    places = [base / "pose.txt" / "out", base / "pose.txt"]
    places += [path for path in map(type(base), ("/proc/out", "/sys/out")) if path.parent.is_dir()]
    for place in places:
        assert main(["--input", str(base), *GIVEN, "--output", str(place)]) == 2
        err = capsys.readouterr().err
        assert "--output" in err and err.count("\n") == 1


@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_signals_end_early_and_write(base, run, tmp_path, monkeypatch, number, status) -> None:
    from experiments.map.mapper import Mapper

    take, before = Mapper.take, [signal.getsignal(n) for n in (signal.SIGTERM, signal.SIGINT)]

    def taken(self, frame, *rest):
        if frame.stamp > 0.05:
            signal.raise_signal(number)
        return take(self, frame, *rest)

    monkeypatch.setattr(Mapper, "take", taken)
    got, out, err = run("--input", base, *GIVEN)
    assert got == status and "3 of 3 frames used" in out and "--start 3" in err
    assert len(labelled_points(open_map(tmp_path / "out" / "map.npz")[2])[0]) > 100
    assert [signal.getsignal(n) for n in (signal.SIGTERM, signal.SIGINT)] == before
