"""Bits of reasons and their words."""

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.bits import pack, words

MEANINGS = {1: "hot", 4: "wet", 2: "late"}


def test_pack_sets_the_bits_that_hold():
    assert int(pack({1: True, 2: jnp.asarray(False), 4: jnp.asarray(True)})) == 5
    assert pack({}).dtype == jnp.int32 and int(pack({})) == 0
    batch = jax.jit(lambda hot: pack({1: hot, 4: True}))(jnp.asarray([True, False]))
    np.testing.assert_array_equal(batch, [5, 4])


def test_words_in_the_order_of_the_table():
    assert words(MEANINGS, 0) == "none"
    assert words(MEANINGS, 7) == "hot; wet; late"
    assert words(MEANINGS, np.int32(2)) == "late"


def test_a_bit_without_words_is_not_hidden():
    assert words(MEANINGS, 16) == "unknown bits 16"
    assert words(MEANINGS, 1 | 16) == "hot; unknown bits 16"
