"""A small map, and one compiled program that takes a frame into it."""

import jax
import pytest

from hrcjax.map import MapLayout, MapParams, fuse, make_view

LAYOUT = MapLayout(lower=(-0.6, -0.6, -0.2), shape=(12, 12, 8), capacity=512, seen=512, born=512, refitted=512)
PARAMS = MapParams()


@pytest.fixture(scope="session")
def layout() -> MapLayout:
    return LAYOUT


@pytest.fixture(scope="session")
def program():
    """(map, camera, depth image) -> map and report after the frame."""
    return jax.jit(
        lambda state, camera, depth: fuse(LAYOUT, PARAMS, state, camera, make_view(camera, depth, PARAMS.pixel_noise))
    )


@pytest.fixture(scope="session")
def points_program():
    """(map, camera, view) -> map and report: points at hand instead of an image."""
    return jax.jit(lambda state, camera, view: fuse(LAYOUT, PARAMS, state, camera, view))
