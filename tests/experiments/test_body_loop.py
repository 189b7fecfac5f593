"""Measures of whole episodes with and without the body: exposure against C MuJoCo and NumPy, rows of made-up episodes."""

import itertools

import equinox as eqx
import jax
import mujoco
import numpy as np
import pytest

from experiments.body.loop import VARIANTS, LoopBench
from experiments.body.loop_rows import broken, definition, loop_rows
from experiments.body.real_speed import STRIDE, real_exposure
from experiments.body.rows import holds
from hrcjax.robot.link_spheres import link_spheres

DT, TICKS = 0.008, 70


@pytest.fixture(scope="module")
def measured():
    """An arm that turns, somebody who comes to it and stops; and what is measured."""
    import jax.numpy as jnp

    from hrcjax.cells import make_cell
    from hrcjax.geom.capsules import Capsules
    from hrcjax.sim import Params

    arm, ssm = make_cell().arm, Params().safety.ssm
    t = np.arange(TICKS) * DT
    qd = np.array([1.8, 0.4, -0.3, 0.0, 0.2, 0.0])
    q = np.asarray(arm.home) + t[:, None] * qd
    middle = np.array([0.1, 0.48, 0.3]) - np.minimum(t, 0.3)[:, None] * np.array([0.3, 1.1, 0.0])
    a = np.stack([middle, middle + np.array([0.0, 0.3, 0.2])], axis=1)
    b = a + np.array([0.2, 0.05, 0.1])
    radius = np.array([0.07, 0.15])
    person = Capsules(*(jnp.asarray(v) for v in (a, b, np.broadcast_to(radius, (TICKS, 2)))))
    found = jax.jit(lambda q, p: real_exposure(arm, ssm, DT, q, jnp.broadcast_to(jnp.asarray(qd), q.shape), p))(
        jnp.asarray(q), person
    )
    return arm, ssm, q, qd, a, b, radius, found


def gap(x: np.ndarray, a: np.ndarray, b: np.ndarray, radius: np.ndarray) -> tuple[float, np.ndarray]:
    """Distance of a place to the nearest capsule, and the direction from it."""
    best = (np.inf, np.zeros(3))
    for p, e, r in zip(a, b, radius, strict=True):
        s = np.clip((x - p) @ (e - p) / ((e - p) @ (e - p)), 0, 1)
        off = x - p - s * (e - p)
        size = float(np.linalg.norm(off))
        best = min(best, (size - r, off / size), key=lambda pair: pair[0])
    return best


def test_exposure_against_plain_loops(measured) -> None:
    arm, ssm, q, qd, a, b, radius, found = measured
    links, offsets, radii = link_spheres(arm)
    data = mujoco.MjData(arm.model)

    def places(k: int) -> tuple[np.ndarray, np.ndarray]:
        data.qpos[:] = q[k]
        mujoco.mj_forward(arm.model, data)
        x, xd = np.zeros((len(radii), 3)), np.zeros((len(radii), 3))
        for s, (link, offset) in enumerate(zip(links, offsets, strict=True)):
            body, J = int(arm.model.jnt_bodyid[link]), np.zeros((3, 6))
            x[s] = data.xpos[body] + data.xmat[body].reshape(3, 3) @ offset
            mujoco.mj_jac(arm.model, data, J, None, x[s], body)
            xd[s] = J @ qd
        return x, xd

    window = 13  # ticks of 0.1 s
    every = [places(k) for k in range(TICKS)]
    d = np.array([[gap(x, a[k], b[k], radius)[0] for x in every[k][0]] for k in range(TICKS)]) - radii
    for k in (0, 20, 33, 50, 69):
        x, xd = every[k]
        excess, short, apart = -np.inf, -np.inf, np.inf
        for s in range(len(radii)):
            speed = -xd[s] @ gap(x[s], a[k], b[k], radius)[1]
            stop = max(speed, 0.0) / ssm.brake
            steps = [i for i in range(-15, 60, STRIDE) if i * DT <= stop + STRIDE * DT + 1e-9]
            at = [gap(x[s], *(v[min(max(k + i, 0), TICKS - 1)] for v in (a, b)), radius)[0] - radii[s] for i in steps]
            comes = max(0.0, max((m - n) / (STRIDE * DT) for m, n in itertools.pairwise(at)))
            most = d[max(k - window, 0) : k + 1, s].max()
            e = most - comes * ssm.reaction_time - ssm.intrusion - ssm.Z_d - ssm.Z_r
            w = comes + ssm.brake * ssm.reaction_time
            allowed = np.sqrt(w * w + 2 * ssm.brake * e) - w if e > 0 else 0.0
            excess, apart = max(excess, speed - allowed), min(apart, d[k, s])
            if speed > 0.005:
                left = min(one for one, i in zip(at, steps, strict=True) if i >= 0) - speed**2 / (2 * ssm.brake)
                short = max(short, ssm.intrusion - left)
        np.testing.assert_allclose(found.separation[k], apart, atol=1e-5)
        np.testing.assert_allclose(found.excess[k], excess, atol=2e-4)
        np.testing.assert_allclose(found.short[k], short, atol=1e-4)
    assert float(found.excess.max()) > 0.05, "this arm is too fast"


def case(stops: dict[str, int], excess: float = -0.1) -> dict[str, np.ndarray]:
    """Ticks of every variant in a stop, of 100."""
    zone = np.stack([np.where(np.arange(100) < stops[name], 3, 1) for name in VARIANTS])
    flat = np.full(zone.shape, excess)
    return {
        "zone": zone, "reasons": np.where(zone == 3, 4, 0), "counts": np.ones(zone.shape, bool), "dt": np.asarray(0.008),
        "clean": np.asarray(True), "tracked": np.ones(9, bool), "age": np.full(9, 1.0), "explained": np.full(9, 1.0),
        "separation": np.ones(zone.shape), "excess": flat, "excess_assumed": flat, "short": flat,
        "arrived": np.ones(len(VARIANTS)), "time_to_goal": np.full(len(VARIANTS), 3.0), "hit": np.zeros(len(VARIANTS), bool),
        "run_into": np.zeros(len(VARIANTS), bool),
    }  # fmt: skip


def test_rows_of_episodes() -> None:
    made = {"off": 40, "alike": 32, "speed": 20, "head": 50, "body": 26, "still": 10}
    rows = loop_rows({"one": case(made), "wild": case(made, 3.0) | {"clean": np.asarray(False)}})
    for end, expected in (
        ("", 0.65),
        ("_speed", 0.5),
        ("_alike", 0.625),
        ("_head", 1.25),
        ("_still", 0.25),
        ("_body_head", 0.52),
    ):
        assert rows["stopped_time_ratio" + end]["value"] == pytest.approx(expected)
    assert holds("stopped_time_ratio", 0.65) and not holds("stopped_time_ratio", 0.71)
    assert rows["stopped_time_off"]["value"] == pytest.approx(0.32) == rows["stopped_close_off"]["value"]
    assert rows["excess_speed_with"]["value"] == pytest.approx(-0.1) and rows["violations_body"]["value"] == 0
    assert all(definition(name) for name in rows)
    assert broken(case(made, 0.01), 0) and not broken(case(made), 0)


def test_the_interval_of_a_ratio_is_that_of_people_with_all_their_seeds() -> None:
    made = {"off": 40, "alike": 32, "speed": 20, "head": 50, "body": 26, "still": 10}
    alike = {"one": case(made), "one, seed 1": case(made | {"speed": 40})}  # one person: nothing can be drawn otherwise
    rows = loop_rows(alike)
    ends = [rows[f"stopped_time_ratio_speed_{end}"]["value"] for end in ("low", "high")]
    assert ends == [pytest.approx(0.75)] * 2
    rows = loop_rows(alike | {"two": case(made | {"speed": 10}), "three": case(made | {"speed": 36})})
    low, high = (rows[f"stopped_time_ratio_speed_{end}"]["value"] for end in ("low", "high"))
    assert low == pytest.approx(0.25) and high == pytest.approx(0.9)  # all of them the one, or the other


def test_the_variant_alike_differs_from_off_by_the_hysteresis_alone() -> None:
    each = LoopBench(3.0).settings.safety
    off, alike = (jax.tree.map(lambda a, k=k: a[k], each) for k in map(VARIANTS.index, ("off", "alike")))
    assert alike.safety.zone.hysteresis == off.safety.zone.measured_hysteresis < off.safety.zone.hysteresis
    same = eqx.tree_at(lambda uses: uses.safety.zone.hysteresis, alike, off.safety.zone.hysteresis)
    assert all(bool(a == b) for a, b in zip(jax.tree.leaves(same), jax.tree.leaves(off), strict=True))
