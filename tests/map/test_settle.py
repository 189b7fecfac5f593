"""What waits is fitted: as if each frame had had the time for it."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.map import (
    FrameParams,
    MapLayout,
    MapParams,
    View,
    empty_map,
    fuse,
    initial_stream,
    labelled_points,
    map_points,
    settle,
    take_frame,
)
from hrcjax.sense import d435i

LAYOUT = MapLayout(lower=(-0.6, -0.6, -0.2), shape=(12, 12, 8), capacity=512, seen=512, born=512, refitted=512)
FEW = dataclasses.replace(LAYOUT, refitted=16)


def seen(layout, dtype=jnp.float32):
    """A map after one image of a slanted plane."""
    camera = d435i(jnp.asarray([0.0, -0.3, 0.9], dtype), jnp.asarray([0.0, 0.0, 0.0], dtype), 2)
    depth = jnp.full((camera.height, camera.width), 0.85, dtype) + 0.1 * jnp.linspace(0, 1, camera.width, dtype=dtype)

    def once(depth):
        stream, params = initial_stream(dtype), FrameParams()
        return take_frame(layout, params, empty_map(layout, dtype), stream, jnp.zeros((), dtype), camera, depth)

    state, _, report, refused = jax.jit(once)(depth)
    assert int(refused) == 0
    return state, report


def test_settling_is_what_a_frame_with_time_would_have_done() -> None:
    state, report = seen(FEW)
    whole, other = seen(LAYOUT)
    assert int(report.waiting) > 16 and int(other.waiting) == 0
    done = jax.jit(lambda state: settle(FEW, MapParams(), state))(state)
    assert not bool(jnp.any(done.stale))
    for one, two in zip(done.levels, whole.levels, strict=True):
        np.testing.assert_allclose(one.rows, two.rows, rtol=1e-5, atol=1e-6)
    assert (
        float(jnp.abs(state.levels[0].rows[:, 3] - whole.levels[0].rows[:, 3]).max()) > 1e-3
    )  # it waited for something
    same = jax.jit(lambda state: settle(FEW, MapParams(), state))(done)
    for one, two in zip(jax.tree.leaves(same), jax.tree.leaves(done), strict=True):
        np.testing.assert_array_equal(one, two)


def test_a_map_without_weights_stays_as_it_is() -> None:
    state = empty_map(LAYOUT)
    assert settle(dataclasses.replace(LAYOUT, refitted=0), MapParams(), state) is state


def test_points_on_the_host_are_those_of_the_program() -> None:
    state, _ = seen(FEW)
    points, labels = labelled_points(state)
    cloud, label, _, more = map_points(state, 8192)
    there = np.asarray(cloud.mask)
    assert len(points) > 200 and not bool(more)
    np.testing.assert_array_equal(points, np.asarray(cloud.points)[there])
    np.testing.assert_array_equal(labels, np.asarray(label)[there])


def test_a_frame_reports_what_it_measured_and_what_does_not_count() -> None:
    state, camera = empty_map(FEW), d435i(jnp.zeros(3, jnp.float32), jnp.asarray([0.0, 1.0, 0.0], jnp.float32), 20)
    depths = jnp.asarray([0.1, 1.0, 2.0, 2.5, 5.0, 1.5], jnp.float32)
    points = camera.position + depths[:, None] * camera.rotation[:, 2]
    mask = jnp.asarray([True, True, True, True, True, False])
    tiles = (camera.height // 4, camera.width // 4)
    view = View(points.astype(jnp.float32), mask, jnp.full(6, 1e-4, jnp.float32), jnp.zeros(tiles, jnp.float32))
    _, report = jax.jit(lambda state, view: fuse(FEW, MapParams(), state, camera, view))(state, view)
    assert int(report.measured) == 5 and int(report.beyond) == 2
