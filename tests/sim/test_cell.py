import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.sim import Cell
from hrcjax.sim.cell import newest_frame
from hrcjax.sim.prepare import check_start, posture_at
from hrcjax.world import clutter
from hrcjax.world.scenes import Obstacle, make_scene


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


def test_in_clutter_the_arm_stands_clear_at_start_and_goal(cell: Cell) -> None:
    for seed in (
        *range(12),
        28,
        63,
        88,
        97,
        101,
        128,
        151,
        162,
        3062,
        3917,
        5579,
        5779,
        9677,
        11003,
    ):  # touched with less room
        scene = clutter(seed)
        check_start(cell, scene, posture_at(cell, scene.start))
        check_start(cell, scene, posture_at(cell, scene.goal))


@pytest.mark.parametrize(("x", "touches"), [(0.45, True), (0.9, False)])
def test_a_start_inside_an_obstacle_is_named(cell: Cell, x: float, touches: bool) -> None:
    """A column beside the tool's place, and one far from it."""
    column = Obstacle(1, (x, 0.2, 0.2), (0.06, 0.06, 0.2), 0.0, 0.06)
    scene = make_scene([column], [0.5, 0.2, 0.3], [0.0, 0.6, 0.3], (-1.0, -1.0, 0.0), (1.0, 1.0, 1.0), jnp.float32)
    q = posture_at(cell, scene.start)
    if touches:
        with pytest.raises(ValueError, match=r"at the start the .* of the arm is \d+ mm inside obstacle 1"):
            check_start(cell, scene, q)
    else:
        check_start(cell, scene, q)
