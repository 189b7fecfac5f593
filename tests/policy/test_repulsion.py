"""The potential as a leaf: against plain NumPy and the planner's force, graded in its numbers, finite where it could break."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jax.test_util import check_grads

from hrcjax.plan import PotentialParams
from hrcjax.plan.potential import force as planner_force
from hrcjax.policy import RepulsionParams, repulsion
from hrcjax.reference import policy as serial

few = settings(deadline=None, max_examples=40)
leaf = jax.jit(repulsion)
UP, STILL = np.array([0.0, 0, 1]), np.zeros(3)


def at(d, k_rep=1e-5, reach=0.2, fade=1.0, xd=STILL, params=None, dtype=jnp.float64):
    """The leaf of one point above a surface."""
    numbers = (jnp.asarray(v, dtype) for v in (k_rep, reach, fade, d))
    params = jax.tree.map(lambda v: jnp.asarray(v, dtype), RepulsionParams() if params is None else params)
    return leaf(params, *numbers, jnp.asarray(UP, dtype), jnp.asarray(xd, dtype))


def strength(**numbers):
    M, a = at(**numbers)
    return float(M[2, 2] * a[2])


def other(params):
    """The same kind of parameters with every number changed."""
    names = [f.name for f in dataclasses.fields(params)]
    return dataclasses.replace(params, **{n: getattr(params, n) * (0.9 - 0.05 * i) for i, n in enumerate(names)})


@few
@given(
    st.floats(-0.1, 0.6), st.just(0.0) | st.floats(1e-9, 0.5), st.floats(1e-6, 1e-3), st.floats(0, 2), st.lists(st.floats(-2, 2), min_size=6, max_size=6)
)  # fmt: skip
def test_agrees_with_numpy(d, reach, k_rep, fade, numbers):
    g, xd = np.array(numbers[:3]), np.array(numbers[3:])
    for params in (RepulsionParams(), other(RepulsionParams())):
        ours = leaf(params, *(jnp.asarray(v, jnp.float64) for v in (k_rep, reach, fade, d, g, xd)))
        for one, another in zip(ours, serial.repulsion(params, k_rep, reach, fade, d, g, xd), strict=True):
            np.testing.assert_allclose(one, another, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("d", [-0.01, 0.002, 0.03, 0.1, 0.19, 0.25])
def test_the_speed_asked_for_is_that_of_the_planner(d):
    """Its displacement of one step beside a sphere, without attraction, times the steps of a second; with no bound on the speed."""
    p = PotentialParams(k_att=0.0, k_rep=1e-5, zeta=4.0)
    goal, q = jnp.asarray([0.5, 0.0, 0.05 + d]), jnp.asarray([0.0, 0.0, 0.05 + d])
    step = planner_force(p, q, goal, lambda x: jnp.linalg.norm(x)[None] - 0.05, jnp.asarray([0.05]), scaled=False)
    unbounded = dataclasses.replace(RepulsionParams(), speed_max=1e15, gain=1.0)
    _, a = at(d, p.k_rep, reach=4 * 0.05, params=unbounded)
    np.testing.assert_allclose(a[2], 30 * step[2], rtol=1e-6, atol=1e-15)


def test_it_is_graded_in_every_number():
    """Nearer, stronger, wider, less faded: more; over three decades of K_rep, and not by a switch."""
    d = np.linspace(0.01, 0.3, 30)
    strengths = np.array([[strength(d=one, k_rep=k, reach=0.35) for one in d] for k in (1e-6, 1e-5, 1e-4, 1e-3)])
    assert (np.diff(strengths, axis=1) < 0).all() and (np.diff(strengths, axis=0) > 0).all()
    half = [d[np.argmin(np.abs(row - strengths.max() / 3))] for row in strengths]
    assert (np.diff(half) > 0.02).all(), f"each decade of K_rep must reach farther: {half}"
    wide = [strength(d=0.04, reach=reach) for reach in (0.05, 0.1, 0.2, 0.5)]
    assert (np.diff(wide) > 0).all() and wide[0] < 0.2 * wide[-1]
    assert strength(d=0.1, fade=0.1) < 0.5 * strength(d=0.1)


def test_off_beyond_the_reach_at_the_goal_and_without_k_rep(dtype):
    for numbers in (
        {"d": 0.21},
        {"d": 0.1, "fade": 0.0},
        {"d": 0.1, "k_rep": 0.0},
        {"d": 0.1, "reach": 0.0},
        {"d": -0.1, "reach": 0.0},
    ):
        M, a = at(**numbers, xd=np.array([0.3, 0, -0.2]), dtype=dtype)
        np.testing.assert_array_equal(M, 0.0)
        assert bool(jnp.isfinite(a).all()) and M.dtype == a.dtype == dtype


def test_an_approach_is_damped_and_a_retreat_is_not():
    still = float(at(0.05)[1][2])
    assert float(at(0.05, xd=np.array([0, 0, -1.0]))[1][2]) > still + 5
    np.testing.assert_allclose(at(0.05, xd=np.array([0.7, -0.2, 1.0]))[1], [0, 0, still])


@pytest.mark.parametrize("d", [-0.1, 0.0, 0.004999, 0.1, 0.2 - 1e-7, 0.3])
@pytest.mark.parametrize("xd", [(0, 0, 0), (0.2, 0.1, -0.5), (0, 0, 0.5)])
def test_derivatives(d, xd):
    params = jax.tree.map(jnp.asarray, RepulsionParams())

    def f(params, k_rep, reach, fade, d, xd):
        M, a = repulsion(params, 1e-5 * k_rep, reach, fade, d, jnp.asarray(UP), xd)
        return M, a

    here = (params, *map(jnp.asarray, (1.0, 0.2, 1.0, d, np.array(xd, float))))
    check_grads(jax.jit(f), here, 1, modes=["rev"], eps=1e-7, atol=1e-3, rtol=1e-3)
    for zero in (
        (params, *map(jnp.asarray, (0.0, 0.2, 0.0, d, STILL))),
        (params, *map(jnp.asarray, (1.0, 0.0, 1.0, d, STILL))),
    ):
        assert all(
            bool(jnp.isfinite(v).all()) for v in jax.tree.leaves(jax.jacrev(f, argnums=(0, 1, 2, 3, 4, 5))(*zero))
        )
