"""One run: from options to cases, rows, page and figures."""

import json
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

from hrcjax.cells.named_cell import NamedCell, find_cell
from hrcjax.cells.people import make_person
from hrcjax.cells.ur5 import CELLS
from hrcjax.io.motions.spec import motion_spec, people_of
from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.case_store import FIGURES, Case, RunStore, locked_store
from hrcjax.lab.errors import UsageError, one_line
from hrcjax.lab.parameters import leaf_names
from hrcjax.lab.progress import Progress, duration
from hrcjax.lab.provenance import LOADED_CODE, file_digest, fingerprint, provenance
from hrcjax.lab.rows import read_results
from hrcjax.lab.run_folder import folder_name
from hrcjax.lab.writable import check_writable
from hrcjax.tune.given import given_params
from hrcjax.world import scene_named

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
    found = sorted(config.recordings.glob("*.bvh")) if config.recordings else []
    return (*config.people, *(str(path) for path in found))


def _check(config: AvoidanceConfig) -> None:
    unknown = [name for name in config.sections if name not in SECTIONS]
    if unknown:
        raise UsageError(f"--sections {unknown[0]}: accepted are {', '.join(SECTIONS)}")
    if config.recordings is not None and not config.recordings.is_dir():
        raise UsageError(f"--recordings {config.recordings}: no such folder")
    for option in ("sections", "scenes", "people"):
        values = getattr(config, option)
        if not values or len(set(values)) < len(values):
            raise UsageError(f"--{option}: accepted are one or more values, each once")
    try:
        for scene in config.scenes:
            scene_named(scene, 0)
        for name in people(config):
            for one in people_of(name):
                make_person(one, scene_named(config.scenes[0], 0), 0, 1.0)
    except (ValueError, OSError) as error:
        raise UsageError(one_line(error)) from error
    for option in ("obstacles", "seeds", "gradients"):
        if getattr(config, option) < LEAST:
            raise UsageError(f"--{option} {getattr(config, option)}: accepted is {LEAST} or more")
    for option in ("json", "page"):
        file = getattr(config, option)
        if file is not None:
            if not file.parent.is_dir():
                raise UsageError(f"no folder {file.parent} for --{option}")
            check_writable(file.parent, f"--{option}")


def identity(config: AvoidanceConfig, params: Any) -> dict[str, Any]:
    """Everything that decides the cases."""
    own = Path(__file__).parent
    return {
        "options": {key: value for key, value in asdict(config).items() if key not in NO_RESULT},
        "params": leaf_names(params),
        "code": LOADED_CODE,
        "program": {path.name: file_digest(path) for path in sorted(own.glob("*.py")) if path.name not in AFTERWARDS},
    }


def person_key(name: str) -> str:
    """A person's name in that of a case; of a file with its digest."""
    spec = motion_spec(name)
    if spec is None:
        return folder_name(name)
    return "-".join([folder_name(spec.path.stem), *(file_digest(path)[:8] for path in spec.files)])


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


def collect(store: RunStore, cases: Mapping[str, Callable[[], Mapping[str, Any]]]) -> dict[str, Case]:
    """All cases, computed as far as they are not there."""
    found: dict[str, Case] = {}
    with Progress(len(cases), unit="case") as progress:
        for name, make in cases.items():
            found[name], computed = store.take(name, make)
            progress.advance(1, None if computed else 0.0, name)
    return found


def run(config: AvoidanceConfig) -> int:
    """Runs or resumes; returns the exit status: 0."""
    begin = time.monotonic()
    _check(config)
    named = find_cell(config.cell, CELLS)
    given = given_params(named.params, config.params, "--params", named.known_domains())
    named = replace(named, params=given.params)
    mark = fingerprint(identity(config, named.params))
    folder = config.out or Path("runs") / f"avoidance-{mark[:8]}"
    asked = {key: str(value) if isinstance(value, Path) else value for key, value in asdict(config).items()}
    about = {"program": "avoidance", "config": asked, "params": leaf_names(named.params), **provenance()}
    with locked_store(folder, mark, about, config.overwrite) as store:
        print(f"-> {folder}", file=sys.stderr, flush=True)
        if given.place:
            print(given.line(), file=sys.stderr, flush=True)
        return _measured(config, named, store, begin)


def _measured(config: AvoidanceConfig, named: NamedCell, store: RunStore, begin: float) -> int:
    folder = store.folder
    cases = collect(store, wanted(config, Bench(named.cell, named.params), Differentiator(named)))
    sections = all_rows(cases, config.sections, named.cell.dt)
    write_bytes(folder / "rows.json", (json.dumps(sections, indent=1) + "\n").encode())
    if config.json:
        write_bytes(config.json, (json.dumps(read_results(config.json) | sections, indent=1) + "\n").encode())
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
