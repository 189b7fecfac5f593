from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.geom.segment import capsules_distances
from hrcjax.plan.arm_task import body_gaps
from hrcjax.plan.body import arm_body, cover, point_body, self_pairs
from hrcjax.robot import arm_capsules, load_arm, with_tool

ARM = load_arm("ur5")


@pytest.mark.parametrize("inflation", [0.002, 0.005, 0.02])
@pytest.mark.parametrize("length", [0.0, 0.03, 0.425])
def test_spheres_cover_a_capsule_and_stand_out_by_no_more(inflation, length):
    a, b, radius = np.zeros(3), np.array([length, 0, 0]), 0.05
    centres, wide = cover(a, b, radius, inflation)
    assert radius <= wide <= radius + inflation + 1e-12
    rng = np.random.default_rng(0)
    away = rng.normal(size=(3000, 3))
    surface = rng.uniform(0, 1, (3000, 1)) * (b - a) + radius * away / np.linalg.norm(away, axis=1, keepdims=True)
    apart = np.linalg.norm(surface[:, None] - centres, axis=2).min(axis=1)
    assert (apart <= wide + 1e-9).all()


def test_motion_is_the_derivative_of_places(dtype):
    arm = with_tool(ARM, 0.15, 0.02)
    body = arm_body(arm, 0.02)
    q = jnp.asarray(np.random.default_rng(1).uniform(-2, 2, 6), dtype)
    moved, J = jax.jit(body.motion)(q), jax.jit(jax.jacfwd(body.places))(q)
    at = jax.jit(body.places)(q)
    tight = 1e-12 if dtype == jnp.float64 else 1e-5
    for mine, true in ((moved.points, at.points), (moved.J, J.points), (moved.tool, at.tool), (moved.J_tool, J.tool)):
        assert mine.dtype == dtype
        np.testing.assert_allclose(mine, true, atol=tight)
    assert not np.abs(moved.J[: body.still]).max() > 0.01 and np.asarray(moved.J[body.still :]).any(axis=(1, 2)).all()
    assert len(body.radii) == len(moved.points) == body.still + len(body.weights)


def test_weights_are_the_length_of_link_whatever_the_number_of_spheres():
    few, many = arm_body(ARM, 0.03), arm_body(ARM, 0.002)
    assert len(many.weights) > 2 * len(few.weights)
    lengths = np.linalg.norm(ARM.capsule_b - ARM.capsule_a, axis=1) + 2 * ARM.capsule_radii
    moving = lengths[2:].sum() / 0.1  # and half of the shoulder, whose other half lies on the axis it turns about
    for body in (few, many):
        np.testing.assert_allclose(body.weights.sum(), moving + lengths[1] / 0.1 * 0.6, atol=0.5)


def test_gaps_between_spheres_are_those_of_the_capsules():
    """Exact distances of the capsules: spheres on their axes are nearer to each other nowhere, and hardly farther."""
    body = arm_body(ARM, 0.001)
    pairs = np.array(self_pairs(ARM, (("forearm", "wrist 2"),)))
    q = jnp.asarray(np.random.default_rng(2).uniform(-3, 3, (60, 6)))

    @jax.jit
    def both(q):
        at = jax.vmap(body.places, out_axes=-1)(q)
        gaps = body_gaps(body, at.points, at.tool, jnp.zeros((len(body.weights), 1, 60)), jnp.zeros(3), jnp.ones(3))
        capsules = jax.vmap(lambda q: arm_capsules(ARM, q))(q)
        return jnp.min(gaps.spheres, axis=(0, 1)), jax.vmap(capsules_distances)(capsules, capsules)

    mine, exact = both(q)
    exact = np.asarray(exact)[:, pairs[:, 0], pairs[:, 1]].min(axis=1)
    near = np.abs(exact) < 0.03
    assert near.sum() > 5
    assert (mine[near] >= exact[near] - 1e-9).all()
    np.testing.assert_allclose(mine[near], exact[near], atol=0.008)
    assert ((np.asarray(mine) < 0) <= (exact < 1e-9)).all()


def test_named_pairs_may_overlap():
    pairs = self_pairs(ARM)
    names = {(ARM.capsule_names[i], ARM.capsule_names[j]) for i, j in pairs}
    assert ("forearm", "wrist 2") in names and ("base", "upper arm") not in names
    assert len(self_pairs(ARM, (("wrist 2", "forearm"),))) == len(pairs) - 1
    assert arm_body(replace(ARM, capsule_links=(0,) * 8)).pairs.rows == 0


def test_a_point_is_a_body():
    body = point_body()
    q = jnp.asarray([0.1, 0.2, 0.3])
    np.testing.assert_array_equal(body.places(q).points, q[None])
    np.testing.assert_array_equal(body.motion(q).J[0], np.eye(3))
    assert body.size == 3 and body.radii[0] == 0
