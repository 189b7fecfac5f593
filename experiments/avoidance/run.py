"""One run: from options to cases, rows, page and figures."""

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

from hrcjax.cells.named_cell import NamedCell, find_cell
from hrcjax.cells.people import check_worlds, person_key, with_recordings
from hrcjax.cells.ur5 import CELLS
from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.case_store import FIGURES, RunStore, collect, locked_store
from hrcjax.lab.checks import among, at_least, check_outputs, each_once
from hrcjax.lab.parameters import leaf_names
from hrcjax.lab.progress import duration
from hrcjax.lab.provenance import LOADED_CODE, as_asked, fingerprint, program_digests, provenance
from hrcjax.lab.rows import write_rows
from hrcjax.tune.given import given_params

from .bench import Bench
from .config import LEAST, SECTIONS, AvoidanceConfig
from .gradients import AT_ONCE, Differentiator, settings
from .hands import hand_case
from .page import page
from .rows import Rows, all_rows, holds, table
from .unknown import obstacle_case

NO_RESULT = ("params", "out", "json", "page", "figures", "overwrite", "config", "quick", "sections", "obstacles", "gradients", "seeds", "scenes", "people", "recordings")  # fmt: skip
"""Options that do not change any single case, or whose effect is in the identity elsewhere."""
AFTERWARDS = ("rows.py", "page.py", "figures.py", "config.py", "run.py", "__main__.py")
"""Files that only read finished cases."""


def people(config: AvoidanceConfig) -> tuple[str, ...]:
    """Names and files of the people, those of the folder at the end."""
    return with_recordings(config.people, config.recordings)


def _check(config: AvoidanceConfig) -> None:
    among(config, "sections", SECTIONS)
    each_once(config, "sections", "scenes", "people")
    check_worlds(config.scenes, people(config))
    at_least(config, LEAST, "obstacles", "seeds", "gradients")
    check_outputs(config, "json", "page")


def identity(config: AvoidanceConfig, params: Any) -> dict[str, Any]:
    """Everything that decides the cases."""
    return {
        "options": {key: value for key, value in asdict(config).items() if key not in NO_RESULT},
        "params": leaf_names(params),
        "code": LOADED_CODE,
        "program": program_digests(Path(__file__).parent, AFTERWARDS),
    }


def wanted(config: AvoidanceConfig, bench: Bench, differ: Differentiator) -> dict[str, Callable[[], Mapping[str, Any]]]:
    """The cases by name."""
    cases: dict[str, Callable[[], Mapping[str, Any]]] = {}
    if "unknown_obstacle" in config.sections:
        cases |= {f"obstacle/{seed}": partial(obstacle_case, bench, seed) for seed in range(config.obstacles)}
    if {"hand_in_the_way", "stop_retreat"} & set(config.sections):
        for seed in range(config.seeds):
            for scene in config.scenes:
                for name in people(config):
                    cases[f"hand/{scene}-{seed}-{person_key(name)}"] = partial(hand_case, bench, scene, name, seed)
    if "knob_gradient" in config.sections:
        knobs = settings(config.gradients)
        for first in range(0, config.gradients, AT_ONCE):
            some = knobs[first : first + AT_ONCE]
            cases[f"gradient/{first}-{first + len(some)}"] = partial(differ.case, some)
    return cases


def run(config: AvoidanceConfig) -> int:
    """Runs or resumes; returns the exit status: 0."""
    begin = time.monotonic()
    _check(config)
    named = find_cell(config.cell, CELLS)
    given = given_params(named.params, config.params, "--params", named.known_domains())
    named = replace(named, params=given.params)
    mark = fingerprint(identity(config, named.params))
    folder = config.out or Path("runs") / f"avoidance-{mark[:8]}"
    about = {"program": "avoidance", "config": as_asked(config), "params": leaf_names(named.params), **provenance()}
    with locked_store(folder, mark, about, config.overwrite) as store:
        print(f"-> {folder}", file=sys.stderr, flush=True)
        if given.place:
            print(given.line(), file=sys.stderr, flush=True)
        return _measured(config, named, store, begin)


def _measured(config: AvoidanceConfig, named: NamedCell, store: RunStore, begin: float) -> int:
    folder = store.folder
    makes = wanted(config, Bench(named.cell, named.params), Differentiator(named))
    cases = collect(store, {name: (name, make) for name, make in makes.items()})
    sections = all_rows(cases, config.sections, named.cell.dt)
    write_rows(folder, config.json, sections)
    names: list[str] = []
    if config.figures:
        from .figures import draw  # here: drawing is slow to import, and not always wanted

        names = list(draw(folder / FIGURES, cases, named.cell.dt))
    if config.page:
        write_bytes(config.page, page(sections, config, people(config), names).encode())
    _report(sections, folder, time.monotonic() - begin)
    return 0


def _report(sections: Mapping[str, Rows], folder: Path, seconds: float) -> None:
    failed = []
    for section, rows in sections.items():
        print(table(section, rows) + "\n")
        failed += [name for name, entry in rows.items() if holds(section, name, entry["value"]) is False]
    print(f"{len(failed)} bars do not hold" + (f": {', '.join(failed)}" if failed else ""))
    print(f"Took {duration(seconds)}. Cases and rows: {folder}")
