"""One run: from options to finished methods, held-out metrics, rows, page and figures."""

import math
import shlex
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.cells.named_cell import NamedCell
from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.case_store import FIGURES, RunStore
from hrcjax.lab.checks import among, at_least, check_outputs, each_once
from hrcjax.lab.errors import UsageError
from hrcjax.lab.progress import Progress, duration
from hrcjax.lab.provenance import as_asked, fingerprint, program_digests, provenance, versions
from hrcjax.lab.rows import write_rows
from hrcjax.tune import choose, parse_losses
from hrcjax.tune.tuned import write_tuned

from ..tune.overlap import digests
from ..tune.problem import Problem, named_cell, world_names
from ..tune.run import identity as tuning_identity
from .account import Race
from .compare import known
from .config import BY_GRADIENT, METHODS, TuneBenchmarkConfig
from .forward import Forward
from .grid_sweep import grid_settings, grid_vectors
from .kinds import kinds
from .methods import ONE_SEED, Entry, played, seeds_of
from .page import page
from .problem import SCORE, Build, race_problem, refuse_yardsticks, tune_config
from .results import Found, rows, table, verdicts
from .slopes import Slopes

NO_RESULT = ("config", "methods", "seeds_of_methods", "smooth", "seed", "out", "json", "page", "figures", "overwrite")
"""Options that do not change what a method with a seed finds."""
AFTERWARDS = ("compare.py", "kinds.py", "results.py", "page.py", "figures.py", "config.py", "run.py", "__main__.py")
"""Files that only read what methods found."""
SECTION = "tune_benchmark"
CHOICES = "choices"
"""Folder of the parameters that each method ended with."""


def check(config: TuneBenchmarkConfig) -> None:
    """Refuses options before anything is computed."""
    among(config, "methods", METHODS)
    at_least(config, 0, "budget", "population", "seed")
    at_least(config, 1, "starts", "choices", "at_once")
    if config.population == 1:
        raise UsageError("--population 1: accepted is 0, or 2 or more")
    for option, above in (("share", True), ("rate", True), ("clip", True), ("ratio", False)):
        value = getattr(config, option)
        if not (value > 0 or (value == 0 and not above)) or not math.isfinite(value):
            raise UsageError(f"--{option} {value:g}: accepted is a number {'above' if above else 'of at least'} 0")
    each_once(
        config, "methods", "seeds_of_methods", "scenes", "people", "seeds", "held_out_scenes", "held_out_people", "held_out_seeds"
    )  # fmt: skip
    if min(config.seeds_of_methods) < 0:
        raise UsageError(f"--seeds-of-methods {min(config.seeds_of_methods)}: accepted is 0 or more")
    check_outputs(config, "json", "page", new_folder=True)


def identity(config: TuneBenchmarkConfig, named: NamedCell, training: int) -> dict[str, Any]:
    """Everything that decides what a method with a seed finds, as JSON values."""
    return {
        "tuning": tuning_identity(tune_config(config, training), named),
        "options": {key: value for key, value in asdict(config).items() if key not in NO_RESULT},
        "program": program_digests(Path(__file__).parent, AFTERWARDS),
        "versions": {"cmaes": metadata.version("cmaes"), "scipy": versions()["scipy"]},
    }


def command(argv: Sequence[str]) -> str:
    """The command line, without the place of the program."""
    return shlex.join(["python", "-m", "experiments.tune_benchmark", *argv])


def run(config: TuneBenchmarkConfig, build: Build = race_problem, argv: Sequence[str] | None = None) -> int:
    """Runs or resumes; returns the exit status: 0.

    Args:
        build: of (options of the tuning, cell), makes the problem.
        argv: the command line, for the page.
    """
    begin = time.monotonic()
    check(config)
    tuning = tune_config(config, 1)
    train, held = world_names(tuning)
    tuning = tune_config(config, len(train))
    named = named_cell(tuning)
    chosen = choose(config.params, named.params, named.known_aliases(), named.known_domains(), config.frozen)
    refuse_yardsticks(chosen.names)
    parse_losses(config.loss)
    grid = grid_settings(config, named, chosen)
    budget = float(config.budget or max(round(config.share * grid.count * len(train)), 1))
    mark = fingerprint(identity(config, named, len(train)))
    folder = config.out or Path("runs") / f"tune_benchmark-{mark[:8]}"
    origin = provenance()
    store = RunStore(folder, mark, {"program": SECTION, "config": as_asked(config), **origin}, config.overwrite)
    print(
        f"{len(train)} worlds to train in, {len(held)} held out, {budget:.0f} forward episodes a method and seed -> {folder}",
        file=sys.stderr, flush=True,
    )  # fmt: skip
    problem = build(tuning, named)
    forward = Forward(problem, config.at_once)
    slopes = Slopes(problem, tuning, config.starts * len(config.seeds_of_methods))
    costs = _costs(config, store, forward, slopes)
    race = Race(problem, forward, slopes, store, config.ratio or costs.get("ratio", 1.0))
    entries = _races(config, race, budget, grid_vectors(grid, chosen))
    found = Found(entries, _held_out(entries, race), list(problem.held_out), problem.units, costs, budget, config.seed)
    _write(config, found, problem, origin, folder, command(sys.argv[1:] if argv is None else argv))
    print(f"\n{table(found)}\n\n" + "\n".join(verdicts(found)))
    print(f"Took {duration(time.monotonic() - begin)}. Rows: {folder / 'rows.json'}")
    return 0


def _costs(config: TuneBenchmarkConfig, store: RunStore, forward: Forward, slopes: Slopes) -> dict[str, float]:
    """Times and ratio of the gradient, measured once in a run; none if they are not needed."""
    if config.ratio or not set(BY_GRADIENT) & set(config.methods):
        return {}
    case, new = store.take(f"cost/gradient-{slopes.at_once}", lambda: slopes.cost(forward))
    costs = {name: float(value) for name, value in case.items()}
    if new:
        text = f"the gradient of an episode counts as {costs['ratio']:.3g} forward ones; {duration(costs['gradient_compile_s'])} to compile it"
        print(text, file=sys.stderr, flush=True)
    return costs


def _races(config: TuneBenchmarkConfig, race: Race, budget: float, grid: NDArray) -> dict[str, list[Entry]]:
    """All methods with all seeds."""
    plan = {
        method: float(race.worlds * (len(grid) if method == "sweep" else 1)) if method in ONE_SEED else budget
        for method in config.raced
    }
    entries: dict[str, list[Entry]] = {}
    total, told = round(sum(cost * len(seeds_of(config, method)) for method, cost in plan.items())), [0.0]
    one_at_a_time = threading.Lock()
    with Progress(total, unit="episode") as progress:

        def advance(cost: float, seconds: float, note: str) -> None:
            with one_at_a_time:
                whole = min(round(told[0] + cost), total) - round(told[0])
                told[0] += cost
                progress.advance(whole, seconds, note)

        race.advance = advance
        for method, cost in plan.items():
            entries[method] = played(race, config, method, cost, grid)
            for seed, entry in zip(seeds_of(config, method), entries[method], strict=True):
                progress.say(
                    f"{method}, seed {seed}: training score {entry.score:.2f} after {entry.spent:.0f} episodes, {duration(entry.seconds)}"
                )
    return entries


def _held_out(entries: dict[str, list[Entry]], race: Race) -> dict[str, dict[str, NDArray]]:
    """Metrics (seed, world) of every method's choices, in the worlds that are held out."""
    vectors = np.stack([entry.vector for each in entries.values() for entry in each])
    mark = fingerprint({"vectors": vectors.tolist()})[:12]
    columns: list[dict[str, NDArray]] = []
    with Progress(len(race.problem.held_out), unit="held-out world") as progress:
        for name, world in race.problem.held_out.items():
            case, new = race.store.take(f"held_out/{name}-{mark}", lambda w=world: race.forward.measured(vectors, {"": w}))  # fmt: skip
            columns.append({key: value[:, 0] for key, value in case.items()})
            progress.advance(1, None if new else 0.0)
    table = {key: np.stack([column[key] for column in columns], axis=1) for key in columns[0]}
    found, first = {}, 0
    for method, each in entries.items():
        found[method] = {key: value[first : first + len(each)] for key, value in table.items()}
        first += len(each)
    return found


def _write(
    config: TuneBenchmarkConfig, found: Found, problem: Problem, origin: dict[str, Any], folder: Path, line: str
) -> None:
    sections = {SECTION: rows(found)}
    _write_choices(config, found, problem, origin, folder / CHOICES, line)
    write_rows(folder, config.json, sections)
    drawn = ["none"]
    if config.figures:
        from .figures import draw  # here: drawing is slow to import, and not always wanted

        drawn = draw(folder / FIGURES, found)
    if config.page:
        said = {"command": line, "folder": str(folder), "figures": "; ".join(drawn)}
        used = origin | {"versions": origin["versions"] | {"cmaes": metadata.version("cmaes"), "optax": metadata.version("optax")}}  # fmt: skip
        write_bytes(
            config.page, page(found, problem, config, used, said, kinds(*world_names(tune_config(config, 1)))).encode()
        )


def _write_choices(
    config: TuneBenchmarkConfig, found: Found, problem: Problem, origin: dict[str, Any], folder: Path, line: str
) -> None:
    """Every choice as a file that --params of the programs reads."""
    folder.mkdir(exist_ok=True)
    training = {str(name): digests(problem.parts(world)) for name, world in problem.training.items()}
    for method, entries in found.entries.items():
        for seed, entry, scores in zip(config.seeds_of_methods, entries, known(found.scores[method]), strict=False):
            values = np.asarray(problem.chosen.values(jnp.asarray(entry.vector)), float)
            above = "\n".join([
                f"Parameters that {method} ended with, seed {seed}.", "", f"Command: {line}", f"Code: {origin['commit']}",
                f"{SCORE}: {entry.score:.2f} in training, {scores.mean():.2f} in {len(scores)} held-out worlds",
            ])  # fmt: skip
            write_tuned(folder / f"{method}-{seed}.toml", dict(zip(problem.chosen.names, values, strict=True)), above, training)  # fmt: skip
