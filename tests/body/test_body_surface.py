"""Distances to a body against plain geometry, and their slopes against automatic differentiation."""

import jax
import jax.numpy as jnp
import numpy as np
from standing import gaps, person_of, pose, surface_points

from hrcjax.body.least_squares import PART_UNKNOWNS, Problem, cost, inverse_spd, joined, normal_equations, split
from hrcjax.body.params import BodyParams
from hrcjax.body.priors import Landmarks, landmark_residuals, prior_residuals, prior_slopes
from hrcjax.body.skeleton import PARTS, USUAL_LENGTHS, USUAL_RADII, joints_of, part_capsules
from hrcjax.body.state import KNOWN, PLACES
from hrcjax.body.surface import distance_slopes, nearest_parts
from hrcjax.geom.cloud import Cloud
from hrcjax.geom.shape import capsule_point_distance


def test_the_parts_are_the_capsules_of_the_projects_people() -> None:
    body = pose()
    parts = part_capsules(joints_of(person_of(body))[0], jnp.asarray(USUAL_RADII))
    for name in ("a", "b", "radius"):
        np.testing.assert_allclose(getattr(parts, name), getattr(body, name)[: len(PARTS)], atol=1e-6)


def test_distances_are_those_of_plain_geometry() -> None:
    body = pose()
    points = surface_points(body) + np.random.default_rng(1).normal(0, 0.05, (320, 3))
    joints = joints_of(person_of(body))[0]
    near = nearest_parts(joints, jnp.asarray(USUAL_RADII), jnp.asarray(points, joints.dtype))
    expected = gaps(points, body)[:, :10]
    np.testing.assert_allclose(near.distance, expected.min(1), atol=1e-5)
    assert (np.asarray(near.part) == expected.argmin(1)).mean() > 0.99


def test_slopes_are_those_of_automatic_differentiation() -> None:
    body = pose()
    joints, radii = joints_of(person_of(body))[0], jnp.asarray(USUAL_RADII)
    points = jnp.asarray(surface_points(body, 40) + 0.02, joints.dtype)

    def distances(flat: jax.Array, sizes: jax.Array) -> jax.Array:
        parts = part_capsules(flat.reshape(11, 3), sizes)
        each = jax.vmap(jax.vmap(capsule_point_distance, (None, 0, 0, 0)), (0, None, None, None))
        return jnp.min(each(points, parts.a, parts.b, parts.radius), axis=1)

    expected = jnp.concatenate(jax.jacfwd(distances, argnums=(0, 1))(joints.reshape(-1), radii), axis=1)
    near = nearest_parts(joints, radii, points)
    of_unknowns = np.einsum("pi,pik->pk", distance_slopes(near), PART_UNKNOWNS[np.asarray(near.part)])
    found = np.delete(of_unknowns, np.arange(PLACES, KNOWN - len(USUAL_RADII)), axis=1)  # lengths move nothing
    np.testing.assert_allclose(found, expected, atol=2e-5)


def test_the_normal_equations_are_the_slopes_of_the_cost_and_of_its_residuals() -> None:
    params, body, draw = BodyParams(), pose(), np.random.default_rng(3)
    joints = joints_of(person_of(body))[0]
    known = joined(joints, jnp.asarray(USUAL_LENGTHS), jnp.asarray(USUAL_RADII))
    cloud = Cloud(jnp.asarray(surface_points(body, 200) + 0.02, joints.dtype), jnp.arange(200) % 7 > 0)
    landmarks = Landmarks(joints.at[3].set(jnp.nan) + 0.03, jnp.full((11,), 400.0))
    B = draw.normal(size=(KNOWN, KNOWN))
    before = known + jnp.asarray(draw.normal(0, 0.02, KNOWN), known.dtype)
    problem = Problem(cloud, before, jnp.asarray(B @ B.T, known.dtype), jnp.asarray(0.1), landmarks)
    A, g = jax.jit(lambda k: normal_equations(params, problem, k, cost(params, problem, k)[1]))(known)
    slope = jax.jit(jax.grad(lambda k: cost(params, problem, k)[0]))(known)
    np.testing.assert_allclose(g, slope, atol=2e-5 * float(jnp.abs(slope).max()))

    def residuals(k: jax.Array) -> jax.Array:
        near, (joints, lengths, radii) = cost(params, problem, known)[1], split(k)
        capsules = part_capsules(joints, radii)
        each = jax.vmap(jax.vmap(capsule_point_distance, (None, 0, 0, 0)), (0, None, None, None))
        d = each(cloud.points, capsules.a, capsules.b, capsules.radius)[jnp.arange(200), near.part]
        weight = jnp.where(cloud.mask, params.doubt**2 / (near.distance**2 + params.doubt**2), 0.0) / params.point
        priors = prior_residuals(params, joints, lengths, problem.share)
        return jnp.concatenate([d * weight, priors, landmark_residuals(joints, landmarks)])

    J = jax.jit(jax.jacfwd(residuals))(known)
    expected = J.T @ J + problem.information
    np.testing.assert_allclose(A, expected, atol=2e-5 * float(jnp.abs(expected).max()))


def test_a_point_on_an_axis_and_coincident_joints_have_finite_slopes() -> None:
    joints = jnp.zeros((11, 3))
    near = nearest_parts(joints, jnp.asarray(USUAL_RADII), jnp.zeros((2, 3)))
    assert np.isfinite(np.asarray(distance_slopes(near))).all()
    for part in prior_slopes(BodyParams(), joints, jnp.asarray(USUAL_LENGTHS), 0.1):
        assert np.isfinite(np.asarray(part)).all()


def test_a_landmark_that_is_not_given_pulls_nowhere() -> None:
    joints = jnp.ones((11, 3))
    found = Landmarks(jnp.full((11, 3), jnp.nan).at[7].set(1.1), jnp.full((11,), 100.0))
    residuals = np.asarray(landmark_residuals(joints, found)).reshape(11, 3)
    np.testing.assert_allclose(residuals[7], -1.0, rtol=1e-4)
    assert not np.delete(residuals, 7, axis=0).any()


def test_the_inverse_is_numpys() -> None:
    draw = np.random.default_rng(0)
    B = draw.normal(size=(46, 46))
    sizes = 10.0 ** draw.uniform(-2, 2, 46)
    A = (B @ B.T + 5 * np.eye(46)) * sizes[:, None] * sizes
    found = np.asarray(inverse_spd(jnp.asarray(A, jnp.float32)), float)
    expected = np.linalg.inv(A)
    scale = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(found / scale[:, None] / scale, expected / scale[:, None] / scale, atol=2e-4)
