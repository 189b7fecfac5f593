import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.plan import path_scores


def test_table_viii_to_the_rounding_of_its_bending_energies():
    """78.31, 79.87, 78.64 cm and 0.05, 0.03, 0.03 /cm: 0.5, 0.54, 0.12. A printed 0.03 stands for 0.025 to 0.035."""
    lengths = jnp.asarray([0.7831, 0.7987, 0.7864])
    printed = np.array([0.5, 0.54, 0.12])
    np.testing.assert_allclose(path_scores(lengths, jnp.asarray([5.0, 3.0, 3.0])), [0.5, 0.5, 0.10577], atol=1e-4)
    np.testing.assert_allclose(path_scores(lengths, jnp.asarray([5.0, 3.15, 3.0])), [0.5, 0.5375, 0.10577], atol=1e-4)
    np.testing.assert_allclose(path_scores(lengths, jnp.asarray([5.0, 3.15, 3.0])), printed, atol=0.015)


def test_weights_and_ties(dtype):
    length, bending = jnp.asarray([1, 2, 3], dtype), jnp.asarray([4, 4, 4], dtype)
    score = path_scores(length, bending, 0.2, 0.8)
    assert score.dtype == dtype
    np.testing.assert_allclose(score, [0, 0.1, 0.2], rtol=1e-6)
    np.testing.assert_allclose(path_scores(bending, length, 0.2, 0.8), [0, 0.4, 0.8], rtol=1e-6)
    assert np.isfinite(jax.jacrev(lambda b: path_scores(length, b))(bending)).all()
