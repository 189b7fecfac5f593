"""Points of a map within a box, with the directions from which they were seen."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from hrcjax.grasp.seen_points import seen_points
from hrcjax.map import FieldMap, MapLayout, empty_map
from hrcjax.map.direction import LEVELS

LAYOUT = MapLayout(lower=(0.0, 0.0, 0.0), shape=(2, 2, 2), spacing=0.01, capacity=8, levels=2, seen=8, born=8, refitted=0)  # fmt: skip
LOWER, UPPER = jnp.zeros(3), jnp.full(3, 0.08)


def a_map(points: np.ndarray, deviations: np.ndarray, toward: np.ndarray) -> FieldMap:
    """The points in the first voxels of the first block."""
    state = empty_map(LAYOUT, jnp.dtype("float64"))
    level = state.levels[0]
    count = len(points)
    rows = level.rows.at[0, :3, :count].set(jnp.asarray(points.T)).at[0, 3, :count].set(1.0)
    way = level.toward.at[0, :, :count].set(jnp.asarray(np.round(toward.T * LEVELS)).astype(level.toward.dtype))
    information = state.information.at[0, :count].set(jnp.asarray(1 / deviations**2))
    return eqx.tree_at(lambda s: (s.levels[0].rows, s.levels[0].toward, s.information), state, (rows, way, information))


POINTS = np.array([[0.01, 0.01, 0.01], [0.02, 0.01, 0.03], [0.03, 0.02, 0.01]])
DEVIATIONS = np.array([1e-4, 5e-3, 2e-4])
TOWARD = np.array([[0, 0, 1.0], [0, 1.0, 0], [0.6, 0, 0.8]])


def test_points_come_with_where_they_were_seen_from() -> None:
    seen = seen_points(a_map(POINTS, DEVIATIONS, TOWARD), 5, LOWER, UPPER)
    assert seen.cloud.mask.tolist() == [True, True, True, False, False] and not bool(seen.more)
    np.testing.assert_allclose(seen.cloud.points[:3], POINTS)
    np.testing.assert_allclose(seen.toward[:3], TOWARD, atol=0.02)
    np.testing.assert_allclose(np.linalg.norm(seen.toward[:3], axis=1), 1)
    np.testing.assert_allclose(seen.deviation[:3], DEVIATIONS)
    assert np.isfinite(np.asarray(seen.toward)).all()


def test_unsure_points_and_those_beyond_the_box_are_left_out() -> None:
    state = a_map(POINTS, DEVIATIONS, TOWARD)
    np.testing.assert_allclose(seen_points(state, 2, LOWER, UPPER, 1e-3).cloud.points, POINTS[[0, 2]])
    low = seen_points(state, 4, LOWER.at[2].set(0.02), UPPER)
    assert low.cloud.mask.tolist() == [True, False, False, False]
    np.testing.assert_allclose(low.cloud.points[0], POINTS[1])


def test_more_points_than_places_are_told() -> None:
    seen = seen_points(a_map(POINTS, DEVIATIONS, TOWARD), 2, LOWER, UPPER)
    assert bool(seen.more) and seen.cloud.mask.all()
