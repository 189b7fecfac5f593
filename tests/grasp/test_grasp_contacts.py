"""Normals of the three ways against those of exact shapes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.typing import NDArray
from surfaces import box, cylinder, sphere

from hrcjax.field import FieldParams, fit_exact
from hrcjax.geom.cloud import Cloud
from hrcjax.grasp.contacts import Contacts, by_hessian, by_nearest, by_plane, contacts
from hrcjax.grasp.seen_points import SeenPoints

SHAPES = {"sphere": sphere(0.035), "box": box((0.024, 0.03, 0.036)), "cylinder": cylinder(0.03, 0.045)}
CAPACITY = 640


def seen(points: NDArray, normals: NDArray, dtype: jnp.dtype) -> SeenPoints:
    """Places beyond the points hold what must not matter."""
    rest = CAPACITY - len(points)
    assert rest >= 0
    cloud = Cloud(
        jnp.asarray(np.concatenate([points, np.full((rest, 3), 7.0)]), dtype),
        jnp.asarray(np.arange(CAPACITY) < len(points)),
    )
    aside = np.cross(normals, [0.3, 0.5, -0.8])  # seen aslant
    toward = normals + 0.5 * aside
    toward = np.concatenate([toward / np.linalg.norm(toward, axis=1)[:, None], np.zeros((rest, 3))])
    return SeenPoints(cloud, jnp.asarray(toward, dtype), jnp.zeros(CAPACITY, dtype), jnp.asarray(False))


@jax.jit
def found(one: SeenPoints) -> dict[str, Contacts]:
    field, _ = fit_exact(one.cloud, FieldParams(length_scale=0.0055, noise=0.05))
    ways = {"hessian": by_hessian(field, 0.9), "pca": by_plane(one.cloud, 0.9), "nearest": by_nearest(one.cloud, 0.006)}
    return {name: contacts(one, way) for name, way in ways.items()}


def off(one: Contacts, normals: NDArray) -> NDArray:
    cosine = np.sum(np.asarray(one.normals, float)[: len(normals)] * normals, axis=1)
    return np.rad2deg(np.arccos(np.clip(cosine, -1, 1)))


@pytest.mark.parametrize("name", SHAPES)
def test_normals_are_those_of_the_shape(name: str, dtype: jnp.dtype) -> None:
    points, normals = SHAPES[name]
    ways = found(seen(points, normals, dtype))
    for one in ways.values():
        assert one.normals.dtype == dtype
        assert not np.asarray(one.mask)[len(points) :].any()
        assert np.isfinite(np.asarray(one.normals)).all()
    for way in ("hessian", "pca"):
        ok = np.asarray(ways[way].mask)[: len(points)]
        assert ok.mean() > (0.4 if name == "box" else 0.7)
        assert np.median(off(ways[way], normals)[ok]) < (2.0 if name == "box" else 1.0)
        assert np.percentile(off(ways[way], normals)[ok], 95) < (13.0 if name == "box" else 3.5)


def test_edges_are_refused_and_faces_are_not() -> None:
    points, normals = SHAPES["box"]
    ok = np.asarray(found(seen(points, normals, jnp.dtype("float64")))["hessian"].mask)[: len(points)]
    inner = np.sort(np.array([0.024, 0.03, 0.036]) - np.abs(points), axis=1)[:, 1]  # to the nearest edge
    assert ok[inner > 0.012].all()
    assert not ok[inner < 0.004].any()


def test_a_ball_too_small_for_the_length_scale_is_refused() -> None:
    points, normals = sphere(0.012)
    ways = found(seen(points, normals, jnp.dtype("float64")))
    assert not np.asarray(ways["hessian"].mask).any()
    assert np.asarray(ways["nearest"].mask)[: len(points)].all()  # it knows no better


def test_normals_turn_with_the_shape() -> None:
    points, normals = SHAPES["cylinder"]
    points = points + np.random.default_rng(2).normal(0, 2e-4, points.shape)  # no two neighbours equally far
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    straight = found(seen(points, normals, jnp.dtype("float64")))
    one = seen(points, normals, jnp.dtype("float64"))
    moved = SeenPoints(
        Cloud(one.cloud.points @ turn.T + jnp.asarray([0.1, -0.2, 0.3]), one.cloud.mask), one.toward @ turn.T,
        one.deviation, one.more,
    )  # fmt: skip
    turned = found(moved)
    for way, here in straight.items():
        mask = np.asarray(here.mask)
        assert np.array_equal(mask, np.asarray(turned[way].mask))
        np.testing.assert_allclose(np.asarray(here.normals)[mask] @ turn.T, np.asarray(turned[way].normals)[mask], atol=1e-6)  # fmt: skip


def test_no_points_give_no_contacts_and_finite_numbers() -> None:
    nothing = SeenPoints(
        Cloud(jnp.zeros((CAPACITY, 3)), jnp.zeros(CAPACITY, bool)), jnp.zeros((CAPACITY, 3)), jnp.zeros(CAPACITY), jnp.asarray(False)
    )  # fmt: skip
    for one in found(nothing).values():
        assert not np.asarray(one.mask).any()
        assert np.isfinite(np.asarray(one.normals)).all() and np.isfinite(np.asarray(one.planarity)).all()


def test_points_on_a_line_have_no_plane() -> None:
    line = np.outer(np.arange(12) * 0.006, [0.6, 0.0, 0.8])
    one = seen(line, np.tile([0.0, 1.0, 0.0], (12, 1)), jnp.dtype("float64"))
    ways = found(one)
    assert not np.asarray(ways["pca"].mask).any() and not np.asarray(ways["hessian"].mask).any()


def test_a_place_that_is_no_number_is_no_contact() -> None:
    points, normals = SHAPES["sphere"]
    points = points.copy()
    points[3] = np.nan
    for one in found(seen(points, normals, jnp.dtype("float64"))).values():
        used = np.asarray(one.mask)
        assert np.isfinite(np.asarray(one.normals)[used]).all() and np.isfinite(np.asarray(one.points)[used]).all()


def test_three_points_are_too_few_for_a_plane() -> None:
    points = np.array([[0, 0, 0], [0.006, 0, 0], [0, 0.006, 0.0]])
    assert not np.asarray(found(seen(points, np.tile([0.0, 0, 1], (3, 1)), jnp.dtype("float64")))["pca"].mask).any()
