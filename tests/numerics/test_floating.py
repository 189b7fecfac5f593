"""Integers are refused by name where they would be taken for numbers of the method, as users call it: unchecked."""

import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import config

from hrcjax.field import FieldParams, convex_bias, fit, fit_exact, lower_bound
from hrcjax.geom.bending_energy import bending_energy
from hrcjax.geom.cloud import Cloud
from hrcjax.geom.resample import resample_path
from hrcjax.map import (
    MapLayout,
    cloud_camera,
    distance_bound,
    empty_map,
    make_view,
    map_distance,
    map_distance_and_gradient,
    map_distances_and_gradients,
    view_from_cloud,
)
from hrcjax.numerics import require_floating
from hrcjax.plan import PotentialParams, path_curve, potential, potential_path
from hrcjax.sense.points import deproject
from hrcjax.sense.thin import thin

LAYOUT = MapLayout(lower=(0.0, 0.0, 0.0), shape=(4, 4, 4), capacity=8)
POINTS = np.arange(12, dtype=np.int32).reshape(4, 3)


def cloud():
    return Cloud(jnp.asarray(POINTS), jnp.ones(4, bool))


IMAGE = jnp.full((64, 64), 2, jnp.int32)
X = jnp.asarray([1, 0, 0], jnp.int32)


def camera():
    return cloud_camera(jnp.eye(3, dtype=jnp.float32), jnp.zeros(3, jnp.float32), 16)


def far(x):
    return jnp.full((1,), 9.0, jnp.float32)


CALLS = {
    "fit": lambda: fit(cloud(), FieldParams()),
    "fit_exact": lambda: fit_exact(cloud(), FieldParams()),
    "convex_bias": lambda: convex_bias(jnp.asarray(1), 0.1, 0.03),
    "lower_bound": lambda: lower_bound(jnp.asarray(1), 0.1, 0.03),
    "map_distance": lambda: map_distance(LAYOUT, empty_map(LAYOUT).levels, 0.7, X),
    "map_distance_and_gradient": lambda: map_distance_and_gradient(LAYOUT, empty_map(LAYOUT).levels, 0.7, X),
    "map_distances_and_gradients": lambda: map_distances_and_gradients(LAYOUT, empty_map(LAYOUT).levels, 0.7, X[None]),
    "distance_bound": lambda: distance_bound(LAYOUT, empty_map(LAYOUT), 0.7, X),
    "make_view": lambda: make_view(camera(), IMAGE, 1e-3),
    "view_from_cloud": lambda: view_from_cloud(camera(), cloud().points, cloud().mask, 1e-3),
    "deproject": lambda: deproject(camera(), IMAGE),
    "thin": lambda: thin(cloud(), 0.1, 2, jnp.zeros(3)),
    "potential": lambda: potential(PotentialParams(), X, X, far, jnp.ones(1)),
    "potential_path": lambda: potential_path(PotentialParams(), X, X, far, jnp.ones(1), 3),
    "path_curve": lambda: path_curve(cloud().points),
    "bending_energy": lambda: bending_energy(cloud().points),
    "resample_path": lambda: resample_path(cloud().points, 3),
}


@pytest.mark.parametrize("name", CALLS)
def test_integers_are_refused(name) -> None:
    before = config.jaxtyping_disable
    config.update("jaxtyping_disable", True)
    try:
        with pytest.raises(ValueError, match=r"is int(32|64); accepted: floating point"):
            CALLS[name]()
    finally:
        config.update("jaxtyping_disable", before)


def test_message_names_function_and_argument() -> None:
    require_floating("f", a=np.float32(1), b=jnp.ones(2), c=0.5)
    with pytest.raises(ValueError, match="f: b is int32"):
        require_floating("f", a=1.0, b=np.arange(3, dtype=np.int32))
