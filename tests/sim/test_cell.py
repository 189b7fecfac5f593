import jax.numpy as jnp
import numpy as np

from hrcjax.sim.cell import newest_frame


def test_the_newest_frame_that_is_old_enough_and_valid():
    stamp = jnp.asarray([0.0, 0.1, 0.2, 0.3])
    valid = jnp.asarray([True, True, False, True])
    index, age = newest_frame(stamp, valid, jnp.asarray([-0.01, 0.0, 0.15, 0.25, 0.35]))
    np.testing.assert_array_equal(index[1:], [0, 1, 1, 3])
    np.testing.assert_allclose(age[1:], [0.0, 0.05, 0.15, 0.05], atol=1e-12)
    assert jnp.isinf(age[0]), "no frame yet: the age must be infinite, so that the arm holds"


def test_no_valid_frame_is_infinitely_old():
    _, age = newest_frame(jnp.asarray([0.0, 0.1]), jnp.asarray([False, False]), jnp.asarray([1.0]))
    assert jnp.isinf(age[0])
