"""The arm's shape: capsules against MuJoCo's geoms, the cover of spheres, the tool."""

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from quick import quick_jit

from hrcjax.robot import arm_capsules, arm_table, control_points, load_arm, tool_frame
from hrcjax.robot.body import COVER_MARGIN


def poses(count: int) -> np.ndarray:
    return np.random.default_rng(4).uniform(-np.pi, np.pi, (count, 6))


def test_capsules_against_mujoco(arm, dtype):
    data = mujoco.MjData(arm.model)
    f = quick_jit(lambda q: arm_capsules(arm, q))
    for q in poses(5):
        data.qpos[:] = q
        mujoco.mj_kinematics(arm.model, data)
        capsules = f(jnp.asarray(q, dtype))
        assert capsules.a.dtype == capsules.radius.dtype == dtype
        for i, name in enumerate(arm.capsule_names):
            geom = arm.model.geom(name).id
            half = data.geom_xmat[geom].reshape(3, 3)[:, 2] * arm.model.geom_size[geom, 1]
            ends = {tuple(np.round(data.geom_xpos[geom] + s * half, 5) + 0.0) for s in (-1, 1)}
            ours = {tuple(np.round(np.asarray(e, np.float64), 5) + 0.0) for e in (capsules.a[i], capsules.b[i])}
            np.testing.assert_allclose(sorted(ends), sorted(ours), atol=2e-5)
            np.testing.assert_allclose(capsules.radius[i], arm.model.geom_size[geom, 0], rtol=1e-6)


def surface(a: np.ndarray, b: np.ndarray, r: float) -> np.ndarray:
    """Points all over a capsule."""
    rng = np.random.default_rng(0)
    axis = np.linspace(a, b, 60)
    v = rng.normal(size=(400, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    points = (axis[:, None] + r * v[None]).reshape(-1, 3)
    t = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    away = np.linalg.norm(points - a - t[:, None] * (b - a), axis=1)
    return points[away > r - 1e-4]


def test_spheres_cover_the_capsules(arm):
    """In the stretched arm and others: nothing of the arm sticks out of the spheres by more than the margin."""
    assert COVER_MARGIN <= 0.015
    assert 16 <= len(arm.control_links) <= 20
    for q in (np.zeros(6), arm.home, poses(1)[0]):
        capsules = arm_capsules(arm, jnp.asarray(q))
        centres = np.asarray(control_points(arm, jnp.asarray(q)))
        out, inside = [], []
        for i, name in enumerate(arm.capsule_names):
            if name in ("base", "shoulder"):
                continue
            points = surface(np.asarray(capsules.a[i]), np.asarray(capsules.b[i]), float(capsules.radius[i]))
            gap = np.linalg.norm(points[:, None] - centres[None], axis=2) - arm.control_radii
            out.append(gap.min(axis=1).max())
            inside.append(gap.min())
        assert max(out) < COVER_MARGIN
        # and the spheres are not fat: the capsules come to within 2 cm of the spheres' surfaces, from inside
        for centre, radius, link in zip(centres, arm.control_radii, arm.control_links, strict=True):
            own = [i for i, owner in enumerate(arm.capsule_links) if owner == link]
            slack = []
            for i in own:
                a, b = np.asarray(capsules.a[i]), np.asarray(capsules.b[i])
                t = np.clip((centre - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
                slack.append(np.linalg.norm(centre - a - t * (b - a)) + radius - float(capsules.radius[i]))
            assert min(slack) < 0.0125
            assert min(slack) >= 0


def test_capsules_of_neighbours_overlap(arm):
    """No holes in the arm: each capsule from the upper arm outwards touches the one before."""
    capsules = arm_capsules(arm, jnp.asarray(arm.home))
    for i in range(1, len(arm.capsule_names)):
        a, b = np.linspace(capsules.a[i - 1], capsules.b[i - 1], 200), np.linspace(capsules.a[i], capsules.b[i], 200)
        gap = np.linalg.norm(a[:, None] - b[None], axis=2).min() - float(capsules.radius[i - 1] + capsules.radius[i])
        assert gap < 0, arm.capsule_names[i]


def test_capsules_hold_the_centres_of_mass(arm):
    """The centre of mass of each link is within its capsules, or 4 cm of them: the shape is where the weight is."""
    table = arm_table(arm.variant)
    for link in range(6):
        gaps = []
        for i, owner in enumerate(arm.capsule_links):
            if owner != link:
                continue
            a, b, c = arm.capsule_a[i], arm.capsule_b[i], table.com[link]
            t = np.clip((c - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
            gaps.append(np.linalg.norm(c - a - t * (b - a)) - arm.capsule_radii[i])
        assert min(gaps) < 0, link


def test_flange_is_just_inside(arm):
    """The last sphere holds the flange, and reaches no more than 4 cm past it."""
    R, p = tool_frame(arm, jnp.asarray(arm.home))
    centre = control_points(arm, jnp.asarray(arm.home))[-1]
    beyond = float((centre - p) @ R[:, 2]) + arm.control_radii[-1]
    assert 0 < beyond < 0.04


def test_tool_frame_is_the_site(arm, dtype):
    data = mujoco.MjData(arm.model)
    for q in poses(5):
        data.qpos[:] = q
        mujoco.mj_kinematics(arm.model, data)
        R, p = tool_frame(arm, jnp.asarray(q, dtype))
        np.testing.assert_allclose(p, data.site("tool").xpos, atol=1e-6)
        np.testing.assert_allclose(R, data.site("tool").xmat.reshape(3, 3), atol=2e-6)


def test_tool_offset_is_in_the_axes_of_the_flange(ur5):
    from dataclasses import replace

    q = jnp.asarray(poses(1)[0])
    longer = replace(ur5, tool_offset=np.array([0.01, 0.02, 0.15]))
    R, p = tool_frame(ur5, q)
    R2, p2 = tool_frame(longer, q)
    np.testing.assert_allclose(p2, p + R @ np.array([0.01, 0.02, 0.15]), atol=1e-12)
    np.testing.assert_array_equal(R, R2)


@pytest.mark.parametrize("variant", ["ur5", "ur5e"])
def test_tool_against_an_independent_library(variant):
    library = pytest.importorskip("ur_analytic_ik")
    arm = load_arm(variant)
    for q in poses(20):
        T = getattr(library, variant).forward_kinematics(*q)
        R, p = tool_frame(arm, jnp.asarray(q))
        np.testing.assert_allclose(p, T[:3, 3], atol=1e-9)
        np.testing.assert_allclose(R, T[:3, :3], atol=1e-9)


def test_limits(arm):
    np.testing.assert_allclose(arm.q_max, np.pi * np.array([2, 2, 1, 2, 2, 2]))
    np.testing.assert_array_equal(arm.q_min, -arm.q_max)
    np.testing.assert_allclose(arm.qd_max, np.pi)
    assert arm.tau_max.tolist() == [150, 150, 150, 28, 28, 28]
    assert arm.qdd_max.tolist() == [15, 15, 15, 25, 25, 25]
    assert arm.capsule_names[0] == "base"
    assert arm.capsule_links[0] == -1
    assert hash(arm) == hash(arm)


def test_unknown_variant():
    with pytest.raises(ValueError, match=r"'ur3' is not known; accepted: ur5, ur5e"):
        load_arm("ur3")
