from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from plan_scenes import GOAL, PRINTED, START, scene

from hrcjax.plan import PlanParams, PlanSizes, PotentialParams, plan
from hrcjax.plan.plan import arch

SIZES = PlanSizes(steps=200, waypoints=32, iterations=12)
NAMES = {
    "k_att": lambda p: p.potential.k_att,
    "k_rep": lambda p: p.potential.k_rep,
    "zeta": lambda p: p.potential.zeta,
    "omega1": lambda p: p.path.omega1,
    "omega2": lambda p: p.path.omega2,
}


def params(dtype=jnp.float64, **changes):
    p = jax.tree.map(lambda x: jnp.asarray(x, dtype), PlanParams())
    for name, value in changes.items():
        p = eqx.tree_at(NAMES[name], p, jnp.asarray(value, dtype))
    return p


def run(p, kind="columns"):
    s = scene(kind, p.path.omega1.dtype)
    lower = jnp.asarray([-0.05, 0.1, 0.02], s.start.dtype)
    upper = jnp.asarray([0.85, 0.85, 0.6], s.start.dtype)
    return plan(p, s.start, s.goal, s.distances, s.radius, lower, upper, SIZES)


columns = jax.jit(run)
many = jax.jit(jax.vmap(run))


def test_columns_reading():
    """Clearance 0: 72.88 cm."""
    result = columns(params(zeta=1.0, omega2=1e-6))
    np.testing.assert_allclose(result.length, 0.7288, atol=1e-4)
    assert int(result.status) == 15


def test_many_settings_at_once_agree_with_one_and_all_say_what_they_are():
    zetas = [1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0]
    batch = jax.tree.map(lambda *x: jnp.stack(x), *[params(zeta=z) for z in zetas])
    result = many(batch)
    assert np.isfinite(result.waypoints).all()
    np.testing.assert_array_equal(result.status, [15] * 6 + [13])
    np.testing.assert_allclose(result.clearance[:6], (np.array(zetas[:6]) - 1) * 0.03, atol=5e-4)
    np.testing.assert_allclose(result.violation[6], 0.21 - 0.15028, atol=1e-4)  # the goal itself is that near to O4
    assert (np.diff(result.length[:6]) > 0).all() and float(result.length[6]) < 1.3
    np.testing.assert_allclose(columns(params(zeta=3.0)).waypoints, result.waypoints[3], atol=1e-8)


def test_gap_too_narrow_between_columns_is_flown_over():
    result = columns(params(zeta=4.0))
    assert float(result.waypoints[:, 2].max()) > 0.27
    assert 0.83 < float(result.length) < 0.87
    assert bool(columns(params(zeta=2.0)).waypoints[:, 2].max() < 0.16)


def test_descent_that_stops_short_is_reported():
    result = columns(params(zeta=2.0, k_att=0.005))
    assert int(result.status) == 14
    np.testing.assert_allclose(result.length, columns(params(zeta=2.0)).length, rtol=2e-3)


def test_single_precision_follows_its_inputs():
    exact, single = columns(params(zeta=2.0)), columns(params(jnp.float32, zeta=2.0))
    assert {x.dtype.name for x in jax.tree.leaves(single)} == {"float32", "bool"}
    np.testing.assert_allclose(single.waypoints, exact.waypoints, atol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "zeta"), [("columns", 2.0), ("spheres", 4.0)])
def test_gradients_equal_finite_differences(kind, zeta):
    def outcome(values, planned=lambda p: run(p, kind)):
        r = planned(eqx.tree_at(lambda p: [get(p) for get in NAMES.values()], params(), [values[n] for n in NAMES]))
        return jnp.stack([r.length, r.bending_energy, r.clearance])

    at = {name: jnp.asarray(x) for name, x in dict(k_att=0.03, k_rep=1e-5, zeta=zeta, omega1=1.0, omega2=0.01).items()}
    reverse = jax.jit(jax.jacrev(outcome))(at)
    value = partial(outcome, planned=columns if kind == "columns" else jax.jit(partial(run, kind=kind)))
    size = np.abs(np.asarray(value(at)))
    for name, x in at.items():
        h = 1e-5 * x
        difference = (value({**at, name: x + h}) - value({**at, name: x - h})) / (2 * h)
        # relative to the derivative or, where it vanishes (the optimum forgets its guess), to value over parameter
        bound = 1e-3 * np.abs(difference) + 1e-5 * size / x
        assert (np.abs(reverse[name] - difference) < bound).all(), (name, reverse[name], difference)
    assert float(reverse["zeta"][0]) > 1e-3 and float(reverse["omega2"][1]) < -1e-3


def test_arch(dtype):
    w = arch(*(jnp.asarray(x, dtype) for x in (START, GOAL, [1, 1, 0.4])), 21)
    assert w.dtype == dtype
    np.testing.assert_allclose(w[0], START, atol=1e-7)
    np.testing.assert_allclose(w[-1], GOAL, atol=1e-7)
    np.testing.assert_allclose(w[:, :2].mean(0), (START + GOAL)[:2] / 2, atol=0.02)
    assert 0.3 < float(w[:, 2].max()) <= 0.4
    free = arch(jnp.zeros(3), jnp.asarray([1.0, 0, 0]), jnp.full(3, jnp.inf), 41)
    np.testing.assert_allclose(free[20], [0.5, 0, 0.5], atol=1e-3)


def test_sizes_are_checked():
    for wrong in ({"steps": 0}, {"waypoints": 3}, {"iterations": -1}):
        with pytest.raises(ValueError, match="accepted"):
            PlanSizes(**wrong)


def test_defaults_are_the_papers():
    p = PotentialParams()
    assert (p.k_att, p.k_rep, p.zeta, p.exponent) == (0.03, 0.1 * 0.01**2, 4.0, 2.0)
    assert PRINTED.shape == (4, 3)
    assert all(type(x) is float for x in jax.tree.leaves(PlanParams()))
