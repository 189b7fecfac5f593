"""The nearest points in several directions: against all points one by one, at the edges, and through a reading to the governor."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcjax import safety
from hrcjax.field import FAR, FieldParams, GridLayout, fit, fit_grid
from hrcjax.field.near import MEMBERS, another, grouped, groups_of, nearest_others
from hrcjax.geom.cloud import Cloud
from hrcjax.sim import Fields, Frames, fit_fields, read_fields

few = settings(max_examples=25, deadline=None)
seeds = st.integers(0, 2**31 - 1)
PLACES = 240


def cloud_of(points, dtype=np.float64, places=PLACES):
    """A cloud with room for more points; those that do not exist are anywhere, in between."""
    mask = np.zeros(places, bool)
    mask[np.random.default_rng(0).permutation(places)[: len(points)]] = True
    all_points = np.zeros((places, 3), dtype)
    all_points[mask] = points
    return Cloud(jnp.asarray(all_points), jnp.asarray(mask))


@jax.jit
def others(cloud, x, away):
    cloud = grouped(cloud)
    number = jax.tree.map(lambda v: jnp.asarray(v, x.dtype), FieldParams())
    found = nearest_others(fit(cloud, number), groups_of(cloud), x, away, jnp.asarray(FAR, x.dtype), 2)
    return [(one.some, one.distance, one.offset) for one in found]


def people(rng, *middles):
    """Cylinders of 17 cm about the middles, sampled at some 7 cm."""
    count = PLACES // len(middles) - 30
    turn, height = rng.uniform(0, 2 * np.pi, count), rng.uniform(-0.6, 0.6, count)
    body = np.column_stack([0.17 * np.cos(turn), 0.17 * np.sin(turn), height])
    return [body + np.array(middle) for middle in middles]


def test_grouping_keeps_all_points_and_brings_neighbours_together(dtype) -> None:
    points = np.concatenate(people(np.random.default_rng(0), (0.9, 0, 0), (-0.9, 0, 0))).astype(dtype)
    cloud = cloud_of(points, dtype)
    after = jax.jit(grouped)(cloud)
    assert after.points.shape[0] % MEMBERS == 0 and after.points.dtype == dtype
    got = np.asarray(after.points)[np.asarray(after.mask)]
    np.testing.assert_array_equal(np.sort(got, axis=0), np.sort(points, axis=0))
    member = np.asarray(after.points).reshape(MEMBERS, -1, 3)
    there = np.asarray(after.mask).reshape(MEMBERS, -1)
    size = [np.linalg.norm(np.ptp(member[there[:, g], g], axis=0)) for g in range(there.shape[1]) if there[:, g].any()]
    assert max(size) < 1.0, "no group has points of both people, who are 1.8 m apart"
    np.testing.assert_allclose(groups_of(after).centre[0], member[there[:, 0], 0].mean(axis=0), rtol=1e-5)


@few
@given(seeds, st.sampled_from([np.float32, np.float64]))
def test_a_person_on_the_other_side_is_limited(seed: int, dtype) -> None:
    """By a surface within 60 degrees of its nearest point, and no farther: to 0.02 %, or that of a group beside it."""
    rng = np.random.default_rng(seed)
    near, far = people(rng, (0.5, 0.1, 0.0), (-0.7, 0.0, 0.1))
    x = rng.uniform(-0.1, 0.1, 3)
    toward = near[np.linalg.norm(near - x, axis=1).argmin()] - x
    away = -toward / np.linalg.norm(toward)
    found = others(cloud_of(np.concatenate([near, far]), dtype), jnp.asarray(x, dtype), jnp.asarray(away, dtype))
    reach = np.linalg.norm(far - x, axis=1)
    way = (x - far[reach.argmin()]) / reach.min()
    numbers = [(float(d), np.asarray(offset, np.float64)) for some, d, offset in found if some]
    assert any(d < 1.02 * reach.min() and way @ offset > 0.5 * d for d, offset in numbers)
    for d, offset in numbers:
        np.testing.assert_allclose(np.linalg.norm(offset), d, rtol=1e-6)


@few
@given(seeds)
def test_it_is_a_point_of_the_cloud_in_another_direction_and_the_next_is_no_nearer(seed: int) -> None:
    """For points anywhere, and nothing in another direction is nearer by more than the size of a group."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.0, 1.0, (rng.integers(1, 150), 3))
    x = rng.uniform(-0.3, 0.3, 3)
    away = rng.normal(size=3)
    away /= np.linalg.norm(away)
    first, second = others(cloud_of(points), jnp.asarray(x), jnp.asarray(away))
    for some, d, offset in (first, second):
        if some:
            np.testing.assert_allclose(np.linalg.norm(points - (x - np.asarray(offset)), axis=1).min(), 0.0, atol=1e-12)
            np.testing.assert_allclose(d, np.linalg.norm(offset))
        else:
            assert d == FAR and not np.any(offset)
    assert first[1] <= second[1] * (1 + 1e-9)


def test_nobody_one_point_and_a_query_on_it(dtype) -> None:
    x, away = jnp.zeros(3, dtype), jnp.asarray([1.0, 0, 0], dtype)
    for some, d, offset in others(cloud_of(np.zeros((0, 3)), dtype), x, away):
        assert not some and d == FAR and not np.any(offset)
    cloud = cloud_of(np.array([[0.4, 0.0, 0.0]]), dtype)
    (some, d, offset), (another, *_) = others(cloud, x, away)
    assert some and not another
    np.testing.assert_allclose((d, *offset), (0.4, -0.4, 0, 0), rtol=1e-6)
    slope = jax.jit(jax.grad(lambda x: others(cloud, x, away)[0][1]))
    np.testing.assert_allclose(slope(x), [-1, 0, 0], rtol=1e-6)
    assert bool(jnp.isfinite(slope(jnp.asarray([0.4, 0, 0], dtype))).all())


def wall(x, half=0.3, step=0.05):
    at = np.arange(-half, half + 1e-9, step)
    y, z = np.meshgrid(at, at)
    return np.column_stack([np.full(y.size, x), y.ravel(), z.ravel()])


@pytest.fixture(scope="module")
def between_walls():
    """A reading between two walls of people, 0.30 m and 0.36 m away."""
    points = np.concatenate([wall(0.30), wall(-0.36)])
    layout = GridLayout((-1.0, -1.0, -1.0), (5, 5, 5), 0.5)
    frames = Frames(
        scene=fit_grid(layout, jnp.full(layout.shape, 5.0)),
        moving=jax.tree.map(lambda a: a[None], cloud_of(points, places=576)),
        beyond=jnp.full(1, 10.0), stamp=jnp.zeros(1), camera=jnp.zeros(1, int), valid=jnp.ones(1, bool),
        reasons=jnp.zeros((1, 1), int), guarded=jnp.zeros(1, bool), static_overflow=jnp.asarray(False),
    )  # fmt: skip

    @jax.jit
    def read(x, beyond):
        changed = eqx.tree_at(lambda f: f.beyond, frames, beyond[None])
        fields = fit_fields(FieldParams(), changed)
        return read_fields(FieldParams(), Fields(fields.static, jax.tree.map(lambda a: a[0], fields.moving)), x)

    return read


def test_two_people_on_both_sides_limit_both_ways(between_walls) -> None:
    """The reading names both, and the governor holds 1 m/s towards the second, which the nearest alone would let pass."""
    seen = between_walls(jnp.zeros(3), jnp.asarray(10.0))
    np.testing.assert_allclose(seen.person_gradient[:2], [[-1, 0, 0], [1, 0, 0]], atol=0.02)
    assert 0.22 < seen.person_distance[0] < 0.30 - 0.035 + 1e-9
    np.testing.assert_allclose(seen.person_distance[1], 0.36 - 0.035, atol=1e-4)
    assert seen.person_distance[2] > seen.person_distance[1]
    governed = jax.jit(safety.governed)
    J, g = jnp.eye(3)[None], seen.person_gradient[None]
    limit = jnp.where(seen.person_distance < 0.34, 0.05, 0.5)[None]
    towards_second = jnp.asarray([-1.0, 0.0, 0.0])
    np.testing.assert_array_equal(governed(towards_second, J, g[:, :1], limit[:, :1]), towards_second)
    np.testing.assert_allclose(governed(towards_second, J, g, limit), [-0.05, 0, 0], atol=0.01)


def test_whoever_is_nearer_without_a_point_leaves_the_points_to_the_other_surfaces(between_walls) -> None:
    """At (0.05, 0, 0) somebody may be 5 cm farther out: surface 0. The wall on the other side is one of the others."""
    x = jnp.asarray([0.05, 0.0, 0.0])
    seen = between_walls(x, jnp.asarray(0.1))
    np.testing.assert_allclose(seen.person_distance[0], 0.05, atol=1e-6)
    assert np.isclose(seen.person_distance[1:], 0.41 - 0.035, atol=1e-4).any()


def with_hand(angle: float, reach: float = 0.32, before: float = 0.30):
    """A wall of people `before` x = 0 in metres, and a hand in a direction `angle` degrees from its normal, `reach` away."""
    rng = np.random.default_rng(0)
    turn = np.deg2rad(angle)
    hand = reach * np.array([np.cos(turn), np.sin(turn), 0.0]) + rng.uniform(-0.01, 0.01, (20, 3))
    return np.concatenate([wall(before), hand])


@pytest.mark.parametrize("angle", [40.0, 48.0, 55.0])
def test_a_hand_before_a_trunk_limits_motion_towards_it(angle: float) -> None:
    """Less than 60 degrees from the trunk, and as near: sliding along the trunk ends at the hand, which the trunk's limit does not see."""
    points, toward = with_hand(angle), np.array([np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle)), 0.0])
    x, away = jnp.zeros(3), jnp.asarray([-1.0, 0.0, 0.0])
    (some, d, offset), _ = others(cloud_of(points, places=400), x, away)
    assert bool(some) and float(d) < 0.02 + np.linalg.norm(points[-20:], axis=1).min()
    assert -np.asarray(offset) @ toward > 0.98 * float(d), "the hand, or a part of its group"
    g = jnp.stack([away, jnp.asarray(offset) / d])[None]
    slide = jnp.asarray([0.0, 0.2, 0.0])
    governed = jax.jit(safety.governed)
    np.testing.assert_allclose(governed(slide, jnp.eye(3)[None], g[:, :1], jnp.zeros((1, 1))), slide, atol=0.003)
    assert (
        toward @ np.asarray(governed(slide, jnp.eye(3)[None], g, jnp.zeros((1, 2))))
        < 0.03
        < 0.5 * toward @ np.asarray(slide)
    )


@few
@given(seeds)
def test_no_other_part_of_a_ball_is_in_front(seed: int) -> None:
    """All its groups within 60 degrees of its nearest point belong to that surface: a part that is none takes no place of one."""
    rng = np.random.default_rng(seed)
    x, radius = rng.uniform(-0.2, 0.2, 3), rng.uniform(0.1, 0.6)
    middle = rng.normal(size=3)
    middle *= (radius + rng.uniform(0.05, 0.5)) / np.linalg.norm(middle)
    ball = rng.normal(size=(200, 3))
    body = x + middle + radius * ball / np.linalg.norm(ball, axis=1)[:, None]
    away, reach = -middle / np.linalg.norm(middle), np.linalg.norm(middle) - radius
    groups = groups_of(grouped(cloud_of(body)))
    found = np.asarray(another(groups, jnp.asarray(x), jnp.asarray(away), jnp.asarray(reach)))
    way = x - np.asarray(groups.centre)
    there = np.asarray(groups.some)
    np.testing.assert_array_equal(found[there], (way @ away <= 0.5 * np.linalg.norm(way, axis=1))[there])


def test_a_plane_without_points_counts_as_a_nearer_surface(between_walls) -> None:
    """Somebody may be from 0.1 m on, outwards: the wall at 0.30 m is behind, in the same direction, and is no surface of its own."""
    seen = between_walls(jnp.asarray([0.05, 0.0, 0.0]), jnp.asarray(0.1))
    toward = -np.asarray(seen.person_gradient)[1:, 0]
    assert not np.any((toward > 0.5) & (np.asarray(seen.person_distance)[1:] < 0.3))


@pytest.mark.parametrize("angle", [35.0, 45.0, 55.0])
def test_two_hands_that_are_equally_near_are_both_read(angle: float) -> None:
    """The direction of the kernel is between both: none of them is the nearest surface."""
    turn, rng = np.deg2rad(angle), np.random.default_rng(1)
    hands = [
        0.3 * np.array([np.cos(turn), side * np.sin(turn), 0.0]) + rng.uniform(-0.01, 0.01, (20, 3)) for side in (1, -1)
    ]
    x, away = jnp.zeros(3), jnp.asarray([-1.0, 0.0, 0.0])
    found = others(cloud_of(np.concatenate(hands), places=64), x, away)
    sides = sorted(float(-offset[1]) for some, _, offset in found if some)
    assert len(sides) == 2 and sides[0] < -0.9 * 0.3 * np.sin(turn) and sides[1] > 0.9 * 0.3 * np.sin(turn)
