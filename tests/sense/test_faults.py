"""Every fault does to an image what it says, from its begin to before its end, on its camera alone."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.ndimage import uniform_filter

from hrcjax.sense.faults import (
    AMOUNTS,
    BLOCKED,
    BLURRED,
    DROPPED,
    FAULTS,
    FROZEN,
    HALF_EMPTY,
    LATE,
    NONE,
    PERSON_LOST,
    SKEWED,
    blur,
    deliver,
    join_faults,
    no_faults,
    one_fault,
)

HEIGHT, WIDTH = 24, 31
RNG = np.random.default_rng(0)
DEPTH = np.round(RNG.uniform(0.5, 2.0, (HEIGHT, WIDTH)), 3) * (RNG.uniform(size=(HEIGHT, WIDTH)) > 0.1)
LAST = np.round(RNG.uniform(0.5, 2.0, (HEIGHT, WIDTH)), 3)
PERSON = np.zeros((HEIGHT, WIDTH), bool)
PERSON[4:20, 8:20] = True

_deliver = jax.jit(deliver)
_blur = jax.jit(blur)


def given(schedule, exposed=0.5, camera=0, dtype=jnp.float32, seed=0):
    """What a camera delivers of the images above, as NumPy."""
    depth, last = jnp.asarray(DEPTH, dtype), jnp.asarray(LAST, dtype)
    out = _deliver(
        schedule,
        jnp.asarray(camera, jnp.int32),
        jnp.asarray(exposed, dtype),
        depth,
        jnp.asarray(PERSON),
        last,
        jax.random.key(seed),
    )
    assert out.depth.dtype == out.stamp.dtype == out.delay.dtype == depth.dtype
    return jax.tree.map(np.asarray, out)


def fault(kind, amount=None, begin=0.0, end=1.0, camera=0, cameras=1, dtype=jnp.float32):
    return one_fault(kind, camera, begin, end, cameras, amount, dtype)


def untouched(out, exposed, dtype):
    np.testing.assert_array_equal(out.depth, np.asarray(DEPTH, dtype))
    assert out.stamp == np.asarray(exposed, dtype) and out.delay == 0 and out.arrives


@pytest.mark.parametrize("kind", FAULTS)
def test_from_begin_to_before_end_on_its_camera_alone(kind, dtype):
    schedule = fault(kind, begin=0.25, end=0.75, camera=1, cameras=3, dtype=dtype)
    for camera, exposed in [(0, 0.5), (2, 0.5), (1, 0.2), (1, np.nextafter(np.float32(0.25), 0)), (1, 0.75), (1, 9.0)]:
        untouched(given(schedule, exposed, camera, dtype), exposed, dtype)
    for exposed in (0.25, 0.5, np.nextafter(np.float32(0.75), 0)):
        out = given(schedule, exposed, 1, dtype)
        same = np.array_equal(out.depth, np.asarray(DEPTH, dtype))
        assert (same and out.stamp == np.asarray(exposed, dtype) and not out.delay and out.arrives) == (kind == NONE)


def test_cameras_that_work(dtype):
    for camera in range(2):
        untouched(given(no_faults(2, dtype), 0.3, camera, dtype), 0.3, dtype)


def test_a_lost_person_is_not_measured_and_all_else_is():
    out = given(fault(PERSON_LOST)).depth
    np.testing.assert_array_equal(out[PERSON], 0)
    np.testing.assert_array_equal(out[~PERSON], DEPTH[~PERSON].astype(np.float32))
    there = PERSON & (DEPTH > 0)
    lost = [given(fault(PERSON_LOST, 0.3), seed=seed).depth[there] == 0 for seed in range(20)]
    assert np.mean(lost) == pytest.approx(0.3, abs=4 * np.sqrt(0.21 / np.size(lost)))


def test_a_frozen_camera_gives_the_last_image_bit_by_bit_under_a_new_stamp(dtype):
    out = given(fault(FROZEN, dtype=dtype), 0.5, dtype=dtype)
    assert out.depth.tobytes() == np.asarray(LAST, dtype).tobytes() and out.stamp == 0.5


def test_a_frozen_camera_stays_at_one_image():
    schedule = fault(FROZEN, begin=0.15)

    def image(last, item):
        k, exposed = item
        depth = jnp.full((HEIGHT, WIDTH), 1 + 0.01 * k, jnp.float32)
        camera = jnp.zeros((), jnp.int32)
        out = deliver(schedule, camera, exposed, depth, jnp.asarray(PERSON), last, jax.random.key(0))
        return jnp.where(out.arrives, out.depth, last), out.depth[0, 0]

    steps = jnp.arange(5).astype(jnp.float32)
    seen = jax.lax.scan(image, jnp.zeros((HEIGHT, WIDTH), jnp.float32), (steps, 0.1 * steps))[1]
    np.testing.assert_allclose(seen, [1.0, 1.01, 1.01, 1.01, 1.01], atol=1e-6)


def test_a_covered_lens():
    assert not given(fault(BLOCKED)).depth.any()
    near = given(fault(BLOCKED, 0.15)).depth
    assert near.mean() == pytest.approx(0.15, abs=0.003) and near.std() == pytest.approx(0.015, rel=0.15)
    assert near.min() > 0 and near.max() < 0.28
    np.testing.assert_allclose(near * 1000, np.round(near * 1000), atol=1e-3)


@pytest.mark.parametrize("width", [1, 3, 5, 9, 99])
def test_blur_is_the_mean_of_what_is_measured(width, dtype):
    """Against SciPy's box filter: mean of depth over mean of what is measured, both of the image set in zeros."""
    there = np.pad((DEPTH > 0).astype(float), width)
    inside = np.pad(np.ones_like(DEPTH), width)

    def mean(image):
        return uniform_filter(image, width, mode="constant")[width:-width, width:-width]

    measured = mean(there) / mean(inside)
    expected = mean(np.pad(DEPTH, width)) / np.maximum(mean(there), 1e-9)
    out = np.asarray(_blur(jnp.asarray(DEPTH, dtype), jnp.asarray(width, dtype)))
    clear = np.abs(measured - 0.5) > 1e-6
    np.testing.assert_array_equal((out > 0)[clear], (measured > 0.5)[clear])
    np.testing.assert_allclose(out[out > 0], expected[out > 0], atol=5.01e-4)


def test_blur_mixes_foreground_and_background():
    image = jnp.asarray(np.where(np.arange(40) < 20, 1.0, 2.0) * np.ones((20, 1)), jnp.float32)
    row = np.asarray(_blur(image, 9.0))[10]
    np.testing.assert_allclose(row[15:25], 1 + np.r_[0, np.arange(1, 9), 9] / 9, atol=5.1e-4)
    np.testing.assert_allclose(given(fault(BLURRED)).depth, _blur(jnp.asarray(DEPTH, jnp.float32), 9.0), atol=1e-6)


@pytest.mark.parametrize("pixel", [np.nan, np.inf, 0.0])
def test_what_is_not_measured_does_not_spread(pixel):
    image = jnp.ones((9, 9)).at[4, 4].set(pixel)
    np.testing.assert_allclose(_blur(image, 3.0), 1.0, atol=1e-6)


def test_half_an_image():
    left, right = given(fault(HALF_EMPTY)).depth, given(fault(HALF_EMPTY, -1.0)).depth
    half = WIDTH // 2
    assert not left[:, :half].any() and not right[:, half:].any()
    np.testing.assert_array_equal(left + right, DEPTH.astype(np.float32))


def test_stamps_and_delays():
    late, skewed, dropped = (given(fault(kind)) for kind in (LATE, SKEWED, DROPPED))
    assert (late.stamp, late.delay, late.arrives) == (0.5, pytest.approx(0.2), True)
    assert (skewed.stamp, skewed.delay, skewed.arrives) == (pytest.approx(0.2), 0, True)
    assert given(fault(SKEWED, 0.4)).stamp == pytest.approx(0.9)
    assert not dropped.arrives
    for out in (late, skewed):
        np.testing.assert_array_equal(out.depth, DEPTH.astype(np.float32))


def test_several_faults_at_once_and_one_after_the_other():
    schedule = join_faults(
        fault(LATE, 0.1, end=0.4), fault(LATE, 0.3), fault(HALF_EMPTY), fault(SKEWED, end=0.4), no_faults(1)
    )
    both, after = given(schedule, 0.3), given(schedule, 0.6)
    assert both.delay == pytest.approx(0.1) and both.stamp == pytest.approx(0.0, abs=1e-6)
    assert after.delay == pytest.approx(0.3) and after.stamp == pytest.approx(0.6)
    for out in (both, after):
        np.testing.assert_array_equal(out.depth, given(fault(HALF_EMPTY)).depth)
    # what the driver repeats, the lens does not change
    frozen = given(join_faults(fault(BLOCKED), fault(FROZEN)))
    np.testing.assert_array_equal(frozen.depth, LAST.astype(np.float32))


def test_all_cameras_at_once_are_one_after_the_other():
    schedule = join_faults(fault(HALF_EMPTY, camera=0, cameras=3), fault(BLURRED, camera=2, cameras=3))
    keys = jax.random.split(jax.random.key(1), 3)
    depth, last, person = jnp.asarray(DEPTH, jnp.float32), jnp.asarray(LAST, jnp.float32), jnp.asarray(PERSON)
    half = jnp.asarray(0.5, jnp.float32)

    @jax.jit
    def one(camera, key):
        return deliver(schedule, camera, half, depth, person, last, key)

    together = jax.jit(jax.vmap(one))(jnp.arange(3), keys)
    for k in range(3):
        jax.tree.map(lambda a, b, k=k: np.testing.assert_array_equal(a[k], b), together, one(jnp.asarray(k), keys[k]))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": 9}, "unknown kind"),
        ({"camera": 2}, "camera 2 of 2"),
        ({"camera": -1}, "camera -1"),
        ({"end": 0.0}, "end must be after"),
        ({"kind": PERSON_LOST, "amount": 1.2}, "amount 1.2"),
        ({"kind": BLOCKED, "amount": -0.1}, "amount"),
        ({"kind": BLURRED, "amount": 0.0}, "amount"),
        ({"kind": HALF_EMPTY, "amount": 0.0}, "amount"),
        ({"kind": LATE, "amount": -0.2}, "amount"),
        ({"kind": SKEWED, "amount": np.nan}, "amount"),
    ],
)
def test_what_is_no_fault_is_named(change, words):
    with pytest.raises(ValueError, match=words):
        one_fault(**({"kind": FROZEN, "camera": 0, "begin": 0.0, "end": 1.0, "cameras": 2} | change))


def test_schedules_of_different_cameras_do_not_join():
    with pytest.raises(ValueError, match=r"schedules of \[1, 2\] cameras"):
        join_faults(no_faults(1), no_faults(2))


def test_every_kind_has_words_and_an_amount():
    assert list(FAULTS) == list(AMOUNTS) == list(range(9)) and len(set(FAULTS.values())) == 9
