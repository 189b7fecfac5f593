"""The set-up motion: every look is reached, within the joints' ranges, and no link touches what stands there."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.robot import arm_capsules, tool_frame
from hrcjax.sim import Cell
from hrcjax.sim.prepare import posture_at
from hrcjax.sim.scan import LOOKS, POSE_ERROR, TURNS, scan_postures
from hrcjax.world import capsules_obstacle_distances, scene_named
from hrcjax.world.place import path_middle


@pytest.fixture(scope="module")
def scanned(cell: Cell):
    """(name, seed) -> scene, posture at its start, postures."""

    def run(name: str, seed: int):
        scene = scene_named(name, seed)
        q = posture_at(cell, scene.start)
        return scene, q, scan_postures(cell.arm, scene, q)

    return run


@pytest.mark.parametrize(("name", "seed"), [("robotica", 0), ("hri", 0), ("clutter", 1), ("clutter", 2)])
def test_looks_are_reached_and_the_last_posture_is_the_start(cell: Cell, scanned, name: str, seed: int) -> None:
    scene, q_start, postures = scanned(name, seed)
    assert postures.dtype == q_start.dtype
    np.testing.assert_array_equal(postures[-1], q_start)
    looks = np.asarray(postures[:-1])
    assert 8 <= len(looks) <= len(LOOKS) * len(TURNS)
    assert (looks >= cell.arm.q_min).all() and (looks <= cell.arm.q_max).all()
    _, p = jax.vmap(lambda q: tool_frame(cell.arm, q))(postures[:-1])
    p = np.asarray(p)
    cylinder = np.stack([np.hypot(p[:, 0], p[:, 1]), p[:, 2]], axis=1)
    wanted = np.array([look[:2] for look in LOOKS])
    assert np.min(np.linalg.norm(cylinder[:, None] - wanted, axis=2), axis=1).max() < POSE_ERROR[0] + 1e-6


def test_passes_sweep_to_both_sides_of_the_path_and_turn_back(cell: Cell, scanned) -> None:
    scene, _, postures = scanned("robotica", 0)
    assert len(postures) == len(LOOKS) * len(TURNS) + 1, "all are in reach"
    R, p = jax.vmap(lambda q: tool_frame(cell.arm, q))(postures[:-1])
    middle = np.asarray(path_middle(scene))
    ahead = np.arctan2(middle[1], middle[0])
    turn = np.angle(np.exp(1j * (np.arctan2(p[:, 1], p[:, 0]) - ahead)))
    count = len(TURNS)
    np.testing.assert_allclose(turn[:count], TURNS, atol=0.07)
    np.testing.assert_allclose(turn[count:], TURNS[::-1], atol=0.07)
    assert np.abs(np.diff(np.asarray(postures)[:-1], axis=0)).max() < 2.0, "no joint turns round between looks"
    # the first pass looks outwards, the second back to the base, both down
    view, out = np.asarray(R)[:, :, 2], np.stack([np.cos(turn + ahead), np.sin(turn + ahead), 0 * turn], axis=1)
    outward = np.sum(view * out, axis=1)
    np.testing.assert_allclose(np.abs(outward), np.repeat([np.sin(0.6), np.sin(0.5)], count), atol=0.06)
    assert (np.sign(outward[:count]) == -np.sign(outward[count:])).all() and (view[:, 2] < -0.75).all()


def test_the_arm_stays_clear_of_what_stands_in_the_papers_cell(cell: Cell, scanned) -> None:
    """Exact distances of all links, in every look and on the straight way from one to the next."""
    scene, _, postures = scanned("robotica", 0)
    share = np.linspace(0, 1, 9)[:-1, None]
    q = np.asarray(postures, float)
    way = np.concatenate([a + share * (b - a) for a, b in zip(q[:-1], q[1:], strict=True)])
    gaps = jax.jit(jax.vmap(lambda q: jnp.min(capsules_obstacle_distances(scene, arm_capsules(cell.arm, q)))))
    assert float(gaps(postures[:-1]).min()) > 0.05
    assert float(gaps(jnp.asarray(way[:-8], jnp.float32)).min()) > 0.03
    tool = jax.vmap(lambda q: tool_frame(cell.arm, q)[1])(jnp.asarray(way, jnp.float32))
    assert float(tool[:, 2].min()) > 0.0, "nor the table"


def test_looks_out_of_reach_are_left_out(cell: Cell, scanned, monkeypatch: pytest.MonkeyPatch) -> None:
    from hrcjax.sim import scan

    monkeypatch.setattr(scan, "LOOKS", ((0.45, 0.62, -0.6), (1.4, 0.6, 0.5)))
    _, q_start, postures = scanned("robotica", 0)
    assert len(postures) == len(TURNS) + 1
    np.testing.assert_array_equal(postures[-1], q_start)
