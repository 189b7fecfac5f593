import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.geom.length import length


def test_broken_line(dtype):
    w = jnp.asarray([[0, 0, 0], [3, 4, 0], [3, 4, 0], [3, 4, 12]], dtype)
    assert length(w).dtype == dtype
    np.testing.assert_allclose(length(w), 17, rtol=1e-6)
    gradient = jax.grad(length)(w)
    assert np.isfinite(gradient).all()
    np.testing.assert_allclose(gradient[0], [-0.6, -0.8, 0], rtol=1e-6)


def test_one_waypoint_is_refused():
    with pytest.raises(ValueError, match="2 or more"):
        length(jnp.zeros((1, 3)))
