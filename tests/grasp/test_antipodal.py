"""The law of two contacts: friction cones, mirror, rigid motion, stroke."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcjax.geom.rotation import rotation_rpy
from hrcjax.grasp.antipodal import Pair, antipodal
from hrcjax.grasp.gripper import Gripper
from hrcjax.grasp.params import GraspParams

GRIPPER, PARAMS = Gripper(), GraspParams()
angles = st.floats(-3.0, 3.0)


def tilted(angle: float) -> np.ndarray:
    return np.array([-np.cos(angle), np.sin(angle), 0.0])


def pair(a, na, b, nb, params: GraspParams = PARAMS) -> Pair:
    return antipodal(*(jnp.asarray(v, float) for v in (a, na, b, nb)), GRIPPER, params)


@pytest.mark.parametrize("friction", [0.2, 0.5, 1.0])
def test_the_edge_of_the_cone_is_the_angle_of_friction(friction: float) -> None:
    params = dataclasses.replace(PARAMS, friction=friction)
    edge = np.arctan(friction)
    for share, holds in ((0.0, True), (0.98, True), (1.02, False), (-0.98, True), (-1.02, False)):
        one = pair([0, 0, 0], tilted(share * edge), [0.05, 0, 0], [1, 0, 0], params)
        assert bool(one.ok) == holds
    np.testing.assert_allclose(pair([0, 0, 0], tilted(0.5 * edge), [0.05, 0, 0], [1, 0, 0], params).cone, 1 - np.tan(0.5 * edge) / friction)  # fmt: skip


def test_normals_that_face_each_other_do_not_hold() -> None:
    """Two fingers inside a gap would have to push outwards."""
    assert not bool(pair([0, 0, 0], [1, 0, 0], [0.05, 0, 0], [-1, 0, 0]).ok)
    assert not bool(pair([0, 0, 0], [-1, 0, 0], [0.05, 0, 0], [-1, 0, 0]).ok)


def test_wider_than_the_stroke_is_refused() -> None:
    widest = GRIPPER.stroke - 2 * PARAMS.least_clearance
    for width, fits in ((widest - 1e-6, True), (widest + 1e-6, False), (0.2, False), (0.001, False), (0.0, False)):
        assert bool(pair([0, 0, 0], [-1, 0, 0], [width, 0, 0], [1, 0, 0]).ok) == fits
    assert np.isfinite(np.asarray(pair([0, 0, 0], [-1, 0, 0], [0, 0, 0], [1, 0, 0]).cone))


@settings(max_examples=25, deadline=None)
@given(angles, angles, angles, angles, angles)
def test_neither_mirror_nor_motion_nor_exchange_changes_it(r: float, p: float, y: float, s: float, t: float) -> None:
    a, na, b, nb = np.array([0.01, 0.02, 0]), tilted(0.2 * s), np.array([0.06, 0.03, 0.01]), -tilted(0.2 * t)
    here = pair(a, na, b, nb)
    R = np.asarray(rotation_rpy(*(jnp.asarray(v, float) for v in (r, p, y))))
    M = R @ np.diag([1.0, -1.0, 1.0])
    shift = np.array([s, t, r])
    for other in (
        pair(R @ a + shift, R @ na, R @ b + shift, R @ nb),
        pair(M @ a + shift, M @ na, M @ b + shift, M @ nb),
        pair(b, nb, a, na),
    ):
        np.testing.assert_allclose(here.cone, other.cone, atol=1e-6)
        np.testing.assert_allclose(here.width, other.width, atol=1e-9)
