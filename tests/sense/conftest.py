"""A camera and a small scene with a person, shared by the tests of this folder."""

import jax.numpy as jnp
import pytest

from hrcjax.geom.capsules import Capsules
from hrcjax.sense.camera import Camera, d435i
from hrcjax.world.motions import reach_in
from hrcjax.world.person import Person
from hrcjax.world.scene import Scene
from hrcjax.world.scenes import robotica


@pytest.fixture(scope="session")
def scene() -> Scene:
    return robotica()


@pytest.fixture(scope="session")
def person(scene: Scene) -> Person:
    return reach_in(scene)


@pytest.fixture(scope="session")
def camera() -> Camera:
    return d435i(jnp.asarray([1.4, 0.15, 1.3], jnp.float32), jnp.asarray([0.4, 0.5, 0.1], jnp.float32), decimation=4)


@pytest.fixture(scope="session")
def arm() -> Capsules:
    """An arm folded at the base, away from the path."""
    a = jnp.asarray([[0.0, 0.0, 0.0], [0.0, 0.0, 0.15], [-0.25, 0.0, 0.4]], jnp.float32)
    b = jnp.asarray([[0.0, 0.0, 0.15], [-0.25, 0.0, 0.4], [-0.3, 0.2, 0.2]], jnp.float32)
    return Capsules(a, b, jnp.full((3,), 0.06, jnp.float32))
