"""A camera that works is believed; each fault is named at its first image, and is not learnt."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import watched_cell
from scipy.stats import norm

from hrcjax.sense import d435i
from hrcjax.sense.faults import blur
from hrcjax.sense.health import (
    BLOCKED_VIEW,
    BLURRED_VIEW,
    HEALTH_REASONS,
    IDENTICAL,
    LATE_ARRIVAL,
    NO_IMAGE,
    PART_EMPTY,
    SKEWED_STAMP,
    HealthParams,
    describe_health,
    initial_health,
    judge_image,
    silent,
)
from hrcjax.sense.look import RUN, look
from hrcjax.sense.noise import NoiseParams, depth_deviation, measure

PARAMS = HealthParams()
HEIGHT, WIDTH = 60, 80
_judge = jax.jit(judge_image)
_blur = jax.jit(blur)
_measure = jax.jit(measure)
_look = jax.jit(lambda depth: look(depth, PARAMS.nearest, PARAMS.edge, PARAMS.slope))


def image(seed, kind="clean", dtype=jnp.float32):
    """A noisy image of boards before a wall, as NumPy; or what a fault makes of it."""
    draw = np.random.default_rng(seed)
    depth = np.full((HEIGHT, WIDTH), 2.0)
    for row in (5, 35):
        for column in (8, 30, 60):
            depth[row : row + 18, column : column + 12] = 1.2
    depth = np.round(depth + depth**2 * 0.0042 * draw.standard_normal(depth.shape), 3)
    if kind == "blocked":
        depth[:] = 0
    elif kind == "near":
        depth = np.round(draw.uniform(0.1, 0.2, depth.shape), 3)
    elif kind == "half":
        depth[:, : WIDTH // 2] = 0
    elif kind == "quadrant":
        depth[HEIGHT // 2 :, WIDTH // 2 :] = 0
    elif kind == "blurred":
        depth = np.asarray(_blur(jnp.asarray(depth), 9.0))
    elif kind == "silhouette":  # a lost person over half of a quadrant
        depth[: HEIGHT // 2, : WIDTH // 4] = 0
    elif kind == "close":  # a person close by, with a stereo shadow beside it
        depth[10:, 15:50] = np.round(0.5 + 0.001 * draw.standard_normal((50, 35)), 3)
        depth[10:, 7:15] = 0
    return jnp.asarray(depth, dtype)


def play(images, state=None, params=PARAMS):
    """(image, stamp, arrival, learning) one after the other -> state, reasons of each."""
    state, found = initial_health(HEIGHT, WIDTH) if state is None else state, []
    for depth, stamp, arrived, learning in images:
        times = (jnp.asarray(t, jnp.float32) for t in (stamp, arrived))
        state, reasons = _judge(params, state, depth, *times, jnp.asarray(learning))
        found.append(int(reasons))
    return state, found


def usual(k, kind="clean", learning=False, delay=0.03, seed=None):
    """The k-th image, in time."""
    return image(k if seed is None else seed, kind), k / 30, k / 30 + delay, learning


@pytest.fixture(scope="module")
def learnt():
    state, found = play([usual(k, learning=True) for k in range(5)])
    assert found == [0] * 5 and state.learnt == 5
    return state


def test_people_before_a_camera_and_every_fault_at_every_image():
    """A coarse image of a moment of each motion; rates over many more, and finer: tests/helpers/watched_cell.py."""
    names = list(watched_cell.KINDS.items())[:9]
    for sequence in range(3):
        _, (clean, each, missed, margin) = watched_cell.play(sequence, len(names), PARAMS, duration=0.4, decimation=8)
        begin = watched_cell.SETUP
        np.testing.assert_array_equal(clean, 0)
        np.testing.assert_array_equal(missed, NO_IMAGE)
        assert margin[begin:, 4].max() > 0.02  # somebody is in the picture
        for j, (name, (_, _, bit)) in enumerate(names):
            assert ((each[begin:, j] & bit) > 0).all(), name


@pytest.mark.parametrize(
    ("kind", "bits"),
    [
        ("clean", 0),
        ("blocked", BLOCKED_VIEW),
        ("near", BLOCKED_VIEW),
        ("half", PART_EMPTY),
        ("quadrant", PART_EMPTY),
        ("blurred", BLURRED_VIEW),
        ("silhouette", 0),
        ("close", 0),
    ],
)
@pytest.mark.parametrize("learning", [False, True])
def test_each_image_is_named_and_a_bad_one_not_learnt(learnt, kind, bits, learning):
    state, found = play([usual(5, kind, learning)], learnt)
    assert found == [bits]
    learns = learning and not bits
    assert (state.learnt == learnt.learnt) != learns and (state.edges == learnt.edges) != learns
    for name in ("measured", "sharpness", "delay"):
        same = np.array_equal(getattr(state, name), getattr(learnt, name))
        assert learns or same, name
    # and the next good image is believed
    assert play([usual(6)], state)[1] == [0]


def test_what_is_learnt_is_the_mean_of_the_good_images():
    kinds = ["clean", "close", "blocked", "silhouette"]
    state, found = play([usual(k, kind, True, delay=0.02 + 0.01 * k) for k, kind in enumerate(kinds)])
    assert found == [0, 0, BLOCKED_VIEW, 0]
    good = [np.asarray(image(k, kinds[k])) for k in (0, 1, 3)]
    quadrants = [
        [[np.mean(d[r, c] > 0) for c in (np.s_[:40], np.s_[40:])] for r in (np.s_[:30], np.s_[30:])] for d in good
    ]
    np.testing.assert_allclose(state.measured, np.mean(quadrants, axis=0), rtol=1e-5)
    assert float(state.delay) == pytest.approx(np.mean([0.02, 0.03, 0.05]), abs=1e-6)
    looks = [_look(jnp.asarray(d)) for d in good]
    edges = np.array([float(s.edges) for s in looks])
    assert float(state.sharpness) == pytest.approx(
        np.average([float(s.sharpness) for s in looks], weights=edges), rel=1e-5
    )
    assert float(state.edges) == edges.sum() and state.learnt == 3


@pytest.mark.parametrize("kind", ["clean", "half", "blurred", "near", "blocked"])
def test_before_anything_is_learnt_only_an_image_without_depth_is_refused(kind):
    expected = BLOCKED_VIEW if kind in ("near", "blocked") else 0
    assert play([usual(0, kind)])[1] == [expected]


def test_the_last_image_again(learnt):
    again = [usual(5, seed=7), usual(6, seed=7), usual(7, seed=7), usual(8, seed=8), usual(9, seed=7)]
    assert play(again, learnt)[1] == [0, IDENTICAL, IDENTICAL, 0, 0]
    # nearly all pixels: a twentieth may differ, not more
    share = np.asarray(image(7)).copy()
    share.reshape(-1)[: int(0.045 * share.size)] += 0.002
    more = np.asarray(image(7)).copy()
    more.reshape(-1)[: int(0.055 * more.size)] += 0.002
    for changed, bits in ((share, IDENTICAL), (more, 0)):
        two = [usual(5, seed=7), (jnp.asarray(changed), 0.2, 0.23, False)]
        assert play(two, learnt)[1] == [0, bits]


def test_images_without_depth_are_not_called_identical(learnt):
    assert play([usual(5, "blocked"), usual(6, "blocked")], learnt)[1] == [BLOCKED_VIEW] * 2
    nothing = jnp.full((HEIGHT, WIDTH), jnp.nan, jnp.float32)
    assert play([(nothing, 0.2, 0.23, False), (nothing, 0.24, 0.27, False)], learnt)[1] == [BLOCKED_VIEW] * 2


@pytest.mark.parametrize("depth", [0.29, 0.5, 1.0, 2.0])
def test_still_surfaces_repeat_less_than_the_threshold(depth):
    """Two readings of the noise model, against the probability that two rounded normal numbers are equal."""
    noise, camera = NoiseParams(), d435i(jnp.asarray([0.0, 0.0, 1.0]), jnp.zeros(3), 4)
    # a wall within one step of depth, as the probability depends on where between two steps it is
    wall = depth + jnp.linspace(0, noise.step, camera.width) * jnp.ones((camera.height, 1))
    one, two = (np.asarray(_measure(wall, camera, jax.random.key(k), noise)) for k in (0, 1))
    both = (one > 0) & (two > 0)
    deviation = float(depth_deviation(jnp.asarray(depth), noise))
    steps, offset = np.arange(-200, 201), np.linspace(0, 1, 101)[:, None]
    edges = (steps - 0.5 - offset) * noise.step / deviation
    expected = np.mean(np.sum((norm.cdf(edges + noise.step / deviation) - norm.cdf(edges)) ** 2, axis=1))
    assert np.mean((one == two)[both]) == pytest.approx(expected, abs=0.015)
    assert expected < 0.65 < PARAMS.identical_share
    if depth >= 0.5:
        assert expected == pytest.approx(noise.step / (2 * deviation * np.sqrt(np.pi)), rel=0.05)


@pytest.mark.parametrize("width", [1, 2, 3, 4, 6, 9])
def test_sharpness_of_an_edge_smeared_over_some_steps(width, dtype):
    """A row of inverse depth that rises in equal steps: the mean over windows of largest step over change, by hand."""
    inverse = np.interp(np.arange(40), [15, 15 + width], [0.5, 1.0])
    windows = np.lib.stride_tricks.sliding_window_view(inverse, RUN)
    change = np.ptp(windows, axis=1)
    ratio = np.abs(np.diff(windows, axis=1)).max(axis=1) / np.where(change > 0, change, 1)
    across = (change > PARAMS.edge) & (change > PARAMS.slope * windows.max(axis=1))
    found = _look(jnp.asarray(np.ones((20, 1)) / inverse, dtype))
    assert found.sharpness.dtype == dtype
    assert float(found.edges) == 20 * across.sum()
    assert float(found.sharpness) == pytest.approx(ratio[across].mean(), rel=1e-4)
    turned = _look(jnp.asarray((np.ones((20, 1)) / inverse).T, dtype))
    np.testing.assert_allclose([turned.sharpness, turned.edges], [found.sharpness, found.edges], rtol=1e-5)
    if width == 1:
        assert float(found.sharpness) == pytest.approx(1.0)
    if width == 9:
        assert float(found.sharpness) < PARAMS.blurred_share * 0.6


def test_real_images_are_sharp_until_they_are_blurred(shared_data):
    """Five views of a room: one threshold, from the first, tells all of them from all of them blurred."""
    clear, smeared = [], []
    for k in range(1, 6):
        lines = (shared_data / "rgbd" / "depth" / f"{k}.pgm").read_bytes()
        depth = np.frombuffer(lines[-2 * 640 * 480 :], ">u2").reshape(480, 640)[::4, ::4] / 1000
        image = jnp.asarray(depth, jnp.float32)
        clear.append(_look(image))
        smeared.append(_look(_blur(image, 9.0)))
    assert min(float(seen.edges) for seen in clear + smeared) > PARAMS.least_edges
    ratios = [float(seen.sharpness / clear[0].sharpness) for seen in clear + smeared]
    assert min(ratios[:5]) > 1.3 * PARAMS.blurred_share and max(ratios[5:]) < 0.7 * PARAMS.blurred_share


@pytest.mark.parametrize("depth", [0.0, np.nan, np.inf, 1.0])
def test_an_image_without_edges_has_no_sharpness(depth):
    found = _look(jnp.full((HEIGHT, WIDTH), depth, jnp.float32))
    assert found.edges == 0 and found.sharpness == 0
    np.testing.assert_array_equal(found.measured, 1.0 if depth == 1 else 0.0)


def test_edges_beside_holes_and_of_slopes_do_not_count():
    hole = np.full((HEIGHT, WIDTH), 1.0)
    hole[:, 40:] = 2.0
    hole[:, 40] = 0.0
    assert _look(jnp.asarray(hole)).edges == 0
    plane = 1 / np.linspace(0.4, 1.4, HEIGHT)[:, None] * np.ones(WIDTH)  # a floor seen from 1 m
    assert _look(jnp.asarray(plane)).edges == 0
    arm = 1 / np.linspace(1.25, 3.0, HEIGHT)[:, None] * np.ones(WIDTH)  # a slanting surface, 0.33 to 0.8 m away
    assert _look(jnp.asarray(arm)).edges == 0


def test_few_edges_are_not_judged(learnt):
    wall = np.round(1.0 + 0.004 * np.random.default_rng(1).standard_normal((HEIGHT, WIDTH)), 3)
    wall[20:32, 20:32] = 1.5
    wall = jnp.asarray(wall, jnp.float32)
    soft = _blur(wall, 9.0)
    assert 0 < _look(soft).edges < 1000
    few = dataclasses.replace(PARAMS, least_edges=1e4)
    assert play([(soft, 0.2, 0.23, False)], learnt)[1] == [BLURRED_VIEW]
    assert play([(soft, 0.2, 0.23, False)], learnt, few)[1] == [0]


@pytest.mark.parametrize(
    ("stamp", "arrived", "bits"),
    [
        (0.200, 0.230, 0),
        (0.200, 0.279, 0),
        (0.200, 0.285, SKEWED_STAMP),  # off the usual 30 ms
        (0.200, 0.355, SKEWED_STAMP | LATE_ARRIVAL),
        (0.200, 0.196, 0),  # the clocks are joined to 5 ms
        (0.200, 0.194, SKEWED_STAMP),
        (0.500, 0.230, SKEWED_STAMP),
        (4 / 30, 0.163, SKEWED_STAMP),  # the stamp of the last image
        (0.010, 0.040, SKEWED_STAMP),
        (-0.1, 0.230, SKEWED_STAMP | LATE_ARRIVAL),
        (np.nan, 0.230, SKEWED_STAMP),
        (0.200, np.inf, SKEWED_STAMP),
    ],
)
def test_stamps(learnt, stamp, arrived, bits):
    state, found = play([(image(5), stamp, arrived, False)], learnt)
    assert found == [bits]
    # a wrong stamp does not hold up those that follow
    assert play([usual(12)], state)[1] == [0]


def test_a_stamp_that_stands_still_is_named_each_time(learnt):
    assert play([(image(k), 0.2, 0.23 + k / 30, False) for k in range(4)], learnt)[1][0] == 0
    found = play([(image(k), 0.2, 0.23 + k / 30, False) for k in range(4)], learnt)[1]
    assert all(reasons & SKEWED_STAMP for reasons in found[1:])


def test_a_slow_way_is_learnt():
    slow = dataclasses.replace(PARAMS, late=0.4)
    state, found = play([usual(k, learning=True, delay=0.3) for k in range(3)], params=slow)
    assert found == [0] * 3
    assert play([usual(3, delay=0.32), usual(4, delay=0.2)], state, slow)[1] == [0, SKEWED_STAMP]


def test_silence(learnt, dtype):
    last = 4 / 30 + 0.03
    state = jax.tree.map(lambda a: a.astype(dtype), learnt)
    for gap, bits in ((0.9, 0), (1.49, 0), (1.51, NO_IMAGE), (100.0, NO_IMAGE), (np.nan, NO_IMAGE)):
        assert int(silent(PARAMS, state, jnp.asarray(last + gap / 30, dtype), 1 / 30)) == bits
    assert int(silent(PARAMS, initial_health(4, 4, dtype), jnp.asarray(0.0, dtype), 1 / 30)) == NO_IMAGE


def test_in_a_scan_as_in_a_loop(dtype):
    images = jnp.stack([image(k, kind, dtype) for k, kind in enumerate(["clean", "clean", "clean", "half", "blurred"])])
    images = jnp.concatenate([images, images[-1:]])
    stamps = jnp.arange(6).astype(dtype) / 30

    def step(state, item):
        depth, stamp = item
        return judge_image(PARAMS, state, depth, stamp, stamp + 0.03, stamp < 0.08)

    state, found = jax.jit(lambda a, b: jax.lax.scan(step, initial_health(HEIGHT, WIDTH, dtype), (a, b)))(
        images, stamps
    )
    assert found.tolist() == [0, 0, 0, PART_EMPTY, BLURRED_VIEW, BLURRED_VIEW | IDENTICAL]
    assert all(leaf.dtype == dtype for leaf in jax.tree.leaves(state))


def test_words():
    assert describe_health(0) == "none"
    assert describe_health(IDENTICAL | NO_IMAGE) == "the last image again; no image"
    assert list(HEALTH_REASONS) == [1, 2, 4, 8, 16, 32, 64]
