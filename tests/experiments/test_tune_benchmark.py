"""Methods that tune against each other, on functions in place of episodes: optima, budgets, resumption, failures, intervals."""

import json
from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import minimize

pytest.importorskip("cmaes")
pytest.importorskip("optax")
pytest.importorskip("orbax.checkpoint")

from experiments.tune.problem import Problem, named_cell, world_names
from experiments.tune_benchmark import run as program
from experiments.tune_benchmark.account import Account, Question, Race
from experiments.tune_benchmark.choice import least_first
from experiments.tune_benchmark.compare import difference, lost_worlds
from experiments.tune_benchmark.config import METHODS, TuneBenchmarkConfig, parse
from experiments.tune_benchmark.forward import Forward
from experiments.tune_benchmark.grid_sweep import grid_settings, grid_vectors
from experiments.tune_benchmark.kinds import kinds, lines, never
from experiments.tune_benchmark.lockstep import in_lockstep
from experiments.tune_benchmark.methods import Entry
from experiments.tune_benchmark.problem import tune_config
from experiments.tune_benchmark.results import Found, rows, verdicts
from experiments.tune_benchmark.slopes import Slopes
from experiments.tune_benchmark.starts import starting
from hrcjax.lab.case_store import RunStore
from hrcjax.lab.errors import UsageError
from hrcjax.tune import LOSSES, choose
from hrcjax.tune.tuned import read_training, read_tuned

CONFIG = TuneBenchmarkConfig(
    params=("K_att=0.01:0.2", "K_rep=1e-6:1e-3", "zeta=1.2:5"), loss=("sound=1",), scenes=("robotica",), people=("reach_in",),
    seeds=(0, 1), held_out_scenes=("robotica",), held_out_people=("pass_by",), held_out_seeds=(7, 8, 9), seeds_of_methods=(0, 1),
    grid=("K_att=log:0.01:0.2:6", "K_rep=log:1e-6:1e-3:2", "zeta=lin:1.5:5:4"), budget=301, ratio=1.5, rate=0.2, choices=3,
    at_once=8, figures=False,
)  # fmt: skip
PRICE = 2 * 1.5
"""Of one gradient in CONFIG [forward episodes]."""
NAMED = named_cell(tune_config(CONFIG, 2))


@pytest.fixture(autouse=True, scope="module")
def one_cell():
    """The cell is compiled once."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(program, "named_cell", lambda config: NAMED)
        yield


def build(config, named) -> Problem:
    """A curved valley (Rosenbrock) in the logarithms of two parameters and a slope in the third; worlds move the optimum a little."""
    chosen = choose(config.params, named.params, named.known_aliases(), named.known_domains(), config.frozen)
    train, held = world_names(config)

    def terms(params, world):
        p = params.potential
        u, v, w = jnp.log(p.k_att / 0.05), jnp.log(p.zeta / 2.5), jnp.log(p.k_rep / 3e-5)
        return jnp.stack([(0.5 + world[0] - u) ** 2 + 5 * (v - u**2) ** 2 + 0.1 * w**2])

    def measure(params, world):
        f = terms(params, world)[0]
        return {"score_sound": 100 - f, "success": jnp.ones_like(f), "sound_time": 100 - 2 * f, "loss": f}

    def world(name):
        return np.array([0.02 if name[2] % 2 else -0.02])

    units = {"score_sound": ("1", "high"), "success": ("1", "high"), "sound_time": ("1", "high"), "loss": ("1", "low")}
    return Problem(
        base=named.params, chosen=chosen, losses=(LOSSES["sound"],), weights=(1.0,), terms=terms, measure=measure, units=units,
        training={f"{n}": world(n) for n in train}, held_out={f"{n}": world(n) for n in held},
    )  # fmt: skip


def broken(at) -> object:
    """The same where the loss of `at` (params) is not finite."""

    def made(config, named) -> Problem:
        whole = build(config, named)
        return replace(whole, terms=lambda p, w: whole.terms(p, w) + jnp.where(at(p), jnp.nan, 0.0))

    return made


def ended(folder: Path) -> dict[str, tuple]:
    """Choice and numbers but for the time, of all finished methods."""
    store = RunStore(folder, json.loads((folder / "run.json").read_text())["fingerprint"], {}, False)
    names = sorted(path.stem.removeprefix("done--") for path in (folder / "cases").glob("done--*.npz"))
    cases = {name: store.get(f"done/{name}") for name in names}
    return {name: (c["vector"], np.delete(c["numbers"], 2), c["way"]) for name, c in cases.items() if c is not None}


def same(one: dict[str, tuple], other: dict[str, tuple]) -> None:
    assert one.keys() <= other.keys() and one
    for name, arrays in one.items():
        for a, b in zip(arrays, other[name], strict=True):
            np.testing.assert_array_equal(a, b, err_msg=name)


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("race")
    config = replace(
        CONFIG, out=folder / "run", figures=True, smooth=True, page=folder / "page.md", json=folder / "rows.json"
    )
    assert program.run(config, build, ["--smooth"]) == 0
    return folder


def values(folder: Path) -> dict[str, float]:
    rows = json.loads((folder / "rows.json").read_text())["tune_benchmark"]
    return {name: entry["value"] for name, entry in rows.items()}


def test_optima_are_found(whole: Path) -> None:
    row = values(whole)
    assert row["defaults_score"] < 99.5
    assert row["gradient_training_score"] > 99.98
    assert row["quasi_newton_training_score"] > 99.998, "the optimum is 99.9996, as the worlds pull apart"
    assert row["cma_es_training_score"] > 99.9 and row["cma_smooth_training_score"] > 99.9
    assert row["random_training_score"] > row["defaults_training_score"]
    assert row["gradient_minus_defaults_low"] > 0 and row["gradient_minus_sweep_low"] > 0
    assert row["gradient_minus_random"] == pytest.approx(row["gradient_score"] - row["random_score"], abs=1e-9)


def test_budgets_are_kept_and_used(whole: Path) -> None:
    for name, (_, numbers, way) in ended(whole / "run").items():
        spent, method = numbers[1], name.rpartition("-")[0]
        if method in ("gradient", "quasi_newton"):
            assert CONFIG.budget - PRICE - 2 < spent <= CONFIG.budget
        elif method == "sweep":
            assert spent == 6 * 2 * 4 * 2
        else:
            assert spent == (0 if method == "defaults" else 300), "whole settings alone"
        assert way[0, -1] == spent and (np.diff(way[1]) >= 0).all() and (np.diff(way[0]) >= 0).all()


def test_page_rows_and_figures(whole: Path) -> None:
    page = (whole / "page.md").read_text()
    assert (
        "python -m experiments.tune_benchmark --smooth" in page
        and "cmaes 0." in page
        and "counts as 1.5, as given" in page
    )
    assert "| quasi_newton |" in page and "* Against defaults: in no world by more than 0.5 points." in page
    assert "progress.png" in page and "('robotica', 'pass_by', 7)" in page and "{" not in page
    assert {path.name for path in (whole / "run/figures").iterdir()} == {"progress.png", "held_out.png"}
    assert {f"{m}_score" for m in METHODS} <= values(whole).keys()


def test_kinds_of_worlds_and_those_that_nobody_solves() -> None:
    train = [("a", "p", 0), ("b", "p", 0)]
    held = [("a", "p", 1), ("a", "q", 1), ("c", "p", 1), ("b", "p", 1), ("c", "q", 1)]
    groups = kinds(train, held)
    assert list(groups.values()) == [[0, 3], [1], [2, 4]] and list(kinds(train, held[:1]).values()) == [[0]]
    one = {
        "score_sound": np.array([[90.0, 5, 7, 80, 60], [92, 5, 7, 80, 60]]),
        "success": np.array([[1, 0, 0, 1, 1], [1, 0, 0, 1, 0]]),
    }
    other = {"score_sound": np.array([[50.0, 6, np.nan, 50, 6]]), "success": np.array([[1, 0, np.nan, 1, 0]])}
    both = {"other": other, "one": one}
    np.testing.assert_array_equal(never(both), [False, True, True, False, False])
    head, *rows = lines(both, groups)
    assert (
        head[1].endswith("(2 of 2 worlds)")
        and head[2].endswith("(0 of 1 worlds)")
        and head[3].endswith("(1 of 2 worlds)")
    )
    assert rows == [["one", "85.50", "-", "60.00"], ["other", "50.00", "-", "6.00"]]


def test_choices_are_files_that_programs_read(whole: Path) -> None:
    files = {path.stem: path for path in (whole / "run/choices").iterdir()}
    assert {"defaults-0", "sweep-0", "gradient-0", "gradient-1", "cma_es-1", "random_smooth-0"} <= files.keys()
    read = read_tuned(files["gradient-1"], "--params")
    chosen = choose(CONFIG.params, NAMED.params, NAMED.known_aliases(), NAMED.known_domains())
    vector, _, _ = ended(whole / "run")["gradient-1"]
    np.testing.assert_allclose([read[name] for name in chosen.names], chosen.values(jnp.asarray(vector)), rtol=1e-12)
    assert len(read_training(files["gradient-1"], "--params")) == 2


def test_a_killed_run_resumes_to_the_same(whole: Path, tmp_path: Path, monkeypatch) -> None:
    """Killed twice, in two methods; nothing is computed twice."""
    config = replace(
        CONFIG, out=tmp_path / "run", methods=("defaults", "gradient", "quasi_newton", "cma_es"), seeds_of_methods=(1,)
    )
    charged, answer, calls = Account._charged, Race.answer, []
    monkeypatch.setattr(Race, "answer", lambda self, asked: calls.extend(asked) or answer(self, asked))
    for last in ("quasi_newton-1", "cma_es-1"):

        def killed(self, kind, vectors, gradient, last=last):
            if self.name == last and self.batches == 5:
                raise KeyboardInterrupt
            return charged(self, kind, vectors, gradient)

        monkeypatch.setattr(Account, "_charged", killed)
        with pytest.raises(KeyboardInterrupt):
            program.run(config, build)
    monkeypatch.setattr(Account, "_charged", charged)
    assert program.run(config, build) == 0
    resumed, once = ended(tmp_path / "run"), ended(whole / "run")
    same({name: resumed[name] for name in ("gradient-1", "quasi_newton-1", "cma_es-1")}, once)
    cases = {path.name for path in (tmp_path / "run/cases").iterdir()}
    assert len(calls) == sum(name.startswith(("forward--", "gradient--", "way--")) for name in cases)


def test_more_seeds_and_methods_go_on_in_the_same_folder(tmp_path: Path) -> None:
    few = replace(
        CONFIG, budget=40, seeds_of_methods=(1,), methods=("defaults", "random", "cma_es"), out=tmp_path / "run"
    )
    program.run(few, build)
    before = ended(tmp_path / "run")
    program.run(replace(few, seeds_of_methods=(0, 1), methods=("random", "cma_es")), build)
    after = ended(tmp_path / "run")
    assert after.keys() == {"defaults-1", *(f"{m}-{s}" for m in ("random", "cma_es") for s in (0, 1))}
    same(before, after)
    assert not np.array_equal(after["random-0"][0], after["random-1"][0])
    with pytest.raises(UsageError, match="another --out, or --overwrite"):
        program.run(replace(few, rate=0.3), build)


def test_not_finite_loses_and_breaks_nothing(tmp_path: Path) -> None:
    """No gradient is finite: both methods keep the defaults. Where it is not finite in a part, quasi-Newton goes on elsewhere."""
    config = replace(CONFIG, methods=("defaults", "gradient", "quasi_newton"), budget=160, out=tmp_path / "all")
    assert program.run(config, broken(lambda p: p.potential.zeta > 0)) == 0
    row = values(tmp_path / "all")
    assert row["gradient_score"] == row["quasi_newton_score"] == row["defaults_score"]
    assert row["quasi_newton_not_finite"] > 20 and row["gradient_minus_defaults_high"] == 0
    assert program.run(replace(config, out=tmp_path / "part"), broken(lambda p: p.potential.zeta > 3.1)) == 0
    assert values(tmp_path / "part")["quasi_newton_score"] > row["defaults_score"]


def test_a_score_that_is_not_finite_is_not_chosen(tmp_path: Path) -> None:
    def made(config, named) -> Problem:
        whole = build(config, named)

        def measure(params, world):
            found = whole.measure(params, world)
            lost = params.potential.k_att > 0.06
            return {name: jnp.where(lost, jnp.nan, value) for name, value in found.items()}

        return replace(whole, measure=measure)

    config = replace(CONFIG, methods=("random", "cma_es", "sweep", "gradient"), budget=120, out=tmp_path / "run")
    assert program.run(config, made) == 0
    assert all(np.isfinite(numbers).all() for _, numbers, _ in ended(tmp_path / "run").values())
    row = values(tmp_path / "run")
    assert row["random_not_finite"] > 0 and min(row[f"{m}_score"] for m in config.methods) > 90


def test_the_ratio_is_measured_and_kept(tmp_path: Path) -> None:
    config = replace(CONFIG, ratio=0.0, budget=60, methods=("defaults", "gradient"), out=tmp_path / "run")
    program.run(config, build)
    one = values(tmp_path / "run")
    assert one["gradient_cost_ratio"] > 0 and one["cost_gradient_s"] / one["cost_forward_s"] == pytest.approx(one["gradient_cost_ratio"])  # fmt: skip
    program.run(config, build)
    assert values(tmp_path / "run") == one, "a resumed run counts by the same ratio"


def race_of(tmp_path: Path) -> Race:
    tuning = tune_config(CONFIG, 2)
    problem = build(tuning, NAMED)
    store = RunStore(tmp_path / "store", "m", {}, False)
    return Race(problem, Forward(problem, 4), Slopes(problem, tuning, 2), store, 3.0)


def test_an_account_counts_and_refuses(tmp_path: Path) -> None:
    """Scores by the formula in NumPy; slopes by differences of scores."""
    race = race_of(tmp_path)
    account = Account(race, "own", budget=17.0, reserve=2.0)
    assert account.affordable() == 7 and account.affordable(gradient=True) == 2
    points = starting(race.problem, 3, 0, 5)
    scores, losses = account.evaluate(points)
    assert account.spent == 10 and account.affordable(gradient=True) == 0
    x = np.array([race.problem.chosen.values(jnp.asarray(p)) for p in points], float)
    u, w, v = np.log(x[:, 0] / 0.05), np.log(x[:, 1] / 3e-5), np.log(x[:, 2] / 2.5)
    expected = np.mean([(0.5 + d - u) ** 2 for d in (-0.02, 0.02)], axis=0) + 5 * (v - u**2) ** 2 + 0.1 * w**2
    np.testing.assert_allclose(losses, expected, rtol=2e-4)
    np.testing.assert_allclose(scores, 100 - expected, rtol=1e-5)
    with pytest.raises(ValueError, match="cost more than is left"):
        account.gradients(points[:1])
    account.reserve = 0.0
    loss, slope = account.gradients(points[1:2])
    assert account.spent == 16 and loss[0] == pytest.approx(losses[1], rel=1e-5)
    steps = 0.01 * np.eye(3)
    ends = [Forward(race.problem, 4).measured(points[1] + sign * steps, race.problem.training)["loss"].mean(axis=1) for sign in (1, -1)]  # fmt: skip
    np.testing.assert_allclose(slope[0], (ends[0] - ends[1]) / 0.02, rtol=5e-3, atol=5e-3)

    vectors = grid_vectors(grid_settings(CONFIG, NAMED, race.problem.chosen), race.problem.chosen)
    reached = np.array([race.problem.chosen.values(jnp.asarray(p)) for p in vectors], float)
    assert vectors.shape == (48, 3)
    np.testing.assert_allclose([reached.min(0), reached.max(0)], [[0.01, 1e-6, 1.5], [0.2, 1e-3, 5]], rtol=1e-4)


def test_questions_share_calls(tmp_path: Path) -> None:
    """Each gets what it would alone, whatever place it has in a call, and its share of the time; a call has room for 4 or 2."""
    race, calls = race_of(tmp_path), []
    forward, slopes = race.forward.call, race.slopes.tuner.gradients
    race.forward.call = lambda v, w: calls.append(len(v)) or forward(v, w)
    race.slopes.tuner.gradients = lambda v, w: calls.append(-len(v)) or slopes(v, w)
    points = starting(race.problem, 3, 0, 6)
    asked = [Question(points[:3]), Question(points[3:4], True), Question(points[3:]), Question(points[4:], True)]
    race.forward.compile_s, race.slopes.compile_s = 0.0, 0.0
    together = race.answer(asked)
    assert calls == [4, 4, 2, 2, -2, -2], "two worlds; 6 metrics of settings, 3 gradients"
    for one, question in zip(together, asked, strict=True):
        alone = race.answer([question])[0]
        assert one.pop("seconds") > 0 and alone.pop("seconds") > 0 and one.keys() == alone.keys()
        for name, array in one.items():
            np.testing.assert_array_equal(array, alone[name])


def test_different_settings_of_least_loss_are_compared(tmp_path: Path) -> None:
    account = Account(race_of(tmp_path), "own", 1.0)
    account.vectors = [np.full(3, x) for x in (0.0, 1.0, 2.0, 1.0, 3.0, 4.0)]
    account.losses = [9.0, 2.0, 5.0, 2.0, np.inf, 1.0]
    assert least_first(account, 3) == [0, 5, 1] and least_first(account, 10) == [0, 5, 1, 2]


def test_runs_in_lockstep_are_those_one_by_one() -> None:
    """The same points as SciPy alone, in batches; and an error of a run comes out."""
    tilts = (np.array([1.0, 3.0]), np.array([0.5, -1.0]), np.array([2.0, 2.0]))
    alone = [minimize(lambda x, t=t: (np.sum((x - t) ** 4), 4 * (x - t) ** 3), t + 1, jac=True, method="L-BFGS-B") for t in tilts]  # fmt: skip
    found, sizes = {}, []

    def work(k):
        def play(ask):
            found[k] = minimize(lambda x: ask(np.append(x, k)), tilts[k] + 1, jac=True, method="L-BFGS-B")

        return play

    def answer(points, most=1000):
        some = points[: most - sum(sizes)]
        sizes.append(len(some))
        apart = [p[:2] - tilts[int(p[2])] for p in some]
        return [(np.sum(a**4), 4 * a**3) for a in apart]

    in_lockstep([work(k) for k in range(3)], answer)
    assert sizes[0] == 3 and sum(sizes) == sum(one.nfev for one in alone)
    for k, one in enumerate(alone):
        np.testing.assert_array_equal(found[k].x, one.x)

    sizes.clear()
    in_lockstep([work(k) for k in range(3)], lambda points: answer(points, 7))
    assert sizes == [3, 3, 1, 0]

    def wrong(ask):
        raise RuntimeError("own error")

    with pytest.raises(RuntimeError, match="own error"):
        in_lockstep([work(0), wrong], answer)


def test_intervals() -> None:
    """A constant lead has no width; the interval of world-wise leads holds the truth about as often as it says; unsure seeds widen it."""
    rng = np.random.default_rng(0)
    scores = rng.normal(60, 5, (3, 12))
    lead = difference(scores[:1] + 2, scores[:1], 0)
    assert (lead.mean, lead.low, lead.high) == pytest.approx((2, 2, 2)) and lead.word == "wins"
    held = []
    for k in range(150):
        base = rng.normal(60, 8, (1, 20))
        apart = difference(base + rng.normal(1, 2, (1, 20)), base, k)
        held.append(apart.low < 1 < apart.high)
    assert 0.86 < np.mean(held) < 0.99
    level = np.array([[-3.0], [0.0], [3.0]])
    sure, unsure = difference(scores[:1] + 0 * level, scores[:1], 0), difference(scores[:1] + level, scores[:1], 0)
    assert sure.high - sure.low < 1e-9 and unsure.high - unsure.low > 3 and unsure.word == "no difference shown"
    assert difference(np.array([[np.nan, 4.0]]), np.array([[2.0, 2.0]]), 0).mean == 0, "not finite counts as 0"
    assert np.isnan(difference(scores[:, :1], scores[:, :1], 0).low)


def test_seeds_that_end_alike_are_named() -> None:
    """Intervals over seeds say nothing of chance where all seeds ended with the same."""
    entry = lambda x: Entry(np.full(2, x), 90.0, 10.0, 1.0, 3, 0, np.zeros((2, 1)))  # noqa: E731
    scores = {"score_sound": np.array([[50.0, 60.0], [52.0, 63.0]])}
    found = Found({"gradient": [entry(1.0), entry(1.0)], "random": [entry(1.0), entry(2.0)]}, {"gradient": scores, "random": scores},
                  ["a", "b"], {}, {}, 10.0, 0)  # fmt: skip
    said = [line for line in verdicts(found) if "seeds ended" in line]
    assert len(said) == 1 and said[0].startswith("gradient: its 2 seeds ended with 1 setting,")
    assert rows(found)["gradient_choices"]["value"] == 1 and rows(found)["random_choices"]["value"] == 2


def test_lost_worlds_name_the_term() -> None:
    one = {"score_sound": np.array([[50.0, 70, 60, 5]]), "sound_time": np.array([[40.0, 50, 50, 50]]),
           "sound_jerk": np.array([[60.0, 50, 50, 50]]), "success": np.array([[1.0, 1, 1, 0]])}  # fmt: skip
    other = {"score_sound": np.array([[53.0, 60, 60.4, 70]]), "sound_time": np.array([[41.0, 50, 50, 50]]),
             "sound_jerk": np.array([[72.0, 50, 50, 50]]), "success": np.ones((1, 4))}  # fmt: skip
    found = lost_worlds(one, other, ["a", "b", "c", "d"], "score_sound", ("sound_time", "sound_jerk"))
    assert [(w.world, w.behind, w.term, w.by) for w in found] == [("d", 65, "success", 1), ("a", 3, "sound_jerk", 12)]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"methods": ("gradent",)}, "--methods gradent"),
        ({"methods": ()}, "--methods: accepted are one or more"),
        ({"budget": -1}, "--budget -1"),
        ({"at_once": 0}, "--at-once 0"),
        ({"share": 0.0}, "--share 0"),
        ({"ratio": -1.0}, "--ratio -1"),
        ({"seeds_of_methods": (1, 1)}, "--seeds-of-methods"),
        ({"held_out_seeds": ()}, "--held-out-seeds"),
        ({"held_out_people": ("reach_in",), "held_out_seeds": (0,)}, "in training and held out"),
        ({"params": ("K_att=0.01:0.2", "motion.speed=0.5:1.4")}, "motion.speed: the score is measured by it"),
        ({"params": ("safety.zone.red_speed=0.1:0.4",)}, "measured by it"),
        ({"grid": ("omega1=lin:1:2:2",)}, "among|parameters of --params"),
        ({"grid": ("zeta=lin:1:6:3",)}, "within 1.2:5"),
    ],
)
def test_messages(change, message, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=message):
        program.run(replace(CONFIG, out=tmp_path / "run", **change), build)


def test_options() -> None:
    config = parse(["--quick", "--smooth", "--methods", "gradient", "random"])
    assert (config.budget, config.starts, config.seeds_of_methods, len(config.people)) == (24, 1, (0,), 2)
    assert config.raced == ("gradient", "random", "random_smooth")
    assert parse([]) == TuneBenchmarkConfig(), "the shipped settings are the defaults"
    assert Entry.__dataclass_params__.frozen  # pyright: ignore[reportAttributeAccessIssue]
