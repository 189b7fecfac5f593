"""What the stages pass on, without an episode: lists and trees, what is tuned, and the exact programs where a torque was clipped."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.robot import load_arm
from hrcjax.sim import Cell
from hrcjax.sim.parts import FieldPart
from hrcjax.sim.tick import NOT_FINITE_TORQUE, TORQUE_LIMITED
from hrcjax.tune import staged
from hrcjax.tune import stages as stages_of
from hrcjax.tune.declared import Loss
from hrcjax.tune.staged import StagedGradient, apart, together
from hrcjax.tune.stages import Stages, torque_clipped
from hrcjax.tune.step import Values

CELL = Cell(arm=load_arm("ur5e"))


def test_a_tree_comes_back_from_its_lists() -> None:
    tree = {"a": jnp.arange(3), "b": (jnp.ones(2), jnp.asarray(True)), "c": jnp.zeros((), jnp.float32)}
    floats, rest = apart(tree)
    assert [x.dtype.kind for x in floats] == ["f", "f"] and [x.dtype.kind for x in rest] == ["i", "b"]
    back = together(tree, [2 * x for x in floats], rest)
    np.testing.assert_array_equal(back["b"][0], [2.0, 2.0])
    assert back["a"] is tree["a"] and bool(back["b"][1])


@pytest.mark.parametrize(
    ("names", "plan", "fields"),
    [
        (("motion.speed", "policy.target.kp"), False, False),
        (("potential.zeta",), True, False),
        (("plan.omega2", "field.noise"), True, True),
    ],
)
def test_which_stages_a_parameter_reaches(names: tuple[str, ...], plan: bool, fields: bool) -> None:
    stages = Stages(CELL, (), (), lambda v: v, names)
    assert stages.plan_tuned is plan and stages.fields_tuned is fields


@pytest.mark.parametrize(
    ("bits", "clipped"), [(0, False), (TORQUE_LIMITED, True), (NOT_FINITE_TORQUE | 1, True), (1, False)]
)
def test_a_clipped_torque_is_noticed(bits: int, clipped: bool) -> None:
    record = SimpleNamespace(status=jnp.zeros((2, 3, 5), jnp.int32).at[1, 2, 4].set(bits))
    assert bool(torque_clipped((None, record))) is clipped


VECTORS = jnp.zeros((1, 2))
EXACT = Values(jnp.zeros(1), jnp.zeros((1, 1, 1)), jnp.zeros((1, 2)))


def canned(clipped: bool, linear: bool = True) -> StagedGradient:
    """Programs that return what is written here: 1 start, 2 parameters, the plan tuned."""
    made = object.__new__(StagedGradient)
    losses = tuple(Loss(name, "1", "", lambda *args: args) for name in "xy")
    made.stages = Stages(CELL, losses, (0.75, 0.25), lambda v: v, ("potential.zeta", "policy.target.kp"))
    made.linear, made.clipped, made.exact, made.times, made.identity = linear, 0, None, None, None
    two, one = jnp.asarray([[1.0, 10.0]]), [jnp.asarray(3.0)]
    outputs = {
        "plan": {"floats": one, "rest": [], "kept": []},
        "fit": {"floats": one, "rest": [], "kept": []},
        "ticks": {"floats": one, "rest": [], "kept": [], "clipped": jnp.asarray(clipped)},
        "ticks back": {"by": [100 * two, [jnp.asarray(4.0)]]},
    }  # fmt: skip
    made.programs = {name: lambda *args, out=out: out for name, out in outputs.items()}
    for name, value in (("x", 0.5), ("y", 0.25)):
        made.programs[f"loss {name}"] = lambda v, *args, value=value: {
            "each": jnp.full((1, 1), value), "by": [args[-1] * two, [args[-1] * one[0]], [args[-1] * one[0]]],
        }  # fmt: skip
    made.programs["plan back"] = lambda by_plan: {"by": [1000 * by_plan * two]}
    return made


def test_derivatives_of_all_stages_are_added() -> None:
    made = canned(clipped=False)
    found = made(VECTORS, None)
    np.testing.assert_allclose(found.gradient, [[7101.0, 71010.0]])
    np.testing.assert_allclose(found.loss, [0.75 * 0.5 + 0.25 * 0.25])
    assert made.clipped == 0 and made.exact is None


def test_where_a_torque_is_clipped_the_exact_programs_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def exact(stages, vectors, worlds, identity, linear):
        asked.append(linear)
        return lambda vectors, worlds: EXACT

    monkeypatch.setattr(staged, "StagedGradient", exact)
    made = canned(clipped=True)
    assert made(VECTORS, None) is EXACT and made(VECTORS, None) is EXACT
    assert asked == [False] and made.clipped == 2, "compiled once"
    assert canned(clipped=True, linear=False)(VECTORS, None) is not EXACT, "they are themselves the exact ones"


class Seen(eqx.Module):
    """In place of a record."""

    x: jnp.ndarray
    status: jnp.ndarray


class Small(eqx.Module):
    """In place of a world, with whatever an episode of a line asks for."""

    w: jnp.ndarray
    frames: jnp.ndarray
    q_start: jnp.ndarray


class Two(dict):
    """In place of parameters."""

    field = 1.0


@pytest.fixture
def lines(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[SimpleNamespace]:
    """Episodes of a line: plan = a w latency, record = sin(plan) b sum(frames); and a folder of programs."""
    used = {"plan": True}
    monkeypatch.setattr(
        stages_of, "task_of", lambda p, cell, world: world.w * (p["potential.a"] if used["plan"] else 1.0)
    )
    monkeypatch.setattr(stages_of, "plan_route", lambda p, cell, task: (task * cell.latency, task * cell.latency))
    monkeypatch.setattr(
        stages_of, "follow",
        lambda p, cell, route, frames, q, fields: (q, Seen(jnp.sin(route) * p["policy.b"] * fields, jnp.zeros((), jnp.int32))),
    )  # fmt: skip
    monkeypatch.setattr(stages_of, "Episode", lambda path, record, final: SimpleNamespace(record=record))
    before = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", str(tmp_path))
    yield SimpleNamespace(folder=tmp_path / "traced", used=used)
    jax.config.update("jax_compilation_cache_dir", before)


def summed(params, cell, world, run):
    return jnp.sum(run.record.x)


def line(latency: float, loss=summed, identity: str | None = "line") -> Values:
    cell = replace(CELL, latency=latency, field=FieldPart(lambda p, frames: jnp.sum(frames), lambda *args: None))
    names = ("potential.a", "policy.b")
    stages = Stages(cell, (Loss("sum", "1", "", loss),), (1.0,), lambda v: Two(zip(names, v, strict=True)), names)
    vectors, world = jnp.asarray([[2.0, 3.0]]), Small(*(jnp.asarray(x)[None] for x in ([0.3, 0.4], [1.0, 2.0], [0.0])))
    return StagedGradient(stages, vectors, world, identity and f"{identity} {latency}")(vectors, world)


def by_hand(latency: float) -> tuple[float, list[float]]:
    w = latency * np.array([0.3, 0.4])
    return float(9 * np.sin(2 * w).sum()), [float(9 * (w * np.cos(2 * w)).sum()), float(3 * np.sin(2 * w).sum())]


def test_programs_from_disk_give_the_same(lines: SimpleNamespace) -> None:
    for latency in (1.0, 5.0, 1.0):  # the third time from disk
        found, (loss, gradient) = line(latency), by_hand(latency)
        np.testing.assert_allclose(found.loss, [loss])
        np.testing.assert_allclose(found.gradient, [gradient])
    kept = sorted(lines.folder.iterdir())
    assert len(kept) == 2 * 5, (
        "plan, its reverse, fit, ticks and their reverse, without the loss of one's own; of two cells"
    )
    for gone in kept[::3]:
        gone.unlink()
    np.testing.assert_allclose(line(1.0).gradient, [by_hand(1.0)[1]])


def test_a_loss_of_ones_own_is_never_from_disk(lines: SimpleNamespace) -> None:
    first = line(1.0)
    other = line(1.0, lambda *args: -summed(*args))
    np.testing.assert_allclose(other.loss, -first.loss)
    np.testing.assert_allclose(other.gradient, -first.gradient)


def test_terms_are_programs_and_weights_are_not(monkeypatch: pytest.MonkeyPatch, lines: SimpleNamespace) -> None:
    made = []
    make = StagedGradient._make

    def noted(self, pool, name, *rest, **options):
        made.append(name)
        return make(self, pool, name, *rest, **options)

    monkeypatch.setattr(StagedGradient, "_make", noted)
    both = tuple(Loss(name, "1", "", of) for name, of in (("sum", summed), ("square", lambda *a: summed(*a) ** 2)))
    cell = replace(CELL, field=FieldPart(lambda p, frames: jnp.sum(frames), lambda *args: None))
    names = ("potential.a", "policy.b")
    stages = Stages(cell, both[:1], (1.0,), lambda v: Two(zip(names, v, strict=True)), names)
    vectors, world = jnp.asarray([[2.0, 3.0]]), Small(*(jnp.asarray(x)[None] for x in ([0.3, 0.4], [1.0, 2.0], [0.0])))
    gradient = StagedGradient(stages, vectors, world)
    first, every = gradient(vectors, world), list(made)
    assert [name for name in every if name.startswith("loss")] == ["loss sum"]
    gradient.new_loss(replace(stages, weights=(4.0,)))
    np.testing.assert_allclose(gradient(vectors, world).gradient, 4 * first.gradient)
    assert made == every, "another weight compiles nothing"
    gradient.new_loss(replace(stages, losses=both, weights=(2.0, 0.5)))
    assert made == [*every, "loss square"], "another term its own program"
    found, value = gradient(vectors, world), float(first.loss[0])
    np.testing.assert_allclose(found.loss, [2 * value + 0.5 * value**2], rtol=1e-6)
    np.testing.assert_allclose(found.gradient, (2 + value) * first.gradient, rtol=1e-5)
    gradient.new_loss(replace(stages, weights=(1.0,)))
    np.testing.assert_allclose(gradient(vectors, world).gradient, first.gradient)
    assert made[-1] == "loss square"


def test_a_loss_that_fails_changes_nothing(lines: SimpleNamespace) -> None:
    cell = replace(CELL, field=FieldPart(lambda p, frames: jnp.sum(frames), lambda *args: None))
    names = ("potential.a", "policy.b")

    def broken(*args):
        raise RuntimeError("broken")

    one, bad = (Loss("sum", "1", "", of) for of in (summed, broken))
    stages = Stages(cell, (one,), (1.0,), lambda v: Two(zip(names, v, strict=True)), names)
    vectors, world = jnp.asarray([[2.0, 3.0]]), Small(*(jnp.asarray(x)[None] for x in ([0.3, 0.4], [1.0, 2.0], [0.0])))
    gradient = StagedGradient(stages, vectors, world)
    gradient.exact = exact = StagedGradient(stages, vectors, world, linear=False)
    first = gradient(vectors, world)
    for _ in range(2):  # and again: the failed one is not taken for finished
        with pytest.raises(RuntimeError, match="broken"):
            gradient.new_loss(replace(stages, losses=(bad,)))
        np.testing.assert_array_equal(gradient(vectors, world).gradient, first.gradient)
    with pytest.raises(ValueError, match="accepted is each name once"):
        gradient.new_loss(replace(stages, losses=(one, bad), weights=(1.0, 1.0)))
    gradient.new_loss(replace(stages, weights=(3.0,)))
    np.testing.assert_allclose(gradient(vectors, world).gradient, 3 * first.gradient)
    assert gradient.exact is exact and exact.stages.weights == (3.0,), "exact programs stay too"


def test_a_planner_that_ignores_the_chosen_parameter(lines: SimpleNamespace) -> None:
    lines.used["plan"] = False
    found = line(1.0, identity=None)
    np.testing.assert_allclose(found.gradient, [[0.0, 3 * np.sin([0.3, 0.4]).sum()]])
