"""Gaps of an arm and their slopes: against MuJoCo's distances, the planner's other model of the arm, and finite differences."""

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.segment import capsules_distances
from hrcjax.plan import arm_body
from hrcjax.plan.body import self_pairs
from hrcjax.plan.contacts import contacts
from hrcjax.plan.link_model import link_model
from hrcjax.plan.rounded_boxes import RoundedBoxes, least_distance
from hrcjax.robot import arm_capsules, load_arm

ARM = load_arm("ur5")
MODEL = link_model(ARM, 0.01, floor=0.0)
Q = jnp.asarray(np.random.default_rng(0).uniform(-2, 2, (12, 6)), jnp.float32)
SOLIDS = RoundedBoxes(
    jnp.asarray([[0.4, 0.1, 0.5], [-0.3, 0.4, 0.4], [0.0, -0.5, 0.3]], jnp.float32),
    jnp.asarray([[0.1, 0.1, 0.2], [0.0, 0.0, 0.0], [0.2, 0.05, 0.1]], jnp.float32),
    jnp.asarray([0.0, 0.1, 0.02], jnp.float32),
)


def test_gaps_are_those_of_the_spheres_and_capsules():
    near, pairs = jax.jit(lambda q: contacts(MODEL, q, SOLIDS))(Q)
    body, spheres = arm_body(ARM, 0.01, floor=0.0), len(MODEL.radii)
    x = jax.vmap(body.places)(Q).points[:, body.still :]
    least = least_distance(SOLIDS, [x[..., k] for k in range(3)]) - jnp.asarray(body.radii[body.still :], jnp.float32)
    np.testing.assert_allclose(
        np.sort(np.asarray(near.gap[:spheres]).T, axis=1), np.sort(np.asarray(least), axis=1), atol=5e-5
    )
    capsules = jax.vmap(lambda q: arm_capsules(ARM, q))(Q)
    apart = jax.vmap(lambda c: capsules_distances(c, c))(capsules)
    i, j = np.asarray(self_pairs(ARM, (("forearm", "wrist 2"),))).T
    radii = ARM.capsule_radii[i] + ARM.capsule_radii[j]
    mine, true = np.asarray(pairs.gap).T + radii, np.asarray(apart)[:, i, j] + radii
    np.testing.assert_allclose(mine, true, atol=2e-5)


def test_slopes_are_the_derivatives():
    f = jax.jit(lambda q: contacts(MODEL, q, SOLIDS))
    step = 2e-3
    for k in range(2):
        slope, gap = np.asarray(f(Q)[k].slope), np.asarray(f(Q)[k].gap)
        for joint in range(6):
            move = jnp.zeros(6, jnp.float32).at[joint].set(step)
            up, down = (np.asarray(f(Q + sign * move)[k].gap) for sign in (1, -1))
            bent = np.abs(up - 2 * gap + down) > 2e-5  # another obstacle or face is the nearest one: off by 5e-3
            assert bent.mean() < 0.1
            np.testing.assert_allclose(slope[:, joint][~bent], ((up - down) / (2 * step))[~bent], atol=5e-3)
        assert np.abs(slope).max() > 0.3
