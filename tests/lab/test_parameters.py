"""Leaves of a pytree by their dotted names: listed, looked up, replaced, batched."""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from toy_cell import ToyParams

from hrcjax.lab.errors import UsageError
from hrcjax.lab.parameters import batch_params, leaf_names, numbers_of, resolve, set_leaves

NAMES = leaf_names(ToyParams())
ALIASES = {"k_att": "potential.k_att", "K_rep": "potential.k_rep"}


def test_leaf_names_are_dotted_and_carry_defaults() -> None:
    assert list(NAMES) == [
        "potential.k_att",
        "potential.k_rep",
        "potential.zeta",
        "collision.k_rep",
        "collision.length_scale",
        "field.length_scale",
        "field.speed",
    ]
    assert NAMES["potential.zeta"] == 4.0


def test_leaf_names_leave_out_what_is_not_one_real_number() -> None:
    tree = {"a": 1.0, "b": True, "c": "text", "d": np.zeros(3), "e": [2.0, 3]}
    assert leaf_names(tree) == {"a": 1.0, "e.0": 2.0, "e.1": 3.0}


def test_set_leaves_agrees_with_tree_at() -> None:
    expected = eqx.tree_at(lambda p: p.collision.k_rep, ToyParams(), 7.0)
    assert set_leaves(ToyParams(), {"collision.k_rep": 7.0}) == expected


def test_set_leaves_refuses_unknown_names() -> None:
    with pytest.raises(UsageError, match=r"no parameter 'collision\.zeta'"):
        set_leaves(ToyParams(), {"collision.zeta": 1.0})


def test_batch_has_columns_for_swept_leaves_and_scalars_for_others() -> None:
    batch = batch_params(ToyParams(), {"potential.zeta": np.array([1.5, 2.5])}, jnp.float32)
    assert batch.potential.zeta.tolist() == [1.5, 2.5]
    assert batch.field.speed.shape == () and batch.field.speed == 0.5
    assert all(leaf.dtype == jnp.float32 for leaf in jax.tree.leaves(batch))


@pytest.mark.parametrize(
    ("name", "full"),
    [
        ("potential.k_att", "potential.k_att"),
        ("K_ATT", "potential.k_att"),
        ("K_rep", "potential.k_rep"),  # an alias goes before endings
        ("zeta", "potential.zeta"),
        ("Field.Length_Scale", "field.length_scale"),
    ],
)
def test_names_resolve(name: str, full: str) -> None:
    assert resolve(name, NAMES, ALIASES) == full


def test_numbers_of_a_dataclass() -> None:
    @dataclass
    class Two:
        a: float = 1.5
        b: int = 2

    assert numbers_of(Two(b=3)) == {"a": 1.5, "b": 3.0}
