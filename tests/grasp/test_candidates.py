"""Grasps on exact boxes and balls: where they are, what they keep away from, how they move with the object."""

import dataclasses
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from surfaces import box, sphere

from hrcjax.geom.rotation import rotation_rpy
from hrcjax.geom.shape import box_distance, sphere_distance
from hrcjax.grasp.approach import body_clearance, gripper_axes
from hrcjax.grasp.candidates import Grasps, best_pairs, grasp_candidates
from hrcjax.grasp.contacts import Contacts
from hrcjax.grasp.gripper import Gripper
from hrcjax.grasp.params import GraspParams
from hrcjax.typing import DistanceFn

GRIPPER, PARAMS = Gripper(), GraspParams()
HALF = (0.02, 0.05, 0.03)
CENTRE = jnp.asarray([0.0, 0.0, HALF[2]])
UP = jnp.asarray([0.0, 0.0, 1.0])


def exact_contacts(points, normals, shift=0.0) -> Contacts:
    count = len(points)
    return Contacts(
        jnp.asarray(points + np.asarray(CENTRE) + shift), jnp.asarray(normals), jnp.ones(count), jnp.ones(count, bool)
    )


def on_table(x, half=HALF):
    return jnp.minimum(box_distance(x, CENTRE, jnp.asarray(half)), x[2])


def search(found: Contacts, clearance: DistanceFn, centre=CENTRE, up=UP, params=PARAMS) -> Grasps:
    return grasp_candidates(found, centre, clearance, GRIPPER, params, up, 48, 32)


@pytest.fixture(scope="module")
def on_box() -> Grasps:
    return jax.jit(partial(search, clearance=on_table))(exact_contacts(*box(HALF, 0.01)))


def test_grasps_close_across_the_narrow_side(on_box: Grasps) -> None:
    mask = np.asarray(on_box.mask)
    assert mask.sum() > 10
    y = np.abs(np.asarray(on_box.R)[mask][:, 0, 1])  # along x, but for pairs that are not quite opposite
    assert y[0] > 0.999 and (y > np.cos(np.arctan(PARAMS.friction))).all()
    assert np.diff(np.asarray(on_box.score)[mask]).max() <= 0
    assert np.isinf(np.asarray(on_box.score)[~mask]).all()
    np.testing.assert_allclose(np.asarray(on_box.width)[0], 2 * HALF[0], atol=1e-6)
    first = np.asarray(on_box.p)[0]
    assert abs(first[0]) < 1e-6 and abs(first[1]) < 0.011  # in the middle
    R = np.asarray(on_box.R)
    np.testing.assert_allclose(np.swapaxes(R, 1, 2) @ R, np.broadcast_to(np.eye(3), R.shape), atol=1e-6)
    np.testing.assert_allclose(np.linalg.det(R), 1, atol=1e-6)


def test_the_gripper_keeps_off_object_and_table(on_box: Grasps) -> None:
    """By a check of its own: points of the fingers' boxes."""
    grid = np.stack(np.meshgrid(np.linspace(-1, 1, 5), np.linspace(0, 1, 4), np.linspace(0, 1, 12), indexing="ij"), -1).reshape(-1, 3)  # fmt: skip
    for g in np.flatnonzero(on_box.mask)[:8]:
        half = float(on_box.opening[g]) / 2
        x = grid[:, 0] * GRIPPER.pad[0]
        z = GRIPPER.pad[1] - grid[:, 2] * (GRIPPER.pad[1] + GRIPPER.length)
        for side in (-1, 1):
            local = np.column_stack([x, side * (half + grid[:, 1] * GRIPPER.thickness), z])
            for back in np.linspace(0, PARAMS.approach, 6):
                at = np.asarray(on_box.p[g]) + (local - [0, 0, back]) @ np.asarray(on_box.R[g]).T
                assert float(jnp.min(jax.vmap(on_table)(jnp.asarray(at)))) > 0


def test_wider_than_the_stroke_has_no_grasp() -> None:
    half = (0.045, 0.05, 0.048)
    found = exact_contacts(*box(half, 0.02), shift=np.array([0, 0, half[2] - HALF[2]]))
    assert not np.asarray(jax.jit(partial(search, clearance=lambda x: x[2]))(found).mask).any()


def test_where_a_finger_would_hit_something_there_is_no_grasp() -> None:
    found = exact_contacts(*box(HALF, 0.02))

    def walled(x):
        wall = box_distance(x, jnp.asarray([0.03, 0.0, 0.1]), jnp.asarray([0.005, 0.1, 0.1]))
        return jnp.minimum(on_table(x), wall)

    assert np.asarray(jax.jit(partial(search, clearance=on_table))(found).mask).any()
    free = jax.jit(partial(search, clearance=walled))(found)
    assert not (np.asarray(free.mask) & (np.abs(np.asarray(free.R)[:, 0, 1]) > 0.7)).any()


def test_grasps_move_with_object_and_gravity() -> None:
    points, normals = sphere(0.03, 0.012)
    here = exact_contacts(points, normals)
    R = rotation_rpy(*(jnp.asarray(v) for v in (0.4, -0.7, 1.1)))
    shift = jnp.asarray([0.2, -0.1, 0.3])
    there = Contacts(here.points @ R.T + shift, here.normals @ R.T, here.planarity, here.mask)

    def ball(x):
        return jnp.minimum(sphere_distance(x, CENTRE, 0.03), x[2])

    def moved(x):
        return ball(R.T @ (x - shift))

    one = jax.jit(partial(search, clearance=ball))(here)
    two = jax.jit(partial(search, clearance=moved, centre=R @ CENTRE + shift, up=R @ UP))(there)
    mask = np.asarray(one.mask)
    assert mask.any() and np.array_equal(mask, np.asarray(two.mask))
    np.testing.assert_allclose(one.score[mask], two.score[mask], atol=1e-6)
    np.testing.assert_allclose(np.asarray(one.p)[mask][:1] @ np.asarray(R).T + np.asarray(shift), np.asarray(two.p)[mask][:1], atol=1e-6)  # fmt: skip
    np.testing.assert_allclose(np.asarray(R) @ np.asarray(one.R)[mask][0], np.asarray(two.R)[mask][0], atol=1e-6)


def test_axes_are_finite_for_an_upright_closing_axis() -> None:
    R = np.asarray(gripper_axes(UP, 0.3, UP))
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(R[:, 1], UP)


def test_the_clearance_of_the_body_is_that_of_its_spheres() -> None:
    """Straight down over a table, the tips are lowest."""
    R = gripper_axes(jnp.asarray([1.0, 0, 0]), 0.0, UP)
    np.testing.assert_allclose(np.asarray(R)[:, 2], [0, 0, -1], atol=1e-9)
    room = body_clearance(GRIPPER, R, jnp.asarray([0, 0, 0.1]), 0.05, 0.1, lambda x: x[2])
    assert 0.1 - GRIPPER.pad[1] - 0.0015 < float(room) <= 0.1 - GRIPPER.pad[1]


def test_float32_stays_float32() -> None:
    found = jax.tree.map(lambda a: a.astype(jnp.float32) if a.dtype == float else a, exact_contacts(*box(HALF, 0.03)))
    play = jax.jit(lambda one: grasp_candidates(one, CENTRE.astype(jnp.float32), lambda x: x[2], GRIPPER, PARAMS, None, 8, 4))  # fmt: skip
    one = play(found)
    assert {a.dtype for a in jax.tree.leaves(one)} == {jnp.dtype("float32"), jnp.dtype("int32"), jnp.dtype(bool)}


def test_a_field_that_is_no_number_lets_no_grasp_through() -> None:
    found = exact_contacts(*box(HALF, 0.03))
    assert not np.asarray(jax.jit(partial(search, clearance=lambda x: x[2] * jnp.nan))(found).mask).any()


def few(params=PARAMS, clearance=on_table, planarity=None) -> Grasps:
    found = exact_contacts(*box(HALF, 0.02))
    if planarity is not None:
        found = Contacts(found.points, found.normals, jnp.asarray(planarity(np.asarray(found.points))), found.mask)
    return jax.jit(partial(search, clearance=clearance, params=params))(found)


def test_the_order_of_the_contacts_does_not_matter() -> None:
    """Each finds its best partner, before or after it in the list."""
    chance = np.random.default_rng(0)
    points, normals = box(HALF, 0.01)
    noise = chance.normal(0, 1e-3, points.shape)
    both = []
    for order in (np.arange(len(points)), chance.permutation(len(points))):
        found = exact_contacts((points + noise)[order], normals[order])
        pairs = best_pairs(found, CENTRE, GRIPPER, PARAMS, 64)
        assert len({tuple(sorted(c)) for c in np.asarray(pairs.contact)[np.isfinite(pairs.score)].tolist()}) == np.isfinite(pairs.score).sum()  # fmt: skip
        both.append(np.asarray(pairs.score))
    np.testing.assert_allclose(both[0], both[1], atol=1e-9)


def test_flatter_places_are_preferred() -> None:
    """Where the middle and the cone say nothing, those on the side whose normals are surer."""
    params = dataclasses.replace(PARAMS, weight_centre=0.0, weight_down=0.0)
    one = few(params, planarity=lambda x: np.where(x[:, 1] > 0, 1.0, 0.92))
    assert np.asarray(one.p)[0, 1] > 0
    other = few(params, planarity=lambda x: np.where(x[:, 1] < 0, 1.0, 0.92))
    assert np.asarray(other.p)[0, 1] < 0


def test_steep_approaches_are_preferred_and_flat_ones_refused() -> None:
    down = -np.asarray(few().R)[:, 2, 2][np.asarray(few().mask)]
    assert down[0] > 0.99 and (down >= PARAMS.least_down).all()
    steepest = few(dataclasses.replace(PARAMS, least_down=1.01))
    assert not np.asarray(steepest.mask).any()


def test_what_is_only_in_the_way_of_the_approach_counts() -> None:
    """A plate over the gripper at the grasp, which it passes on its way there."""

    def under_a_plate(x):
        return jnp.minimum(on_table(x), box_distance(x, jnp.asarray([0, 0, 0.14]), jnp.asarray([0.5, 0.5, 0.01])))

    at_once = dataclasses.replace(PARAMS, approach=0.0)
    assert np.asarray(few(params=at_once, clearance=under_a_plate).mask).any()
    assert np.asarray(few().mask).any() and not np.asarray(few(clearance=under_a_plate).mask).any()


def test_the_pads_open_by_the_clearance_as_far_as_the_stroke_goes() -> None:
    one = few(dataclasses.replace(PARAMS, clearance=0.005))
    mask = np.asarray(one.mask)
    np.testing.assert_allclose(np.asarray(one.opening)[mask], np.asarray(one.width)[mask] + 0.01, atol=1e-6)
    wide = few(dataclasses.replace(PARAMS, clearance=0.05))
    np.testing.assert_allclose(np.asarray(wide.opening)[np.asarray(wide.mask)], GRIPPER.stroke, atol=1e-6)
