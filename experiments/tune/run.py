"""One run: from options to tuned parameters, what they change, and figures."""

import math
import shlex
import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import jax
import numpy as np

from hrcjax.cells.digest import cell_digest
from hrcjax.io.motions.spec import motion_spec, people_of
from hrcjax.lab.case_store import CASES, FIGURES, RunStore, locked_store
from hrcjax.lab.checks import at_least, check_outputs
from hrcjax.lab.errors import UsageError
from hrcjax.lab.field_docs import leaf_docs
from hrcjax.lab.parameters import leaf_names
from hrcjax.lab.progress import duration
from hrcjax.lab.provenance import LOADED_CODE, PACKAGE, as_asked, file_digest, fingerprint, provenance, versions
from hrcjax.lab.rows import write_rows
from hrcjax.lab.table import aligned
from hrcjax.tune import LOSSES, choose, parse_losses
from hrcjax.tune.tuned import TUNED, read_training, read_tuned, write_tuned

from .config import TuneConfig
from .judge import Judge, comparison
from .loop import Tuner, tune
from .optimiser import Checkpoints, optimiser_versions
from .overlap import digests, not_new
from .problem import Problem, closed_loop, named_cell, world_names
from .report import above, felt_text, table, values_table
from .slices import make_slices, slices_text

NO_RESULT = ("config", "steps", "every", "start_from", "out", "json", "figures", "slices", "overwrite", "list")
"""Options that do not change the steps, or whose effect is in the identity elsewhere."""
AFTERWARDS = ("report.py", "figures.py", "live.py", "overlap.py", "slices.py", "config.py", "run.py", "__main__.py")
"""Files that do not decide the steps."""


def check(config: TuneConfig) -> None:
    """Refuses options before anything is computed."""
    at_least(config, 0, "steps", "seed", "slices")
    at_least(config, 1, "batch", "starts", "every")
    for option in ("rate", "clip"):
        if not 0 < getattr(config, option) < math.inf:
            raise UsageError(f"--{option} {getattr(config, option):g}: accepted is a number above 0")
    for option in ("scenes", "people", "seeds", "held_out_scenes", "held_out_people", "held_out_seeds"):
        values = getattr(config, option)
        if len(set(values)) < len(values):
            raise UsageError(f"--{option.replace('_', '-')}: a value is given twice")
    check_outputs(config, "json", new_folder=True)


def identity(config: TuneConfig, named: Any) -> dict[str, Any]:
    """Everything that decides the steps, as JSON values."""
    own, used = Path(__file__).parent, versions()
    people = {one for name in (*config.people, *config.held_out_people) for one in people_of(name)}
    files = [path for name in sorted(people) if (spec := motion_spec(name)) for path in spec.files]
    theirs = [sys.modules[word.partition(":")[0]].__file__ for word in config.loss if ":" in word]
    return {
        "options": {key: value for key, value in asdict(config).items() if key not in NO_RESULT},
        "params": leaf_names(named.params),
        "cell": cell_digest(named),
        "files": [file_digest(Path(path)) for path in (*files, *theirs) if path and Path(path).is_file()],
        "code": LOADED_CODE,
        "library": {path.name: file_digest(path) for path in sorted((PACKAGE / "tune").glob("*.py"))},
        "program": {path.name: file_digest(path) for path in sorted(own.glob("*.py")) if path.name not in AFTERWARDS},
        "versions": {name: used[name] for name in ("jax", "jaxlib", "numpy")} | optimiser_versions(),
        "backend": jax.default_backend(),
        "x64": bool(jax.config.jax_enable_x64),  # pyright: ignore[reportAttributeAccessIssue]  # set at run time
    }


def listed(named: Any) -> str:
    """All parameters and losses."""
    docs, domains = leaf_docs(named.params), named.known_domains()
    short = {full: alias for alias, full in named.known_aliases().items()}
    rows = [["parameter", "value", "unit", "domain", "alias", "meaning"]]
    for name, value in leaf_names(named.params).items():
        meaning, unit = docs.get(name, ("", "1"))
        rows.append([name, f"{value:g}", unit, "{:g}:{:g}".format(*domains[name]), short.get(name, ""), meaning])
    each = [["loss", "unit", "meaning"], *([one.name, one.unit, one.meaning] for one in LOSSES.values())]
    return aligned(rows) + "\n\n" + aligned(each)


def run(config: TuneConfig, build: Callable[..., Problem] = closed_loop) -> int:
    """Runs or resumes; returns the exit status: 0, or 3 where a loss was not finite.

    Args:
        build: of (config, cell), makes the problem.
    """
    begin = time.monotonic()
    check(config)
    named = named_cell(config)
    if config.list:
        print(listed(named))
        return 0
    choose(config.params, named.params, named.known_aliases(), named.known_domains(), config.frozen)
    parse_losses(config.loss)
    train, held = world_names(config)
    mark = fingerprint(identity(config, named))
    folder = config.out or Path("runs") / f"tune-{mark[:8]}"
    asked = as_asked(config)
    origin = provenance()
    about = {"program": "tune", "config": asked, "params": leaf_names(named.params), **origin}
    with locked_store(folder, mark, about, config.overwrite) as store:
        print(f"{len(train)} worlds to train in, {len(held)} held out -> {folder}", file=sys.stderr, flush=True)
        if config.overwrite:
            for name in (TUNED, "rows.json"):
                (folder / name).unlink(missing_ok=True)
        return _tuned(config, build(config, named), store, origin, begin)


def _command() -> str:
    """The command line, without the place of the program."""
    return shlex.join(["python", "-m", "experiments.tune", *sys.argv[1:]])


def _tuned(config: TuneConfig, problem: Problem, store: RunStore, origin: dict[str, Any], begin: float) -> int:
    folder, tuner = store.folder, Tuner(problem, config)
    before = read_training(config.start_from, "--from") if config.start_from else {}
    training, held = (
        {name: digests(problem.parts(w)) for name, w in some.items()} for some in (problem.training, problem.held_out)
    )
    if text := not_new(held, training, before):
        print(f"held out, not wholly new: {text}", file=sys.stderr, flush=True)
    kept = Checkpoints(folder / CASES / "steps")
    if config.steps and kept.newest(tuner.start) is None:
        print(felt_text(tuner.feel(), problem), flush=True)
    state, history = tune(tuner, kept)
    kept.close()

    judge = Judge(problem, store)
    first = np.asarray(tuner.start.vector[:1])
    candidates = np.concatenate([first, np.asarray(state.best), np.asarray(state.vector)])
    candidates, where = np.unique(candidates, axis=0, return_index=True)
    candidates, where = candidates[np.argsort(where)], np.sort(where)  # in order, the first one first
    found = judge.measured(candidates, problem.training, "training episode")
    losses = found["loss"].mean(axis=1)
    place = int(np.argmin(np.where(np.isfinite(losses), losses, np.inf)))
    pair = np.stack([first[0], candidates[place]])
    metrics = {"training": {name: value[[0, place]] for name, value in found.items()}}
    if problem.held_out:
        metrics["held out"] = judge.measured(pair, problem.held_out, "held-out episode")
    sections = {section: comparison(each, problem.units, config.seed) for section, each in metrics.items()}

    start, after = (np.asarray(problem.chosen.values(jax.numpy.asarray(v)), float) for v in pair)
    values = read_tuned(config.start_from, "--from") if config.start_from else {}
    values |= dict(zip(problem.chosen.names, map(float, after), strict=True))
    write_tuned(folder / TUNED, values, above(_command(), origin["commit"], problem, sections), before | training)
    rows = {
        f"tune_{section.replace(' ', '_')}": {
            name: entry for name, entry in entries.items() if np.isfinite(entry["value"])
        }
        for section, entries in sections.items()
    }
    rows["tune"] = {
        "steps": {"value": int(state.step), "unit": "1"},
        "not_finite": {"value": int(np.asarray(state.skipped).sum()), "unit": "1"},
    }
    if tuner.calls:
        rows["tune"] |= {
            "compile_s": {"value": tuner.compile_s, "unit": "s"},
            "step_s": {"value": tuner.run_s / tuner.calls, "unit": "s"},
        }
    write_rows(folder, config.json, rows)
    slices = make_slices(judge, *pair) if config.figures and len(problem.chosen.names) <= config.slices else None
    if config.figures:
        from .figures import draw  # here: drawing is slow to import, and not always wanted

        draw(folder / FIGURES, history, metrics, problem, max(int(where[place]) - 1, 0) % config.starts, slices)
    print("\n" + values_table(problem, start, after) + "\n\n" + table(sections, problem) + "\n")
    if slices is not None:
        print(slices_text(slices, problem) + "\n")
    if place == 0 and config.steps:
        print("No start became better than the parameters at the start over all training worlds: these are kept.")
    if tuner.calls:
        print(f"{duration(tuner.compile_s)} compilation of the gradient, {tuner.run_s / tuner.calls:.3g} s a step.")
    print(f"Took {duration(time.monotonic() - begin)}. Parameters: {folder / TUNED}")
    skipped = int(np.asarray(state.skipped).sum())
    if skipped:
        text = f"warning: {skipped} of {int(state.step) * config.starts} gradients were not finite; these starts went half the way back to their best then"
        print(text, file=sys.stderr, flush=True)
        return 3
    return 0
