"""The parts of the evaluation: exact worlds, other methods, what counts as seen, the page."""

from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.map.evaluate import page, peers, rows
from experiments.map.evaluate.accuracy import cosines
from experiments.map.evaluate.families import FAMILIES, VIEWS
from experiments.map.evaluate.moved import mistaken
from experiments.map.evaluate.normals import BODIES, shape_at
from experiments.map.evaluate.queries import FAR_BANDS, far_out, held_out, times_seen, truth
from experiments.map.evaluate.solids import render_world, world_distance
from experiments.map.evaluate.survey import LAYOUT, Frame, RandomThinning, pixels
from hrcjax.sense import d435i


@pytest.fixture(scope="module")
def case():
    return FAMILIES["smooth"][0](0)


@pytest.fixture(scope="module")
def frame(case):
    """An exact image of a coarse camera that sees tori, capsules and balls."""
    eye, target = jnp.asarray(case.eyes[0]), jnp.asarray(case.targets[0])
    image = np.asarray(jax.jit(lambda: render_world(d435i(eye, target, 4), case.world))())
    return Frame(d435i(eye, target, 4), image, np.where(np.isfinite(image), image, 0))


def test_images_lie_on_the_exact_surfaces(case, frame):
    p = pixels(frame, frame.measured)
    d, n = truth(case.world, p)
    assert len(p) > 10_000 and np.percentile(np.abs(d), 99.9) < 1e-3
    way = np.asarray(frame.camera.position) - p
    assert np.mean(np.sum(way * n, axis=1) > 0) > 0.999  # on the side that is seen
    for middle in np.asarray(case.world.tori.center):
        assert np.sum(np.linalg.norm(p - middle, axis=1) < 0.17) > 50


def test_every_case_looks_at_free_places(case):
    for make, seeds in FAMILIES.values():
        for seed in seeds:
            one = make(seed)
            assert one.eyes.shape == one.targets.shape == (VIEWS, 3)
            d, _ = truth(one.world, one.eyes)
            assert np.min(d) > 0.1 and np.all(one.lower < one.upper)
    again = FAMILIES["smooth"][0](0)
    assert all(np.array_equal(a, b) for a, b in zip(jax.tree.leaves(case), jax.tree.leaves(again), strict=True))


def test_held_out_places_are_free_and_their_surface_was_seen(case, frame):
    asked = held_out(case, [frame, frame, frame], 200, 0)
    assert len(asked.x) == 200 and np.all((asked.distance > 0) & (asked.distance < 0.3))
    foot = asked.x - asked.distance[:, None] * asked.gradient
    assert np.all(times_seen([frame], foot, asked.gradient) == 1)
    behind = foot - 0.05 * asked.gradient
    assert np.mean(times_seen([frame], behind, asked.gradient)) < 0.1


def test_peers_on_a_plane():
    a, b = np.meshgrid(*2 * [np.arange(-12, 12) * 0.025 + 0.0125])
    points = np.stack([a.ravel(), b.ravel(), np.full(a.size, 0.1125)], axis=1)
    x = np.random.default_rng(0).uniform([-0.1, -0.1, 0.15], [0.1, 0.1, 0.3], (100, 3))
    up = np.tile([0.0, 0.0, 1.0], (100, 1))
    for method in (peers.nearest_point, peers.voxel_transform):
        d, g = method(points, x)
        assert np.max(np.abs(d - (x[:, 2] - 0.1125))) < 0.005 and np.min(cosines(g, up)) > 0.9


def test_thinning_keeps_one_point_a_voxel_without_favour():
    corner = np.asarray(LAYOUT.lower, np.float32) + np.float32(0.5)
    thin = RandomThinning(0)
    places = np.arange(400, dtype=np.float32)[:, None] * np.asarray([0, 0.025, 0], np.float32)
    places = corner + places % 2.5 + np.floor(places[:, 1:2] / 2.5) * np.asarray([0.025, 0, 0], np.float32)
    for k in range(4):
        thin.add(places + np.float32(0.003 * (k + 1)))
    kept = thin.result()
    assert len(kept) == 400 and len(thin.result(4)) == 400 and len(thin.result(5)) == 0
    within = np.rint((kept[:, 2] - corner[2]) / 0.003).astype(int)
    assert np.min(np.bincount(within, minlength=5)[1:]) > 60


def test_curvatures_of_analytic_bodies():
    x = jnp.asarray([0.31, 0.0, 0.0], jnp.float32)
    foot, n, k = jax.jit(lambda x: shape_at(BODIES["torus_200_100"], x))(x)
    np.testing.assert_allclose(foot, [0.3, 0, 0], atol=1e-5)
    np.testing.assert_allclose(n, [1, 0, 0], atol=1e-5)
    np.testing.assert_allclose(k, [10, 1 / 0.3], rtol=0.01)


def test_floor_and_absent_solids(case):
    low = jnp.asarray([1.8, 1.8, -0.6], jnp.float32)
    np.testing.assert_allclose(world_distance(case.world, low), 0.15, atol=1e-5)
    plain = FAMILIES["robotica"][0](0).world
    assert np.isfinite(world_distance(plain, low))


def test_bars_and_page():
    assert page.held(2.9, "< 3") and not page.held(3.0, "< 3") and page.held(0.95, ">= 0.95")
    assert page.held(0.95, "0.93 to 0.99") and not page.held(0.995, "0.93 to 0.99")
    assert page.held(8.0, "< 10, below all peers") and page.held(0, "0")
    text = page.page({"a": rows.row(1.0, "mm", "< 3"), "b": rows.row(float("nan"), "mm; not there", "< 3")}, "end")
    assert "| a | 1 | mm | < 3 | yes |" in text and "| b | nan | mm; not there | < 3 | - |" in text
    assert "FIESTA" in text and text.endswith("end")
    assert rows.real_rows(None)["real_median"]["bar"] == "< 25"


def test_places_far_away_are_in_their_bands_and_their_surface_is_mapped_and_was_seen(case, frame):
    bands = far_out(case, [frame, frame, frame], 0)
    low = np.asarray(LAYOUT.lower)
    high = low + LAYOUT.edge_of(0) * np.asarray(LAYOUT.shape)
    for (least, most), asked in zip(pairwise(FAR_BANDS), bands, strict=True):
        foot = asked.x - asked.distance[:, None] * asked.gradient
        assert len(asked.x) > 20 and np.all((asked.distance >= least) & (asked.distance < most))
        assert np.all((foot > low) & (foot < high)) and np.all(times_seen([frame], foot, asked.gradient) == 1)
    assert np.any(bands[-1].x > high)


def test_an_error_of_a_pose_has_the_size_that_is_told(frame):
    told = mistaken(frame, np.random.default_rng(0))
    np.testing.assert_allclose(np.linalg.norm(told.camera.position - frame.camera.position), 0.005, rtol=1e-3)
    turn = np.asarray(told.camera.rotation) @ np.asarray(frame.camera.rotation).T
    np.testing.assert_allclose(np.rad2deg(np.arccos((np.trace(turn) - 1) / 2)), 0.3, rtol=0.05)
    assert told.measured is frame.measured
