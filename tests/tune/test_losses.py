"""Declared losses on records written by hand: values by other formulas, senses, and slopes that are finite at rest."""

import inspect
import math
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.cells import make_cell
from hrcjax.lab.errors import UsageError
from hrcjax.metrics.sound_score import SoundScoreParams
from hrcjax.reference.truth import solid_distance
from hrcjax.robot import control_points
from hrcjax.sim import Episode, Params, World
from hrcjax.sim.tick import Record
from hrcjax.tune import sound_loss
from hrcjax.tune.declared import LOSSES, find_loss, parse_losses
from hrcjax.tune.loss import EFFORT
from hrcjax.tune.sound_loss import smooth_terms, soft_least
from hrcjax.world import Person, motion_named, scene_named

TIMES = 400
SCENE = scene_named("robotica", 0)


def empty(kind, **fields):
    """An object of a class with some of its fields."""
    made = object.__new__(kind)
    for name, value in fields.items():
        object.__setattr__(made, name, value)
    return made


SCENE = jax.tree.map(lambda x: x.astype(jnp.float64) if jnp.issubdtype(x.dtype, jnp.floating) else x, SCENE)
WORLD = empty(World, scene=SCENE, person=motion_named("nobody", SCENE))
CELL = replace(make_cell(), ticks=TIMES)
HOME = np.asarray(CELL.arm.home)


def record(duration: float = 1.6, clearance: float = 0.3, apart: float = 5.0, speed: float = 0.1) -> Record:
    """A minimum-jerk reach from start to goal, then rest."""
    t = np.arange(TIMES) * CELL.dt
    u = np.clip(t / duration, 0, 1)
    s = 10 * u**3 - 15 * u**4 + 6 * u**5
    rate = np.where(u < 1, (30 * u**2 - 60 * u**3 + 30 * u**4) / duration, 0.0)
    bend = np.where(u < 1, (60 * u - 180 * u**2 + 120 * u**3) / duration**2, 0.0)
    start, goal = np.asarray(SCENE.start, float), np.asarray(SCENE.goal, float)
    joints, full, none = np.ones(6), np.ones(TIMES), jnp.zeros(TIMES, jnp.int32)
    fields = dict(
            q=s[:, None] * joints, qd=rate[:, None] * joints, qdd=bend[:, None] * joints, tau=5 * rate[:, None] * joints,
            tool=start + s[:, None] * (goal - start), reference=np.zeros((TIMES, 3)), travelled=s, separation=apart * full,
            field_clearance=clearance * full, approach=speed * full, speed_limit=0.25 * full, zone=none, reasons=none,
            cameras=none, status=none,
    )  # fmt: skip
    return Record(**{name: jnp.asarray(value) for name, value in fields.items()})


def run(**changes) -> Episode:
    path = empty(type("Path", (), {}), length=jnp.linalg.norm(SCENE.goal - SCENE.start))
    return empty(Episode, record=record(**changes), path=path, final=None)


def value(name: str, **changes) -> float:
    return float(LOSSES[name].of(Params(), CELL, WORLD, run(**changes)))


def test_values_by_other_formulas() -> None:
    made = record()
    goal, start = np.asarray(SCENE.goal), np.asarray(SCENE.start)
    d = np.linalg.norm(np.asarray(made.tool) - goal, axis=1)
    assert value("progress") == pytest.approx(np.mean(d**2) / np.sum((start - goal) ** 2))
    assert value("time") == pytest.approx(np.sum(1 - np.exp(-((d / 0.02) ** 2))) * 0.008)
    assert value("time") == pytest.approx(0.008 * np.sum(d > 0.0166), abs=0.02), "about the time to 2 cm"
    assert value("effort") == pytest.approx(np.mean(np.sum(np.asarray(made.qdd) ** 2, axis=1)))
    assert value("clearance", clearance=0.04) == pytest.approx(math.log(1 + math.exp(0.5)))
    assert value("excess_speed", speed=0.1) == 0 and value("excess_speed", speed=0.45) == pytest.approx(0.04)
    power = np.sum(np.abs(np.asarray(made.tau) * np.asarray(made.qd)), axis=1)
    assert value("energy") == pytest.approx(np.sum(power * (d > 0.0166)) * 0.008, rel=0.02)
    way, T = np.linalg.norm(goal - start), 3.0
    assert value("jerk", duration=T) == pytest.approx(720 * way**2 / T**6 * T / (TIMES * 0.008), rel=0.1)


def test_separation_counts_what_the_speed_needs() -> None:
    assert value("separation", apart=5.0) < 1e-12
    near, nearer = value("separation", apart=0.6), value("separation", apart=0.4)
    assert value("separation", apart=0.6, speed=0.5) > near and nearer > near
    ssm = CELL.safety.yardstick(Params().safety)
    v, h, a = 0.1, ssm.v_h_near, ssm.brake
    needed = (
        h * (ssm.reaction_time + v / a) + v * ssm.reaction_time + v * v / (2 * a) + ssm.intrusion + ssm.Z_d + ssm.Z_r
    )
    assert nearer == pytest.approx(math.log1p(math.exp((needed - 0.4) / 0.05)), rel=1e-6)


def test_what_is_asked_cannot_be_tuned_away() -> None:
    def loss(margin):
        asked = eqx.tree_at(lambda p: p.safety.ssm.intrusion, Params(), margin)
        return LOSSES["separation"].of(asked, CELL, WORLD, run(apart=0.5))

    assert float(jax.grad(loss)(0.2)) == 0


@pytest.fixture
def gap_given(monkeypatch) -> None:
    """The clearance of a run is the one that it was given, not that of its joints."""
    monkeypatch.setattr(sound_loss, "obstacle_gap", lambda cell, world, record: record.field_clearance)
    monkeypatch.setattr(sound_loss, "person_gap", lambda cell, world, record: record.separation)


def test_the_gap_is_that_of_the_spheres_to_the_obstacles() -> None:
    """Against distances to the solids in NumPy; who the robot senses does not matter."""
    random = np.random.default_rng(0)
    q = np.repeat(HOME + random.uniform(-0.6, 0.6, (4, 6)), TIMES // 4, axis=0)
    made = replace(record(), q=jnp.asarray(q), field_clearance=jnp.full(TIMES, -1.0))
    found = sound_loss.obstacle_gap(CELL, WORLD, made)
    for k in range(4):
        x = np.asarray(control_points(CELL.arm, jnp.asarray(q[k * TIMES // 4])))
        solids = [
            solid_distance(int(SCENE.kind[n]), *(np.asarray(v[n], float) for v in (SCENE.center, SCENE.size)), float(SCENE.yaw[n]), x)
            for n in np.flatnonzero(SCENE.mask)
        ]  # fmt: skip
        np.testing.assert_allclose(
            found[k * len(found) // 4], (np.min(solids, axis=0) - CELL.arm.control_radii).min(), atol=1e-6
        )


def test_a_person_who_is_touched_is_a_failure() -> None:
    """A ball of 5 cm at the last control point of a standing arm, 1 cm from it, 1 cm inside, and absent."""
    q, radius = jnp.broadcast_to(jnp.asarray(HOME), (TIMES, 6)), float(CELL.arm.control_radii[-1])
    tip = np.asarray(control_points(CELL.arm, jnp.asarray(HOME)))[-1]
    goal = jnp.broadcast_to(SCENE.goal, (TIMES, 3))
    losses = []
    for gap, present in ((0.01, True), (-0.01, True), (-0.01, False)):
        middle = jnp.asarray(tip - np.array([0.0, 0.0, radius + 0.05 + gap]))[None, None]
        ball = Person(middle, middle, jnp.asarray([0.05]), jnp.asarray(30.0), jnp.asarray([present]))
        world = empty(World, scene=SCENE, person=ball)
        found = sound_loss.person_gap(CELL, world, replace(record(), q=q))
        np.testing.assert_allclose(found, gap if present else 10.0, atol=2e-3)
        made = empty(Episode, record=replace(record(), q=q, tool=goal), path=run().path, final=None)
        losses.append(float(LOSSES["sound"].of(Params(), CELL, world, made)))
    assert losses[1] > losses[0] + 0.3 and losses[0] > losses[2] - 1e-6


def test_smooth_terms_of_a_minimum_jerk_reach() -> None:
    terms = smooth_terms(Params(), CELL, WORLD, run(), jnp.asarray(0.3))
    assert float(terms.clearance) == pytest.approx(100) and float(terms.separation) == pytest.approx(100)
    assert 85 < float(terms.jerk) <= 100, "as smooth as can be, sampled"
    assert float(smooth_terms(Params(), CELL, WORLD, run(), jnp.asarray(0.025)).clearance) == pytest.approx(75)
    assert float(smooth_terms(Params(), CELL, WORLD, run(), jnp.asarray(-0.01)).clearance) < 0
    sound = SoundScoreParams()
    assert float(terms.energy) == pytest.approx(100 * sound.half_energy / (sound.half_energy + value("energy")))
    slow, fast = (
        float(smooth_terms(Params(), CELL, WORLD, run(duration=T), jnp.asarray(0.3)).time) for T in (3.0, 2.4)
    )
    assert fast / slow == pytest.approx(1.25, rel=0.02)


@pytest.mark.usefixtures("gap_given")
def test_sound_ranks_as_the_score_does() -> None:
    good = value("sound")
    assert 0 < good < 0.5
    assert good < value("sound", clearance=0.02) < value("sound", clearance=-0.02)
    assert value("sound", clearance=-0.02) > 0.9 and value("sound", duration=6.0) > 0.9, "failed: below 10 of 100"
    assert good < value("sound", apart=0.3)


def test_slopes_are_finite_at_rest_and_without_anybody() -> None:
    still = jax.tree.map(lambda x: jnp.broadcast_to(x[:1], x.shape), record())
    for made in (record(), still, replace(still, tool=jnp.broadcast_to(SCENE.goal, still.tool.shape))):
        far = replace(made, separation=jnp.full(TIMES, jnp.inf), speed_limit=jnp.full(TIMES, jnp.inf))
        for one in (made, far):
            for loss in [one for one in LOSSES.values() if one.of_episode]:

                def of(tool, qd, qdd, apart, gap, one=one, loss=loss):
                    moved = replace(one, tool=tool, qd=qd, qdd=qdd, separation=apart, field_clearance=gap)
                    return loss.of(Params(), CELL, WORLD, empty(Episode, record=moved, path=run().path, final=None))

                found = jax.grad(of, argnums=range(5))(one.tool, one.qd, one.qdd, one.separation, one.field_clearance)
                assert all(np.isfinite(g).all() for g in found), loss.name


def test_soft_least() -> None:
    x = jnp.asarray([0.3, 0.1, 0.5])
    assert float(soft_least(x, 1e-3)) == pytest.approx(0.1) and float(soft_least(x, 1e3)) == pytest.approx(
        0.3, abs=1e-3
    )
    assert 0.1 < float(soft_least(x, 0.1)) < 0.3


def test_every_loss_says_what_it_is() -> None:
    for name, loss in LOSSES.items():
        assert loss.name == name and loss.unit and 10 < len(loss.meaning) < 120
        assert len(inspect.signature(loss.of).parameters) == 4
    assert EFFORT > 0


def test_choice_of_losses(tmp_path, monkeypatch) -> None:
    (tmp_path / "my_losses.py").write_text(
        'def height(params, cell, world, episode):\n    """Mean height. More."""\n    return episode.record.tool[:, 2].mean()\n'
    )
    monkeypatch.chdir(tmp_path)
    found, weights = parse_losses(("sound", "jerk=1e-3", "my_losses:height=2"))
    assert [loss.name for loss in found] == ["sound", "jerk", "my_losses:height"] and weights == (1.0, 1e-3, 2.0)
    assert found[2].meaning == "Mean height"
    assert float(found[2].of(Params(), CELL, WORLD, run())) == pytest.approx(float(record().tool[:, 2].mean()))
    for words, message in (
        (("soud",), "no loss 'soud'; accepted: sound"),
        (("sound", "sound=2"), "given twice"),
        (("sound=-1",), "a weight above 0"),
        (("sound=x",), "a weight above 0"),
        ((), "--loss is empty"),
    ):
        with pytest.raises(UsageError, match=message):
            parse_losses(words)
    for name, message in (
        ("nowhere:f", "ModuleNotFoundError"),
        ("my_losses:g", "AttributeError"),
        ("math:pi", "function"),
    ):
        with pytest.raises(UsageError, match=message):
            find_loss(name)
