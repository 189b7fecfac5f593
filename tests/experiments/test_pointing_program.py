"""The program of pointing: hands, people and trials by the exact shapes, what the cameras make of them, rows, and errors in one line."""

import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.ndimage import minimum_filter

from experiments.pointing.__main__ import main
from experiments.pointing.bench import CHUNK, in_chunks
from experiments.pointing.bound import bound_errors, line_information
from experiments.pointing.config import PointingConfig
from experiments.pointing.figures import draw
from experiments.pointing.hand import INDEX, PALM_SIZE, SHAPE, TIP, frame_of, hand_at
from experiments.pointing.page import options, page
from experiments.pointing.people import NEAREST, REACH, Stand, elbows, people, shoulders
from experiments.pointing.posture import BEND, bends, room_beside_oneself
from experiments.pointing.rows import BARS, Case, all_rows, definition, holds
from experiments.pointing.run import scenes_of
from experiments.pointing.trials import AGAIN, KINDS, SEEN, THICKNESS, WAYS, draw_trials, in_sight, unit
from experiments.pointing.watch import FINGER_WATCH, WATCHES, cropped, watch_trials, widened
from hrcjax.hand import BONES, LANDMARKS, PALM, PointingParams
from hrcjax.sense import d435i
from hrcjax.sense.camera import in_image, render_scene
from hrcjax.sense.rig import cell_rig, stack_cameras
from hrcjax.world import scene_named
from hrcjax.world.skeleton import FOREARM, UPPER_ARM, Pose, body_of

SIX = 6


@pytest.fixture(scope="module")
def scene():
    return scene_named("robotica", 0)


@pytest.fixture(scope="module")
def cameras(scene):
    return cell_rig(scene, hand=False, decimation=1).cameras


@pytest.fixture(scope="module")
def points(scene) -> np.ndarray:
    """Points of table and columns, for a map's."""
    x, y = np.meshgrid(np.arange(-1.1, 1.1, 0.025), np.arange(-0.5, 0.78, 0.025))
    found = [np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)]
    turn, height = np.meshgrid(np.linspace(0, 2 * np.pi, 12), np.linspace(0, 1, 10))
    for k in np.flatnonzero(np.asarray(scene.mask)):
        c, size = np.asarray(scene.center[k]), np.asarray(scene.size[k])
        ring = np.stack([size[0] * np.cos(turn), size[0] * np.sin(turn), size[2] * (2 * height - 1)], axis=-1)
        found.append(c + ring.reshape(-1, 3))
    return np.concatenate(found)


def test_a_hand_has_its_tip_where_it_is_told_and_a_straight_finger() -> None:
    random = np.random.default_rng(0)
    u, tip = unit(random.normal(size=(5, 3))), random.normal(size=(5, 3))
    size, side = random.uniform(0.9, 1.1, 5), np.array([1.0, -1.0, 1.0, -1.0, 1.0])
    R = frame_of(u, random.normal(size=5))
    np.testing.assert_allclose(R @ R.swapaxes(1, 2), np.broadcast_to(np.eye(3), (5, 3, 3)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(R), 1.0)
    hand = hand_at(tip, R, size, side)
    assert hand.landmarks.shape == (5, LANDMARKS, 3)
    np.testing.assert_allclose(hand.landmarks[:, TIP], tip, atol=1e-12)
    along = unit(np.diff(hand.landmarks[:, INDEX], axis=1))
    np.testing.assert_allclose(along, np.broadcast_to(u[:, None], along.shape), atol=1e-9)
    lengths = np.linalg.norm(hand.b - hand.a, axis=2)
    np.testing.assert_allclose(lengths / size[:, None], np.broadcast_to(lengths[0] / size[0], lengths.shape))
    right, left = (hand_at(tip, R, np.ones(5), s * np.ones(5)).landmarks for s in (1.0, -1.0))
    np.testing.assert_allclose(right[:, PALM, :] @ R[..., 2:], left[:, PALM, :] @ R[..., 2:], atol=1e-12)
    assert 0.08 < PALM_SIZE < 0.11 and SHAPE.shape == (LANDMARKS, 3)


def test_shoulders_are_those_of_the_body_and_arms_keep_their_lengths() -> None:
    stand = Stand(np.array([[0.3, 1.0], [-0.2, 1.3]]), np.array([0.4, 0.1]), np.array([1.0, -1.0]))
    rest = jnp.asarray([0.15, 0.06, -0.57], jnp.float32)
    for k, own in enumerate(shoulders(stand)):
        pose = Pose(
            jnp.asarray(stand.hip[k], jnp.float32),
            jnp.asarray([0.0, -1.0], jnp.float32),
            float(stand.lean[k]),
            (rest, rest),
            0.0,
        )
        np.testing.assert_allclose(body_of(pose).shoulder[int(stand.side[k] > 0)], own, atol=1e-6)
    shoulder = shoulders(stand)
    wrist = shoulder + np.array([[0.0, -NEAREST, 0.0], [0.1, -REACH + 0.05, -0.1]])
    elbow = elbows(shoulder, wrist, stand.side)
    np.testing.assert_allclose(np.linalg.norm(elbow - shoulder, axis=1), UPPER_ARM, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(elbow - wrist, axis=1), FOREARM, atol=1e-9)


@pytest.mark.parametrize("kind", list(KINDS))
def test_trials_are_what_they_say(kind: str, scene, cameras, points) -> None:
    """By closed forms of the table and the columns."""
    trials = draw_trials(kind, scene, cameras, points, SIX, 0)
    again = draw_trials(kind, scene, cameras, points, SIX, 0)
    np.testing.assert_array_equal(trials.line, again.line)
    tip, u = trials.line[:, -1], trials.direction
    np.testing.assert_allclose(np.linalg.norm(u, axis=1), 1.0)
    along = unit(trials.line[:, -1] - trials.line[:, 0])
    np.testing.assert_allclose(along, u, atol=1e-6)
    assert all(rooms(trials) > 0), "no hand is within its own body"
    a, radius = np.asarray(trials.capsules.a, float), np.asarray(trials.capsules.radius)
    right = (radius[:, 9] < 0).astype(int)  # the hand that points has no ball
    assert bends(a[np.arange(SIX), 6 + right], trials.hand).max() <= BEND
    if kind == "away":
        assert np.isnan(trials.place).all() and (u[:, 2] > 0).all()
        return
    center, size = np.asarray(scene.center, float), np.asarray(scene.size, float)
    for x in trials.place:
        off = [np.hypot(*(x - c)[:2]) - s[0] for c, s in zip(center[:4], size[:4], strict=True)]
        top = [abs(x[2] - 2 * c[2]) if o < 1e-3 else 1.0 for c, o in zip(center[:4], off, strict=True)]
        assert min(abs(x[2]), *np.abs(off), *top) < 1e-3, "on a surface"
        assert np.linalg.norm(points - x, axis=1).min() < SEEN
    if kind == "tip":
        assert np.linalg.norm(trials.place - tip, axis=1).max() < 0.013
        return
    np.testing.assert_allclose(trials.place, tip + trials.way[:, None] * u, atol=1e-3)
    assert (trials.way >= WAYS[0]).all() and (trials.way <= WAYS[-1]).all()
    assert np.histogram(trials.way, WAYS)[0].tolist() == [2, 2, 2] or kind == "through"
    assert (np.linalg.norm(trials.velocity, axis=1) > 0).all() == (kind == "through")


def rooms(trials) -> np.ndarray:
    """Least distance of fingers' landmarks from all capsules of the body but the arm's own, in NumPy [m]."""
    a, b, r = (np.asarray(x, float)[:, :14] for x in (trials.capsules.a, trials.capsules.b, trials.capsules.radius))
    found = []
    for k, hand in enumerate(trials.hand):
        right = int(r[k, 9] < 0)
        others = [j for j in range(14) if r[k, j] >= 0 and j not in (4 + right, 6 + right)]
        way = b[k, others] - a[k, others]
        s = np.clip(np.sum((hand[:, None] - a[k, others]) * way, axis=2) / np.sum(way**2, axis=1), 0, 1)
        apart = np.linalg.norm(hand[:, None] - a[k, others] - s[..., None] * way, axis=2)
        found.append((apart - r[k, others]).min())
    return np.array(found)


def test_fingers_of_other_thickness_are_those_of_the_same_trials(scene, cameras, points) -> None:
    first, count = draw_trials("finger", scene, cameras, points, SIX, 0), len(BONES)
    for kind in AGAIN:
        same = draw_trials(kind, scene, cameras, points, SIX, 0)
        np.testing.assert_array_equal(same.line, first.line)
        ratio = np.asarray(same.capsules.radius / first.capsules.radius)
        np.testing.assert_allclose(ratio[:, -count:], {"thick": 1.2, "thin": 0.8}.get(kind, 1.0), rtol=1e-5)
        np.testing.assert_array_equal(ratio[:, :-count], 1.0)
    assert set(THICKNESS) < set(AGAIN) and WATCHES["noisy"] == WATCHES["finger"]._replace(noise=1.5)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_room_beside_oneself_is_that_of_the_closed_form(side: float) -> None:
    """A fingertip in the upright chest, at some depth; then an arm stretched out, of which only what a joint connects is met."""
    stand = Stand(np.array([[0.0, 0.0]]), np.zeros(1), np.array([side]))
    shoulder, size = shoulders(stand), np.ones(1)
    level = unit(np.array([2.0 * side, 0.5, 0.0]))
    u = frame_of(unit(level + np.array([0.0, 0.0, -0.25]))[None], np.zeros(1))
    for room in (-0.01, -0.02, -0.03):
        tip = np.array([[0.0, 0.0, shoulder[0, 2] - 0.35]]) - (0.15 + 0.008 + room) * level
        hand = hand_at(tip, u, size, stand.side)
        elbow = elbows(shoulder, hand.landmarks[:, 0], stand.side)
        found = room_beside_oneself(people(stand, shoulder, elbow, hand, size), stand.side)
        np.testing.assert_allclose(found, room, atol=1e-4)
    reach = shoulder + np.array([[0.05 * side, -0.5, -0.05]])
    hand = hand_at(
        reach + np.array([[0.0, -0.178, 0.0]]), frame_of(np.array([[0.0, -1.0, 0.0]]), np.zeros(1)), size, stand.side
    )
    elbow = elbows(shoulder, hand.landmarks[:, 0], stand.side)
    free = room_beside_oneself(people(stand, shoulder, elbow, hand, size), stand.side)
    assert free[0] > 0.02, "an arm that is stretched out meets nothing"
    turned = hand_at(
        hand.landmarks[:, 0] + np.array([[0.0, 0.178, 0.0]]),
        frame_of(np.array([[0.0, 1.0, 0.0]]), np.zeros(1)),
        size,
        stand.side,
    )
    assert bends(elbow, turned.landmarks)[0] > BEND > bends(elbow, hand.landmarks)[0]
    assert room_beside_oneself(people(stand, shoulder, elbow, turned, size), stand.side)[0] < 0, (
        "a finger in one's own forearm"
    )


def test_a_camera_sees_the_side_that_faces_it(scene, cameras) -> None:
    """Of the first column, whose cameras stand at smaller y."""
    x, y, half = (float(v) for v in (scene.center[0, 0], scene.center[0, 1], scene.center[0, 2]))
    place = np.array([(x, y - 0.03, half), (x, y + 0.03, half), (x, y, 2 * half), (x, y, 0.0)])
    normal = np.array([(0.0, -1, 0), (0, 1, 0), (0, 0, 1), (0, 0, 1)])
    assert in_sight(scene, cameras, place, normal).tolist() == [True, False, True, False]


def test_a_cropped_camera_sees_the_same(scene) -> None:
    camera = d435i(jnp.asarray([1.2, -0.2, 1.5], jnp.float32), jnp.asarray([0.3, 0.4, 0.2], jnp.float32), 4)
    whole = render_scene(camera, scene)
    both = stack_cameras([camera, camera])
    crop = cropped(both, jnp.asarray([[30.0, 20.0], [60.0, 50.0]], jnp.float32), (24, 16))
    one = jax.tree.map(lambda a: a[1], crop)
    np.testing.assert_allclose(render_scene(one, scene), whole[50:66, 60:84], rtol=1e-5)
    x = jnp.asarray([[0.3, 0.4, 0.2], [0.1, 0.5, 0.0]], jnp.float32)
    (whole, _), (part, _) = (jax.vmap(in_image, in_axes=(0, None))(c, x) for c in (both, crop))
    moved = whole - part
    np.testing.assert_allclose(moved, np.broadcast_to([[[30, 20]], [[60, 50]]], (2, 2, 2)), atol=1e-3)
    np.testing.assert_allclose(whole[0, 0], [79.75, 59.25], atol=0.3)


def test_what_is_near_is_wider_by_a_pixel() -> None:
    depth = np.random.default_rng(0).uniform(1, 3, (20, 30)).astype(np.float32)
    np.testing.assert_array_equal(widened(jnp.asarray(depth), 1), minimum_filter(depth, 3, mode="constant", cval=9.0))
    np.testing.assert_array_equal(widened(jnp.asarray(depth), 0), depth)


def test_seeds_begin_where_they_are_told_to() -> None:
    told = PointingConfig(first=20, seeds=2)
    assert scenes_of(told) == [("robotica", 20), ("clutter", 20), ("clutter", 21)]
    assert options(told) == " --seeds 2 --first 20"


@pytest.mark.parametrize("count", [1, CHUNK, 2 * CHUNK + 5])
def test_chunks_are_of_one_size_and_give_every_row_once(count: int) -> None:
    sizes = []

    def some(rows):
        sizes.append(len(rows))
        return {"square": jnp.asarray(rows**2), "same": rows}

    found = in_chunks(some, count)
    np.testing.assert_array_equal(found["square"], np.arange(count) ** 2)
    np.testing.assert_array_equal(found["same"], np.arange(count))
    assert set(sizes) == {CHUNK}


def made_cases(offset: float, told: float, count: int = 60, slow_chosen: bool = False) -> dict[str, Case]:
    """Trials that all err by an offset to one side, of which a deviation is told."""
    random = np.random.default_rng(0)
    cases: dict[str, Case] = {}
    for kind in KINDS:
        place = random.uniform([-0.5, 0.0, 0.0], [0.5, 0.7, 0.0], (count, 3))
        way = np.linspace(0.3, 1.2, count)
        u = np.broadcast_to([0.0, 0.0, -1.0], place.shape)
        aside = np.array([offset, 0.0, 0.0])
        found = place + aside
        covariance = np.broadcast_to(np.diag([told**2, 1e-8, 0.0]), (count, 3, 3))
        tip = place - way[:, None] * u
        quick = np.arange(count) % 2 == 0
        cases[kind] = {
            "place": place, "way": way, "direction": u, "line": np.repeat(tip[:, None], 2 if kind == "arm" else 4, axis=1), "hand": np.repeat(tip[:, None], LANDMARKS, 1),
            "velocity": np.where(quick, 0.3, 0.15)[:, None] * [1.0, 0.0, 0.0], "chosen": ~quick & slow_chosen if kind == "through" else quick | True,
            "time": np.full(count, 0.6), "tip_found": tip + aside, "direction_found": u,
            "line_covariance": np.zeros((count, 6, 6)), "direction_marks": u, "wrist": tip - 0.2 * u, "shoulder": tip - 0.7 * u,
            "bound_marks": np.full((count, 5), 0.03), "bound_depths": np.full((count, 5), 0.02), "solid": np.zeros(count, int), "solid_found": (np.arange(count) % 4 == 0).astype(int),
            "verdict": np.where(quick, 0, 2), "verdict_true": np.zeros(count, int), "touched": quick,
        }  # fmt: skip
        for of in ("map", "exact", "true", "marks", "world"):
            cases[kind] |= {
                f"{of}_place": found,
                f"{of}_found": np.full(count, kind != "away"),
                f"{of}_covariance": covariance,
            }
        cases[kind] |= {
            "scene_table_lower": np.array([-1.1, -0.5]), "scene_table_upper": np.array([1.1, 0.78]),
            "scene_mask": np.array([True, True]), "scene_center": np.array([[0.3, 0.4, 0.1], [0.0, 0.5, 0.1]]),
            "scene_size": np.full((2, 3), 0.05), "scene_yaw": np.array([0.0, 0.4]), "scene_kind": np.array([1, 2]),
        }  # fmt: skip
    return cases


def test_rows_of_known_errors() -> None:
    rows = {name: entry["value"] for name, entry in all_rows(made_cases(0.012, 0.011)).items()}
    for name in ("tip_p50", "tip_landmark_p50", "ray_p50_1m", "ray_across_p50_1m", "ray_world_p50_1m", "arm_p95_1m"):
        assert rows[name] == pytest.approx(1.2), name
    assert rows["ray_angle_p50"] == 0 and rows["told_p50_1m"] == pytest.approx(1.1)
    assert rows["coverage"] == 1 and rows["found_share"] == 1 and rows["away_found"] == 0
    assert rows["through_choice"] == 0 and rows["through_choice_slow"] == 0
    assert rows["bound_marks_p50_1m"] == pytest.approx(3.0) and rows["bound_depths_p50_1m"] == pytest.approx(2.0)
    assert rows["ray_marks_angle_p50"] == 0 and rows["arm_finger_angle_p50"] == pytest.approx(0, abs=1e-5)
    assert rows["ray_other_share"] == pytest.approx(0.25)
    assert rows["refused_share"] == rows["refused_unsure"] == pytest.approx(0.5) and rows["refused_no_room"] == 0
    assert rows["verdict_right"] == 1 and rows["refused_true"] == 0
    assert all(holds(name, rows[name]) for name in BARS)
    bad = {name: entry["value"] for name, entry in all_rows(made_cases(0.07, 0.011, slow_chosen=True)).items()}
    assert bad["through_choice_slow"] == 1
    assert bad["coverage"] == 0
    assert [name for name in BARS if not holds(name, bad[name])] == [
        "tip_p50",
        "ray_p50_1m",
        "through_choice_slow",
        "coverage",
    ]
    assert all(definition(name) for name in rows)


def test_page_and_figures(tmp_path) -> None:
    cases = made_cases(0.02, 0.011)
    names = draw(tmp_path, cases, cases)
    assert all((tmp_path / name).stat().st_size > 10_000 for name in names) and len(names) == 2
    text = page(
        all_rows(cases),
        cases,
        PointingConfig(seeds=3),
        ["robotica 0", "clutter 0"],
        [f"figures/pointing-{name}" for name in names],
    )
    assert "| tip_p50 | 2 | cm | < 1.5 (missed) |" in text and "![figures/pointing-above.png]" in text
    assert all(f"| `{kind}` |" in text for kind in KINDS)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["--kinds", "toe"],
            "--kinds toe: accepted are tip, finger, fresh, arm, away, through, wide, thick, thin, noisy",
        ),
        (["--scenes", "moon"], "--scenes moon: accepted are robotica"),
        (["--pixel", "-1"], "--pixel -1: accepted are 0 to 50"),
        (["--shared", "2"], "--shared 2: accepted are 0 to 1"),
        (["--trials", "0"], "--trials 0: accepted is 1 or more"),
        (["--page", "no/folder/page.md"], "no folder no/folder for --page"),
    ],
)
def test_errors_are_one_line(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 2
    printed = capsys.readouterr()
    assert printed.err.startswith("error: ") and printed.err.count("\n") == 1 and message in printed.err


def test_help_teaches(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    assert "python -m experiments.pointing --quick" in text and "--shared" in text


@pytest.mark.slow
def test_what_is_seen_without_noise_is_the_true_line(scene, cameras, points) -> None:
    """Landmarks without errors: what remains is the depth's."""
    trials = draw_trials("finger", scene, cameras, points, 2, 0)
    numbers = [jnp.asarray(a, jnp.float32) for a in (trials.line, trials.wrist, trials.velocity, trials.size)]
    keys = jax.random.split(jax.random.key(0), 2)
    small = jnp.float32(0.05)
    found = watch_trials(
        FINGER_WATCH, cameras, scene, trials.capsules, *numbers, keys, small, jnp.float32(0.0), PointingParams()
    )  # fmt: skip
    assert bool(found.chosen.all())
    np.testing.assert_allclose(found.line.tip, trials.line[:, -1], atol=2e-3)
    for line in (found.line, found.marks):
        assert (np.sum(np.asarray(line.direction) * trials.direction, axis=1) > np.cos(0.02)).all()
    np.testing.assert_allclose(found.time, 9 / 15, atol=1e-5)
    assert set(WATCHES) == set(KINDS)


def test_rows_file_has_the_section(tmp_path) -> None:
    """What the program writes can be read again."""
    from hrcjax.lab.rows import write_rows

    write_rows(tmp_path, tmp_path / "all.json", {"pointing": all_rows(made_cases(0.02, 0.011))})
    rows = json.loads((tmp_path / "all.json").read_text())["pointing"]
    assert rows["ray_p50_1m"] == {"value": pytest.approx(2.0), "unit": "cm"}


def test_the_bound_is_that_of_least_squares_and_depths_lower_it(cameras) -> None:
    """Draws of landmarks fitted by SciPy have no less spread than the bound, and hardly more."""
    from scipy.optimize import least_squares

    tip, u = np.array([0.1, 0.3, 0.3]), unit(np.array([0.2, -0.3, -0.9]))
    joints = np.array([1.0, 0.5, 0.22, 0.0])
    line = tip - 0.09 * joints[:, None] * u
    information = line_information(cameras, line, 2.5, 1.0, 8.0, False)
    told = np.linalg.inv(information)
    eyes, turns, f = (np.asarray(a, float) for a in (cameras.position, cameras.rotation, cameras.fx))

    def marks(x):
        share = np.array([1.0, x[6], x[7], 0.0])[:, None]
        points = x[:3] + share * (x[3:6] - x[:3])
        own = [(points - eye) @ R for eye, R in zip(eyes, turns, strict=True)]
        return np.stack([v[:, :2] / v[:, 2:] for v in own]).ravel() * f[0]

    random, at = np.random.default_rng(0), np.concatenate([tip, line[0], joints[1:3]])
    seen = marks(at) + 2.5 * 385 / 615 * random.normal(size=(300, 16))
    scale = np.array([0.01] * 6 + [0.1] * 2)
    found = np.array([least_squares(lambda x, y=y: marks(x) - y, at, x_scale=scale).x for y in seen])
    ratio = np.sqrt(np.diag(np.cov(found[:, :6].T)) / np.diag(told))
    np.testing.assert_allclose(ratio, 1.0, atol=0.15)
    more = line_information(cameras, line, 2.5, 1.0, 8.0, True)
    assert np.linalg.eigvalsh(more - information).min() > -1e-3 * np.abs(information).max()
    assert np.trace(np.linalg.inv(more)) < 0.9 * np.trace(told)
    place, up = tip - tip[2] / u[2] * u, np.array([0.0, 0.0, 1.0])
    errors = bound_errors(cameras, line, place, up, 2.5, 1.0, 8.0, False, 0)
    fitted = np.array([(x[:3] - x[3:6]) for x in found[:, :6]])
    hits = found[:, :3] - found[:, 2:3] / fitted[:, 2:] * fitted
    assert np.median(errors) == pytest.approx(np.median(np.linalg.norm(hits - place, axis=1)), rel=0.25)
