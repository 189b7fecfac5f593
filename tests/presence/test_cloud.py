"""Points for people: in the voxels of their sets, nearest first, and a bound on whoever has none."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from overhead import EXACT, middles, packed
from scipy.ndimage import binary_dilation, binary_erosion, generate_binary_structure

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.segment import FAR
from hrcjax.presence import cloud as cloud_module
from hrcjax.presence.cloud import COARSE_FROM, presence_cloud
from hrcjax.presence.sight import Sight
from hrcjax.presence.track import Empty, initial_track
from hrcjax.presence.voxels import VoxelLayout, all_voxels

NEAR = VoxelLayout((-0.4, -0.4, 0.0), (8, 8, 8), 0.1)
FAR_BOX = VoxelLayout((0.7, -0.4, 0.0), (12, 8, 8), 0.1)
FACES = generate_binary_structure(3, 1)
PERIOD = jnp.full(2, 0.1)


def robot(*capsules: tuple) -> Capsules:
    """(a, b, radius); by default none."""
    of = capsules or (((0.0, 0.0, -9.0), (0.0, 0.0, -9.0), 0.01),)
    return Capsules(*(jnp.asarray(np.array([c[k] for c in of], float)) for k in range(3)))


def random_people(layout: VoxelLayout, seed: int, share: float = 0.05) -> tuple[np.ndarray, np.ndarray]:
    """Occupied voxels of two cameras (camera x y z), and the sums of points in them (camera x y z 4)."""
    random = np.random.default_rng(seed)
    occupied = random.random((2, *layout.shape)) < share
    count = random.integers(3, 9, occupied.shape) * occupied
    sums = np.zeros((*occupied.shape, 4))
    for k in range(9):
        point = middles(layout) + layout.edge * random.uniform(-0.5, 0.5, (2, *layout.shape, 3))
        there = (k < count)[..., None]
        sums += np.concatenate([there, there * point], axis=-1)
    return occupied, sums


def cloud_of(
    layout: VoxelLayout,
    occupied=None,
    sums=None,
    lost=None,
    before=None,
    capacity=400,
    arm=None,
    stamp=(0.0, 0.0),
    unsure=False,
):
    """The cloud of a track in which these sets are given, watched everywhere; by default nobody, and all is seen before."""
    nothing = np.zeros((2, *layout.shape), bool)
    sets = {"occupied": nothing if occupied is None else occupied, "before": ~nothing if before is None else before}
    track = initial_track(layout, 2, jnp.asarray(0.0))
    for name, grids in sets.items():
        track = eqx.tree_at(lambda t, n=name: getattr(t, n), track, jnp.stack([packed(layout, g) for g in grids]))
    sums = np.zeros((2, layout.count, 4)) if sums is None else sums.reshape(2, -1, 4)
    lost = nothing[0] if lost is None else lost
    track = eqx.tree_at(
        lambda t: (t.sums, t.lost, t.stamp, t.unsure),
        track,
        (jnp.asarray(sums), packed(layout, lost), jnp.asarray(stamp), jnp.asarray(unsure)),
    )
    every, no = all_voxels(layout), jnp.zeros((2, layout.count))
    empty = Empty(jnp.zeros((2, 1, 1)), Sight(no.astype(jnp.int32), no), every)
    program = jax.jit(lambda track, arm: presence_cloud(layout, EXACT, empty, track, PERIOD, arm, capacity))
    return program(track, robot() if arm is None else arm)


def points_of(seen) -> np.ndarray:
    return np.asarray(seen.cloud.points)[np.asarray(seen.cloud.mask)]


def sorted_rows(points: np.ndarray) -> np.ndarray:
    return points[np.lexsort(np.round(points, 9).T)]


def shell_of(lost: np.ndarray, people: np.ndarray, behind: np.ndarray | bool = False) -> np.ndarray:
    hidden = lost | behind
    return hidden & ~binary_erosion(hidden | people, FACES, border_value=True) & ~people


def test_nobody_has_no_points_and_no_bound() -> None:
    seen = cloud_of(NEAR)
    assert len(points_of(seen)) == 0 and float(seen.beyond) == FAR and not bool(seen.lost)
    assert not np.asarray(seen.cloud.points).any()
    assert bool(cloud_of(NEAR, unsure=True).lost)


def test_each_occupied_voxel_has_the_mean_of_its_points_of_all_cameras() -> None:
    occupied, sums = random_people(NEAR, 0)
    seen = cloud_of(NEAR, occupied, sums)
    people, both = occupied.any(axis=0), sums.sum(axis=0)
    assert (occupied.sum(axis=0) == 2).any()
    expected = both[people][:, 1:] / both[people][:, :1]
    np.testing.assert_allclose(sorted_rows(points_of(seen)), sorted_rows(expected), atol=1e-9)
    assert float(seen.beyond) == FAR


def test_hidden_space_has_the_middles_of_its_surface() -> None:
    """Its surface to space that holds nobody; the box's sides are none."""
    lost = np.zeros(NEAR.shape, bool)
    lost[1:6, 2:7, 0:5] = True
    lost[3, 3, 7] = True
    occupied, sums = random_people(NEAR, 1, 0.02)
    seen = cloud_of(NEAR, occupied, sums, lost)
    people, both = occupied.any(axis=0), sums.sum(axis=0)
    shell = shell_of(lost, people)
    assert 0 < shell.sum() < (lost & ~people).sum()
    expected = np.concatenate([both[people][:, 1:] / both[people][:, :1], middles(NEAR)[shell]])
    np.testing.assert_allclose(sorted_rows(points_of(seen)), sorted_rows(expected), atol=1e-9)


def test_the_hidden_side_of_people_is_one_voxel_thick() -> None:
    """Beside a voxel of somebody, where no camera sees before what it measures."""
    occupied = np.zeros((2, *NEAR.shape), bool)
    occupied[0, 4, 4, 4] = True
    sums = np.zeros((2, *NEAR.shape, 4))
    sums[0, 4, 4, 4] = [3.0, *(3.0 * middles(NEAR)[4, 4, 4])]
    before = np.zeros((2, *NEAR.shape), bool)
    before[0, :, :, 5:] = True
    before[1, 5:] = True
    expected = binary_dilation(occupied[0], FACES) & ~before.any(axis=0)
    assert expected.sum() == 5  # itself, one in x, two in y, one below
    seen = cloud_of(NEAR, occupied, sums, before=before)
    np.testing.assert_allclose(sorted_rows(points_of(seen)), sorted_rows(middles(NEAR)[expected]), atol=1e-9)


@pytest.mark.parametrize("capacity", [5, 12, 20])
def test_the_nearest_are_kept_and_whoever_has_none_is_farther_than_said(capacity: int) -> None:
    """Not only the points that are left out: also no corner of their voxels is nearer to the base."""
    occupied, sums = random_people(NEAR, 2, 0.06)
    seen = cloud_of(NEAR, occupied, sums, capacity=capacity)
    kept, every = points_of(seen), points_of(cloud_of(NEAR, occupied, sums))
    far = np.linalg.norm(every, axis=1)
    assert kept.shape == (capacity, 3) and len(every) > capacity and np.all(np.diff(far) >= 0)
    np.testing.assert_allclose(kept, every[:capacity], atol=1e-12)
    left = np.floor((every[capacity:] - np.asarray(NEAR.lower)) / NEAR.edge).astype(int)
    low = np.asarray(NEAR.lower) + NEAR.edge * left
    closest = np.linalg.norm(np.clip(0.0, low, low + NEAR.edge), axis=1)
    assert float(seen.beyond) == pytest.approx(closest.min(), abs=1e-9)
    assert float(seen.beyond) <= far[capacity:].min()


def test_beyond_the_arm_s_reach_eight_voxels_share_a_point() -> None:
    occupied, sums = random_people(FAR_BOX, 3, 0.1)
    lost = np.zeros(FAR_BOX.shape, bool)
    lost[5:11, 1:6, 1:6] = True
    seen = cloud_of(FAR_BOX, occupied, sums, lost)
    people, both = occupied.any(axis=0), sums.sum(axis=0)
    x = middles(FAR_BOX)
    near = (x**2).sum(axis=-1) < COARSE_FROM**2
    shell = shell_of(lost, people)
    assert (people & near).sum() > 5 and (people & ~near).sum() > 5
    expected = list(both[people & near][:, 1:] / both[people & near][:, :1]) + list(x[shell & near])
    for corner in np.ndindex(6, 4, 4):
        cube = tuple(slice(2 * c, 2 * c + 2) for c in corner)
        if not ((people | shell) & ~near)[cube].any():
            continue
        total = both[cube][people[cube]].sum(axis=0)
        low = np.asarray(FAR_BOX.lower) + 0.2 * np.array(corner)
        expected.append(total[1:] / total[0] if total[0] > 0 else low + 0.1)
        assert (expected[-1] >= low).all() and (expected[-1] <= low + 0.2).all()
    np.testing.assert_allclose(sorted_rows(points_of(seen)), sorted_rows(np.array(expected)), atol=1e-9)


def test_the_robot_s_own_space_holds_nobody_but_who_is_measured_there() -> None:
    lost = np.ones(NEAR.shape, bool)
    lost[:, :, 7] = False
    occupied, sums = random_people(NEAR, 4, 0.02)
    a, b, radius = np.array([-0.3, 0.0, 0.65]), np.array([0.2, 0.1, 0.65]), 0.12
    seen = points_of(cloud_of(NEAR, occupied, sums, lost, arm=robot((a, b, radius))))
    people, both = occupied.any(axis=0), sums.sum(axis=0)
    middle = middles(NEAR)[shell_of(lost, people)]
    along = np.clip((middle - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    outside = np.linalg.norm(middle - a - along[:, None] * (b - a), axis=1) > radius
    assert 0 < outside.sum() < len(outside)
    expected = np.concatenate([both[people][:, 1:] / both[people][:, :1], middle[outside]])
    np.testing.assert_allclose(sorted_rows(seen), sorted_rows(expected), atol=1e-9)


def test_a_camera_whose_image_is_too_old_shows_nobody() -> None:
    occupied, sums = random_people(NEAR, 5)
    seen = points_of(cloud_of(NEAR, occupied, sums, stamp=(0.0, -0.2)))
    expected = sums[0][occupied[0]]
    np.testing.assert_allclose(sorted_rows(seen), sorted_rows(expected[:, 1:] / expected[:, :1]), atol=1e-9)


@pytest.mark.parametrize(("layout", "name"), [(NEAR, "NEAR_CANDIDATES"), (FAR_BOX, "FAR_CANDIDATES")])
def test_more_than_can_be_looked_at_bounds_nothing(
    monkeypatch: pytest.MonkeyPatch, layout: VoxelLayout, name: str
) -> None:
    occupied, sums = random_people(layout, 6, 0.3)
    monkeypatch.setattr(cloud_module, name, 20)
    seen = cloud_of(layout, occupied, sums)
    assert float(seen.beyond) == 0.0 and len(points_of(seen)) >= 20
