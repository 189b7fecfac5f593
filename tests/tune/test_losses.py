"""Declared losses on records written by hand: values by other formulas, senses, and slopes that are finite at rest."""

import inspect
import math
from dataclasses import replace
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.cells import make_cell
from hrcjax.lab.errors import UsageError
from hrcjax.metrics.sound_score import SoundScoreParams, SoundTerms, sound_score
from hrcjax.sim import Episode, Params, Task, World, outcome, path_through
from hrcjax.sim.tick import Record
from hrcjax.tune import sound_loss
from hrcjax.tune.declared import LOSSES, find_loss, parse_losses
from hrcjax.tune.loss import EFFORT
from hrcjax.world import motion_named, scene_named

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
LINE = SCENE.start + jnp.linspace(0, 1, 8)[:, None] * (SCENE.goal - SCENE.start)
PATH = path_through(Task(SCENE, jnp.asarray(CELL.arm.home), Params().potential, CELL.arm), LINE)


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
    return empty(Episode, record=record(**changes), path=PATH, final=None)


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


def sound_of(
    monkeypatch, tool: np.ndarray, success: bool, clearance: float = 0.3, separation: float = 5.0, hit: bool = False
):
    """The loss of a run, and the score of the same metrics."""
    terms = {"clearance": 80.0, "separation": 90.0, "time": 30.0, "jerk": 60.0, "energy": 40.0}
    metrics = SimpleNamespace(
        success=jnp.asarray(float(success)), clearance=jnp.asarray(clearance), separation=jnp.asarray(separation),
        **{f"sound_{name}": jnp.asarray(x) for name, x in terms.items()},
    )  # fmt: skip
    found = SimpleNamespace(metrics=metrics, hit=jnp.asarray(hit), run_into=jnp.asarray(False))
    monkeypatch.setattr(sound_loss, "outcome", lambda *args: found)
    made = empty(Episode, record=replace(record(), tool=jnp.asarray(tool)), path=None, final=None)
    whole = success and clearance >= 0 and not hit
    score = sound_score(
        SoundScoreParams(), jnp.asarray(whole), SoundTerms(**{n: jnp.asarray(x) for n, x in terms.items()})
    )
    return float(LOSSES["sound"].of(Params(), CELL, WORLD, made)), 1 - float(score) / 100


def test_sound_is_the_score_where_a_run_succeeds_and_a_share_of_it_elsewhere(monkeypatch) -> None:
    goal = np.asarray(SCENE.goal, float)

    def at(d: float) -> np.ndarray:
        way = np.concatenate([np.linspace(0.3, d, TIMES // 2), np.full(TIMES // 2, d)])  # and rests there
        return goal + way[:, None] * np.array([0.0, 0.6, 0.8])

    loss, good = sound_of(monkeypatch, at(0.0199), True)
    assert loss == pytest.approx(good)
    failed = sound_of(monkeypatch, at(0.3), False)[1]
    assert sound_of(monkeypatch, at(0.025), False)[0] == pytest.approx((good + failed) / 2), "a quarter of 2 cm beyond"
    assert sound_of(monkeypatch, at(0.3), False)[0] == pytest.approx(failed, abs=1e-3)
    assert sound_of(monkeypatch, at(0.0), True, clearance=-0.005)[0] == pytest.approx((good + failed) / 2)
    assert sound_of(monkeypatch, at(0.0), True, separation=-0.005, hit=True)[0] == pytest.approx((good + failed) / 2)
    assert sound_of(monkeypatch, at(0.0), True, separation=-0.005)[0] == pytest.approx(good), (
        "a person who touches an arm that rests"
    )
    passed = goal + np.linspace(0.3, -0.3, TIMES)[:, None] * np.array([0.0, 0.6, 0.8])  # at 0.188 m/s
    assert sound_of(monkeypatch, passed, False)[0] == pytest.approx(failed, abs=0.02), (
        "who passes the goal has not arrived"
    )
    # at the border the share has no step, and no slope on the side of success
    assert sound_of(monkeypatch, at(0.0201), False)[0] == pytest.approx(good, abs=1e-3)


def test_sound_is_the_score_of_the_outcome() -> None:
    made = record()

    @jax.jit
    def both(made):
        one = empty(Episode, record=made, path=PATH, final=None)
        return outcome(Params(), CELL, WORLD, one).metrics, LOSSES["sound"].of(Params(), CELL, WORLD, one)

    score, loss = both(made)
    assert score.success == 1 and 20 < score.score_sound < 100
    assert float(loss) == pytest.approx(1 - float(score.score_sound) / 100, rel=1e-12)


def test_slopes_are_finite_at_rest_and_without_anybody() -> None:
    names = ("q", "tool", "qd", "qdd", "separation", "field_clearance")
    losses = [loss for loss in LOSSES.values() if loss.of_episode]

    @jax.jit
    def slopes(one):
        def each(floats):
            made = empty(Episode, record=replace(one, **floats), path=PATH, final=None)
            return {loss.name: loss.of(Params(), CELL, WORLD, made) for loss in losses}

        return jax.jacrev(each)({name: getattr(one, name) for name in names})

    still = jax.tree.map(lambda x: jnp.broadcast_to(x[:1], x.shape), record())
    for made in (record(), still, replace(still, tool=jnp.broadcast_to(SCENE.goal, still.tool.shape))):
        far = replace(made, separation=jnp.full(TIMES, jnp.inf), speed_limit=jnp.full(TIMES, jnp.inf))
        for one in (made, far):
            for name, found in slopes(one).items():
                assert all(np.isfinite(g).all() for g in found.values()), name


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
