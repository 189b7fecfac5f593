"""Parameters chosen by name: their bounds, starts, vector and the messages where a choice is not accepted."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.cells.named_cell import NamedCell
from hrcjax.lab.errors import UsageError
from hrcjax.lab.parameters import leaf_names
from hrcjax.sim import Params
from hrcjax.tune.chosen import choose

NAMED = NamedCell(None)  # pyright: ignore[reportArgumentType]  # its numbers alone


def chosen(*words: str, frozen: tuple[str, ...] = ()):
    return choose(words, NAMED.params, NAMED.known_aliases(), NAMED.known_domains(), frozen)


def test_names_bounds_and_starts() -> None:
    found = chosen("K_att=0.01:0.2", "zeta", "motion.speed=0.2:1.5:0.7")
    assert found.names == ("potential.k_att", "potential.zeta", "motion.speed")
    assert [(b.low, b.high) for b in found.bounds] == [(0.01, 0.2), (1.0, 10.0), (0.2, 1.5)]
    assert found.starts == (Params().potential.k_att, Params().potential.zeta, 0.7)
    values = found.values(jnp.asarray(found.start()))
    np.testing.assert_allclose(values, found.starts, rtol=1e-12)


def test_a_group_less_the_frozen_ones() -> None:
    every = [name for name in leaf_names(Params()) if name.startswith("policy.target.")]
    assert chosen("policy.target").names == tuple(every)
    less = chosen("policy.target", frozen=("policy.target.eps", "policy.target.ramp")).names
    assert set(every) - set(less) == {"policy.target.eps", "policy.target.ramp"}


def test_params_of_a_vector() -> None:
    found = chosen("K_att", "zeta")
    vector = jnp.asarray(found.start(), jnp.float32) + 0.3
    params = found.params(Params(), vector)
    assert all(leaf.dtype == jnp.float32 for leaf in jax.tree.leaves(params))
    other, base = leaf_names(params), leaf_names(Params())
    assert {name for name in base if not np.isclose(base[name], other[name], rtol=1e-6)} == set(found.names)
    slope = jax.grad(lambda v: found.params(Params(), v).potential.zeta)(vector)
    assert slope[0] == 0 and slope[1] > 0


def test_other_starts_lie_between_the_bounds_and_differ() -> None:
    found = chosen("K_rep=1e-6:1e-3", "policy.target.kp")
    vector = jnp.asarray(found.start())
    drawn = np.stack([found.values(found.drawn(jax.random.key(k), vector, 0.3)) for k in range(200)])
    shares = np.log(drawn[:, 0] / 1e-6) / np.log(1e3)
    assert shares.min() > 0.019 and shares.max() < 0.981
    np.testing.assert_allclose(np.quantile(shares, [0.25, 0.5, 0.75]), [0.26, 0.5, 0.74], atol=0.12)
    assert np.std(np.log(drawn[:, 1])) == pytest.approx(0.3, rel=0.25)


@pytest.mark.parametrize(
    ("words", "frozen", "message"),
    [
        (("K_at",), (), "close: "),
        (("K_att", "potential.k_att"), (), "chosen twice"),
        (("K_att=1",), (), "NAME=LOW:HIGH"),
        (("K_att=0.2:0.1",), (), "LOW < HIGH"),
        (("K_att=a:b",), (), "NAME=LOW:HIGH"),
        (("K_att=0.1:nan",), (), "NAME=LOW:HIGH"),
        (("K_att=0.1:20",), (), "bounds within 0.0001:1"),
        (("K_att=0.5:0.9",), (), "potential.k_att starts at"),
        (("motion.surface_margin",), (), "motion.surface_margin starts at 0"),
        (("zeta",), ("zeta",), "no parameter is left"),
    ],
)
def test_messages(words, frozen, message) -> None:
    with pytest.raises(UsageError, match=message):
        chosen(*words, frozen=frozen)
