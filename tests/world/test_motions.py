"""Our own motions: bones, speeds, smoothness, where the person is and when."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.segment import separation
from hrcjax.world.motions import MOTIONS, bump, frame_count, motion_named, smooth_step
from hrcjax.world.person import RADII, REGIONS, person_at
from hrcjax.world.place import EDGE_GAP, path_middle, standing_place
from hrcjax.world.scene import FLOOR_Z, Scene
from hrcjax.world.scenes import clutter, hri, robotica

MOVING = ("reach_in", "pass_by", "stand_and_work", "reach_and_stay")
SCENES = {"robotica": robotica(dtype=jnp.float64), "hri": hri(jnp.float64), "clutter": clutter(3, jnp.float64)}
_made = {}


def _motion(name, scene, seed=0, rate=30.0):
    key = (name, scene, seed, rate)
    if key not in _made:
        _made[key] = motion_named(name, SCENES[scene], seed, rate=rate)
    return _made[key]


_apart = jax.jit(lambda person, t, line: separation(person_at(person, t), line))


def _line(scene: Scene, start=0.0, end=1.0):
    a, b = scene.start + start * (scene.goal - scene.start), scene.start + end * (scene.goal - scene.start)
    return Capsules(a[None], b[None], jnp.zeros(1, a.dtype))


@pytest.mark.parametrize("name", MOVING)
@pytest.mark.parametrize("scene", SCENES)
def test_bones_speeds_and_ground(name, scene):
    person = _motion(name, scene)
    a, b = np.asarray(person.a), np.asarray(person.b)
    assert a.shape == (241, 14, 3) and np.isfinite(a).all() and np.isfinite(b).all()
    length = np.linalg.norm(b - a, axis=-1)
    bones = np.median(length, axis=0)
    np.testing.assert_allclose(length, bones[None].repeat(241, 0), atol=1e-9)
    expected = {"upper arm": 0.33, "forearm": 0.26, "hand": 0.10, "thigh": 0.43}
    for region, bone in zip(REGIONS, bones, strict=True):
        assert bone == pytest.approx(expected.get(region, bone), abs=1e-9)
    for ends in (a, b):
        assert np.linalg.norm(np.diff(ends, axis=0), axis=-1).max() * 30 < 2.5
    assert (b[:, 12:, 2] - RADII["lower leg"] > FLOOR_Z - 1e-6).all()  # feet are over the floor
    assert b[:, 12:, 2].min() < FLOOR_Z + 0.1  # and on it
    crown = b[:, REGIONS.index("head"), 2].max() + RADII["head"] - FLOOR_Z
    assert 1.6 < crown < 1.9
    for k in (4, 5):  # joints hold together: elbow, wrist
        np.testing.assert_allclose(b[:, k], a[:, k + 2], atol=1e-12)
        np.testing.assert_allclose(b[:, k + 2], a[:, k + 4], atol=1e-12)
    np.testing.assert_allclose(b[:, 10:12], a[:, 12:14], atol=1e-12)


@pytest.mark.parametrize("name", MOVING)
def test_left_is_left(name):
    person = _motion(name, "robotica")
    a = np.asarray(person.a)
    forward = np.cross(a[:, 5] - a[:, 4], [0, 0, -1.0])[0, :2]  # from left to right shoulder, x down = forward
    expected = [1, 0] if name == "pass_by" else [0, -1]
    np.testing.assert_allclose(forward / np.linalg.norm(forward), expected, atol=1e-9)
    nose = (np.asarray(person.b)[:, 2] - a[:, 0])[:, :2] @ np.asarray(expected)
    assert nose.max() >= -1e-9  # leans forward, if at all


@pytest.mark.parametrize("name", MOVING)
def test_acceleration_is_continuous(name):
    """Halving the step halves the jump of the acceleration: the motion is twice differentiable."""
    jumps = []
    for rate in (60.0, 120.0):
        wrist = np.asarray(_motion(name, "robotica", rate=rate).b)[:, 6:10]
        acceleration = np.diff(wrist, n=2, axis=0) * rate**2
        jumps.append(np.abs(np.diff(acceleration, axis=0)).max())
    assert jumps[1] < 0.65 * jumps[0]
    assert jumps[0] < 3.0


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("seed", [0, 1, 4])
def test_distance_at_the_start(scene, seed):
    for name in MOVING:
        person = _motion(name, scene, seed)
        assert float(_apart(person, 0.0, _line(SCENES[scene], 0.0, 0.0))) > 0.45


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_reach_is_in_the_path_in_the_middle_of_the_episode_only(scene, seed):
    person = _motion("reach_in", scene, seed)
    path = _line(SCENES[scene], 0.1, 0.9)
    near = np.array([float(_apart(person, t, path)) for t in np.arange(0, 8.01, 0.25)])
    t = np.arange(0, 8.01, 0.25)
    assert near[(t > 3.6) & (t < 4.7)].max() < 0.0
    assert near[(t < 1.5) | (t > 7.3)].min() > 0.25
    assert float(np.median(np.abs(np.diff(near)))) < 0.2


def test_the_hand_reaches_the_target_of_the_robotica_scene():
    person = _motion("reach_in", "robotica")
    hand = np.asarray(person_at(person, 4.2).b)[9]  # the right hand
    np.testing.assert_allclose(hand, path_middle(SCENES["robotica"]), atol=2e-3)


@pytest.mark.parametrize("scene", ["robotica", "hri"])
def test_arms_do_not_pass_through_the_table(scene):
    for name in MOVING:
        person = _motion(name, scene)
        for region in ("hand", "forearm"):
            for k in [i for i, r in enumerate(REGIONS) if r == region]:
                ends = np.asarray(person.b)[:, k]
                over = ends[:, 1] + 0.02 < float(SCENES[scene].table_upper[1])
                assert (ends[over, 2] > 0.02).all(), (name, region)


def test_pass_by_walks_at_its_distance_and_speed():
    for seed in (0, 1, 2, 3):
        person = _motion("pass_by", "robotica", seed)
        hip = np.asarray(person.a)[:, 0]
        step = np.diff(hip, axis=0) * 30
        np.testing.assert_allclose(np.abs(step[:, 0]), 1.2, atol=1e-9)
        np.testing.assert_allclose(step[:, 1:], 0, atol=1e-9)
        assert 1.25 <= hip[0, 1] <= 1.5
        assert hip[120, 0] == pytest.approx(float(path_middle(SCENES["robotica"])[0]))
    assert float(np.asarray(_motion("pass_by", "robotica", 0).a)[0, 0, 1]) == pytest.approx(1.35)


def test_work_stays_at_the_table():
    person = _motion("stand_and_work", "robotica")
    hands = np.asarray(person.b)[:, 8:10]
    base = np.linalg.norm(hands[..., :2], axis=-1)
    assert base.min() > 0.7 and base.max() < 1.5
    assert np.ptp(hands, axis=0).min() > 0.05  # both move, in every direction
    assert np.ptp(hands, axis=0).max() < 0.5


def test_seeds_vary_and_repeat():
    for name in MOVING:
        one, two, again = (_motion(name, "hri", 1), _motion(name, "hri", 2), motion_named(name, SCENES["hri"], 1))
        assert not np.allclose(one.a, two.a, atol=1e-4)
        np.testing.assert_array_equal(one.a, again.a)


def test_nobody_is_never_there():
    person = motion_named("nobody", SCENES["hri"])
    assert not np.asarray(person.present).any()
    assert person.a.shape == (241, 14, 3)
    assert (np.asarray(person_at(person, 3.0).radius) < 0).all()


def test_jit_of_the_whole_is_the_same_in_float32(dtype):
    scene = robotica(dtype=dtype)
    jitted = jax.jit(lambda s: motion_named("reach_in", s, 1, 2.0, 10.0))(scene)
    assert jitted.a.dtype == dtype and jitted.a.shape == (21, 14, 3)
    np.testing.assert_allclose(jitted.a, motion_named("reach_in", scene, 1, 2.0, 10.0).a, atol=1e-5)
    assert float(jitted.rate) == 10


def test_smooth_step_and_bump():
    t = jnp.linspace(0, 1, 11)
    step = jax.vmap(lambda t: smooth_step(t, 0.2, 0.7))(t)
    np.testing.assert_allclose(step[:3], 0)
    np.testing.assert_allclose(step[7:], 1, atol=1e-12)
    assert float(smooth_step(0.45, 0.2, 0.7)) == pytest.approx(0.5)
    first = jax.grad(lambda t: smooth_step(t, 0.0, 1.0))
    assert float(first(0.5)) == pytest.approx(1.875)  # of a minimum jerk motion
    assert float(first(1e-3)) < 1e-4 and abs(float(jax.grad(first)(1e-4))) < 1e-2
    values = [float(bump(t, 0.1, 0.2, 0.6, 0.9)) for t in (0.05, 0.3, 0.95)]
    np.testing.assert_allclose(values, [0, 1, 0], atol=1e-12)


def test_places_and_errors():
    scene = SCENES["robotica"]
    np.testing.assert_allclose(standing_place(scene), [0.4, 0.78 + EDGE_GAP])
    np.testing.assert_allclose(standing_place(scene, aside=0.3, back=0.5), [0.7, 0.78 + EDGE_GAP + 0.5])
    np.testing.assert_allclose(standing_place(SCENES["hri"], aside=0.3), [-0.565, 0.78 + EDGE_GAP])
    np.testing.assert_allclose(standing_place(scene, aside=9.0)[0], scene.table_upper[0])
    with pytest.raises(ValueError, match="unknown motion 'dance': accepted are reach_in, pass_by"):
        motion_named("dance", scene)
    with pytest.raises(ValueError, match="must be positive"):
        frame_count(0.0, 30.0)
    assert all(entry.description for entry in MOTIONS.values())


@pytest.mark.parametrize("seed", [0, 3])
def test_a_hand_that_stays(seed):
    """From 2.5 s on, for ever, where `reach_in` puts it; whatever the duration."""
    scene = SCENES["robotica"]
    long, short = (motion_named("reach_and_stay", scene, seed, duration) for duration in (12.0, 6.5))
    came = motion_named("reach_in", scene, seed, 6.0)
    hands = [np.asarray(p.b)[:, [8, 9]] for p in (long, short, came)]
    np.testing.assert_allclose(hands[0][90:], hands[0][[90]].repeat(len(hands[0]) - 90, axis=0), atol=1e-6)
    np.testing.assert_allclose(hands[0][100], hands[2][95], atol=1e-5)
    np.testing.assert_allclose(hands[1][-1], hands[0][-1], atol=1e-5)
    assert np.abs(hands[2][-1] - hands[0][-1]).max() > 0.3
