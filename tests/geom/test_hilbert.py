"""The curve: it passes every cell once, from neighbour to neighbour, and cells of a cube within a cube lie together."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.geom.hilbert import hilbert_index


@pytest.mark.parametrize("bits", [1, 2, 4])
def test_it_goes_from_neighbour_to_neighbour_through_all_cells(bits: int) -> None:
    side = np.arange(1 << bits)
    cells = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
    code = np.asarray(jax.jit(hilbert_index, static_argnums=1)(jnp.asarray(cells, jnp.int32), bits))
    np.testing.assert_array_equal(np.sort(code), np.arange(len(cells)))
    steps = np.abs(np.diff(cells[np.argsort(code)], axis=0)).sum(axis=1)
    np.testing.assert_array_equal(steps, 1)
    for level in range(1, bits):
        assert len(set(map(tuple, np.c_[cells >> level, code >> 3 * level].tolist()))) == (1 << bits - level) ** 3
