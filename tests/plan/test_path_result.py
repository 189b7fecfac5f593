from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from plan_scenes import scene

from hrcjax.plan import PlanParams, judge, required_distance


def params(zeta):
    return eqx.tree_at(lambda p: p.potential.zeta, jax.tree.map(jnp.asarray, PlanParams()), jnp.asarray(zeta))


def test_required_distance():
    np.testing.assert_allclose(required_distance(params(4.0), jnp.asarray([0.03, 0.02])), [0.09, 0.06], rtol=1e-12)


def test_judgement_of_a_straight_path():
    s = scene(centers=np.array([[0.5, 0.04, 0.0]]), radius=0.01)
    w = jnp.asarray(np.linspace([0, 0, 0], [1, 0, 0], 11))
    judged = jax.jit(partial(judge, distances=s.distances))
    result = judged(params(3.0), w, radius=s.radius, lower=s.lower, upper=s.upper)
    np.testing.assert_allclose([result.length, result.bending_energy, result.clearance], [1, 0, 0.03], atol=1e-9)
    assert float(result.violation) == 0.0 and int(result.status) == 15
    far = judged(params(4.5), w, radius=s.radius, lower=s.lower, upper=s.upper, reached=jnp.asarray(False))
    np.testing.assert_allclose(far.violation, 0.005, atol=1e-9)
    assert int(far.status) == 12
    out = judged(params(3.0), w, radius=s.radius, lower=s.lower, upper=jnp.asarray([0.99, 1.0, 1.0]))
    assert int(out.status) == 11
