"""One run of the program: from options to runs of all systems, rows, page and figures."""

import sys
import time
from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.cells.people import FASTEST, check_worlds, person_key, recording_notes, with_recordings
from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.case_store import FIGURES, Case, Make, RunStore, collect, locked_store
from hrcjax.lab.checks import among, at_least, check_outputs, each_once
from hrcjax.lab.errors import UsageError
from hrcjax.lab.page_figures import copy_figures
from hrcjax.lab.parameters import leaf_names
from hrcjax.lab.progress import duration
from hrcjax.lab.provenance import LOADED_CODE, as_asked, fingerprint, program_digests, provenance
from hrcjax.lab.rows import report, write_rows
from hrcjax.world import MOTIONS

from .baseline import octree, planning, timing
from .case import kept, measures_of, trace_of
from .config import SYSTEMS, HriConfig
from .numbers import our_params
from .page import page
from .rows import Pair, all_rows, holds
from .systems import BASELINES, SCENE, Bench

PARTS = {"pyoctomap": octree.installed, "ompl": planning.installed, "toppra": timing.installed}
"""What the baseline is made of, and whether it is there."""
AFTERWARDS = (
    "case.py", "measures.py", "rows.py", "page.py", "figures.py", "animation.py", "film.py", "config.py", "run.py", "numbers.py", "__main__.py",
    "__init__.py",
)  # fmt: skip
"""Files that only read finished runs."""


def people(config: HriConfig) -> tuple[str, ...]:
    """Names and files of the people, those of the folder at the end."""
    return with_recordings(config.people, config.recordings)


def _check(config: HriConfig) -> None:
    among(config, "systems", SYSTEMS)
    each_once(config, "systems", "people")
    check_worlds((SCENE,), people(config))
    at_least(config, 1, "seeds", "recording_seeds")
    at_least(config, 1, "seconds")
    if not 0 < config.speed <= 2 or not 0 < config.slow_scale <= 1:
        raise UsageError("--speed: accepted is above 0 up to 2 m/s; --slow-scale: above 0 up to 1")
    if set(config.systems) & set(BASELINES):
        missing = [name for name, there in PARTS.items() if not there()]
        if missing:
            raise UsageError(f"{', '.join(missing)} not installed; pip install 'hrcjax[baselines]', or --systems ours")
    check_outputs(config, "json", "page")


def identity() -> dict[str, Any]:
    """Everything but options that decides a run."""
    here = Path(__file__).parent
    parts = {name: metadata.version(name) for name, there in PARTS.items() if there()}
    program = {**program_digests(here, AFTERWARDS), **{f"baseline/{k}": v for k, v in program_digests(here / "baseline").items()}}  # fmt: skip
    return {"code": LOADED_CODE, "program": program, "parts": parts}


def bench_of(config: HriConfig) -> Bench:
    """The bench of the options."""
    slow = replace(config.baseline, acceleration_scale=config.slow_scale)
    return Bench(config.seconds, our_params(config.speed), config.baseline, slow)


def cases_of(config: HriConfig) -> list[tuple[str, int]]:
    """People and seeds of the pairs: the first seed of all people before the second, so that an interrupted run is as wide as can be."""
    names = people(config)
    found = []
    for seed in range(max(config.seeds, config.recording_seeds)):
        for name in names:
            last = (config.seeds if name in MOTIONS else config.recording_seeds) if name != "nobody" else 1
            found += [(name, seed)] if seed < last else []
    return found


def wanted(config: HriConfig, bench: Bench) -> dict[str, tuple[str, Make]]:
    """Every run by name, with the name of its file and what computes it."""
    runs: dict[str, tuple[str, Make]] = {}
    for name, seed in cases_of(config):
        for system in config.systems:
            settings = bench.slow if system == "baseline_slow" else bench.settings
            about: Any = leaf_names(bench.params)
            if system in BASELINES:
                about = [asdict(settings), about] if system == "baseline_guarded" else asdict(settings)
            mark = fingerprint({"seconds": config.seconds, "numbers": about})[:10]
            runs[key(system, name, seed)] = (
                f"{system}/{person_key(name)}-{seed}-{mark}", partial(_stored, bench, system, name, seed),
            )  # fmt: skip
    return runs


def key(system: str, name: str, seed: int) -> str:
    """Name of a run."""
    return f"{system}/{Path(name).stem}/{seed}"


def _stored(bench: Bench, system: str, name: str, seed: int) -> Mapping[str, Any]:
    return kept(bench.trace(system, name, seed))


def clean(name: str, seconds: float) -> bool:
    """Whether a motion is without jumps."""
    return name in MOTIONS or not any(f"over {FASTEST:g} m/s" in note for note in recording_notes(name, seconds))


def pairs_of(config: HriConfig, cases: Mapping[str, Case], ends: NDArray) -> list[Pair]:
    """The measures of all systems beside every person with every seed, as far as all of them are there."""
    pairs = []
    for name, seed in cases_of(config):
        keys = {system: key(system, name, seed) for system in config.systems}
        if all(one in cases for one in keys.values()):
            by = {system: measures_of(trace_of(cases[one]), ends) for system, one in keys.items()}
            pairs.append(Pair(f"{Path(name).stem} {seed}", clean(name, config.seconds), by))
    return pairs


def run(config: HriConfig) -> int:
    """Runs or resumes; returns the exit status: 0."""
    begin = time.monotonic()
    _check(config)
    mark = fingerprint(identity())
    folder = config.out or Path("runs") / f"hri-{mark[:8]}"
    about = {"program": "hri", "config": as_asked(config), **provenance()}
    with locked_store(folder, mark, about, config.overwrite) as store:
        print(f"-> {folder}", file=sys.stderr, flush=True)
        return _measured(config, store, begin)


def _measured(config: HriConfig, store: RunStore, begin: float) -> int:
    folder, bench = store.folder, bench_of(config)
    runs = wanted(config, bench)
    if config.finished:
        cases = {name: found for name, (file, _) in runs.items() if (found := store.get(file)) is not None}
    else:
        cases = collect(store, runs)
    ends = np.stack([np.asarray(bench.scene.start, float), np.asarray(bench.scene.goal, float)])
    pairs = pairs_of(config, cases, ends)
    rows = all_rows(pairs, config.systems)
    write_rows(folder, config.json, {"hri": rows})
    names: list[str] = []
    if config.figures and pairs:
        from .figures import draw  # here: drawing is slow to import, and not always wanted

        names = draw(folder / FIGURES, config, bench, cases, pairs)
    if config.page:
        write_bytes(
            config.page, page(rows, pairs, config, copy_figures(folder / FIGURES, config.page, names, "hri")).encode()
        )
    report("hri", rows, holds)
    print(f"Took {duration(time.monotonic() - begin)}. Runs and rows: {folder}")
    return 0
