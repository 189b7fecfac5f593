"""Coordinates of parameters with bounds: a round trip, finite slopes, never outside."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import logit

from hrcjax.tune.bounds import Bounds

INF = math.inf
EACH = [
    (Bounds(), (-3.0, 0.0, 7.0)),
    (Bounds(0.0), (1e-6, 0.5, 40.0)),
    (Bounds(-2.0), (-1.5, 0.0, 40.0)),
    (Bounds(-INF, 1.0), (-9.0, 0.999)),
    (Bounds(0.0, 1.0), (1e-6, 0.3, 0.999)),
    (Bounds(-1.0, 3.0), (-0.99, 0.0, 2.9)),
    (Bounds(1e-6, 1e-3), (1.1e-6, 5e-5, 9.9e-4)),
    (Bounds(1.5, 5.0), (1.51, 2.5, 4.9)),
]


@pytest.mark.parametrize(("bounds", "xs"), EACH)
def test_round_trip_and_slope(bounds: Bounds, xs: tuple[float, ...]) -> None:
    for x in xs:
        z = bounds.to_free(jnp.asarray(x, jnp.float64))
        assert float(bounds.from_free(z)) == pytest.approx(x, rel=1e-12)
        slope = float(jax.grad(bounds.from_free)(z))
        assert math.isfinite(slope) and slope > 0
        assert slope * float(jax.grad(bounds.to_free)(jnp.asarray(x))) == pytest.approx(1, rel=1e-9)


def test_coordinates_by_another_formula() -> None:
    assert float(Bounds(-1.0, 3.0).to_free(jnp.asarray(0.5))) == pytest.approx(logit(1.5 / 4))
    share = math.log(2e-5 / 1e-6) / math.log(1e3)
    assert float(Bounds(1e-6, 1e-3).to_free(jnp.asarray(2e-5))) == pytest.approx(logit(share))
    assert float(Bounds(0.0).to_free(jnp.asarray(2.0))) == pytest.approx(math.log(2))


@given(st.floats(-1e3, 1e3), st.sampled_from([bounds for bounds, _ in EACH]))
def test_never_outside_whatever_the_coordinate(z: float, bounds: Bounds) -> None:
    for dtype in (jnp.float32, jnp.float64):
        x = bounds.from_free(jnp.asarray(z, dtype))
        low, high = np.asarray([bounds.low, bounds.high], dtype)
        assert x.dtype == dtype and low <= np.asarray(x) <= high


def test_empty_bounds_are_refused() -> None:
    with pytest.raises(ValueError, match="LOW < HIGH"):
        Bounds(1.0, 1.0)
