"""What the stages pass on, without an episode: lists and trees, what is tuned, and the exact programs where a torque was clipped."""

from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.robot import load_arm
from hrcjax.sim import Cell
from hrcjax.sim.tick import NOT_FINITE_TORQUE, TORQUE_LIMITED
from hrcjax.tune import staged
from hrcjax.tune.staged import StagedGradient, apart, together
from hrcjax.tune.stages import Stages, torque_clipped
from hrcjax.tune.step import Values


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
    stages = Stages(Cell(arm=load_arm("ur5e")), (), (), lambda v: v, names)
    assert stages.plan_tuned is plan and stages.fields_tuned is fields


@pytest.mark.parametrize(
    ("bits", "clipped"), [(0, False), (TORQUE_LIMITED, True), (NOT_FINITE_TORQUE | 1, True), (1, False)]
)
def test_a_clipped_torque_is_noticed(bits: int, clipped: bool) -> None:
    record = SimpleNamespace(status=jnp.zeros((2, 3, 5), jnp.int32).at[1, 2, 4].set(bits))
    assert bool(torque_clipped((None, record))) is clipped


EXACT = Values(jnp.zeros(1), jnp.zeros((1, 1, 1)), jnp.zeros((1, 2)))


def canned(clipped: bool, linear: bool = True) -> StagedGradient:
    """Programs that return what is written here: 1 start, 2 parameters, the plan tuned."""
    made = object.__new__(StagedGradient)
    made.stages = Stages(Cell(arm=load_arm("ur5e")), (), (), lambda v: v, ("potential.zeta", "policy.target.kp"))
    made.linear, made.clipped, made.exact, made.times, made.identity = linear, 0, None, None, None
    two, one = jnp.asarray([[1.0, 10.0]]), [jnp.asarray(3.0)]
    outputs = {
        "plan": {"floats": one, "rest": [], "kept": []},
        "fit": {"floats": one, "rest": [], "kept": []},
        "ticks": {"floats": one, "rest": [], "kept": []},
        "loss": {
            "loss": jnp.asarray([0.5]), "each": jnp.zeros((1, 1, 1)), "clipped": jnp.asarray(clipped),
            "by_vectors": two, "by_plan": one, "by_ticks": one,
        },
        "ticks back": {"by": [100 * two, [jnp.asarray(4.0)]]},
    }  # fmt: skip
    made.programs = {name: lambda *args, out=out: out for name, out in outputs.items()}
    made.programs["plan back"] = lambda by_plan: {"by": [1000 * by_plan * two]}
    return made


def test_derivatives_of_all_stages_are_added() -> None:
    made = canned(clipped=False)
    np.testing.assert_allclose(made(None, None).gradient, [[7101.0, 71010.0]])
    assert made.clipped == 0 and made.exact is None


def test_where_a_torque_is_clipped_the_exact_programs_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def exact(stages, vectors, worlds, identity, linear):
        asked.append(linear)
        return lambda vectors, worlds: EXACT

    monkeypatch.setattr(staged, "StagedGradient", exact)
    made = canned(clipped=True)
    assert made(None, None) is EXACT and made(None, None) is EXACT
    assert asked == [False] and made.clipped == 2, "compiled once"
    assert canned(clipped=True, linear=False)(None, None) is not EXACT, "they are themselves the exact ones"
