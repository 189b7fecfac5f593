"""One run: from options to cases, rows, page and figures."""

import json
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

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
from hrcjax.lab.rows import read_results, table
from hrcjax.lab.run_folder import folder_name
from hrcjax.lab.writable import check_writable
from hrcjax.safety import SafetyParams
from hrcjax.tune.given import given_params
from hrcjax.world import scene_named

from .always_stop import margins
from .bench import Bench, is_clean
from .config import MODES, PARTS, SafetyConfig
from .deviation import deviation_case
from .monte_carlo import Chance
from .page import page
from .rows import Rows, all_rows, holds

NO_RESULT = ("finished", "params", "out", "json", "page", "figures", "overwrite", "config", "quick", "parts", "episodes", "states", "seeds", "scenes", "people", "recordings")  # fmt: skip
"""Options that do not change any single case, or whose effect is in its name."""
AFTERWARDS = (
    "rows.py",
    "page.py",
    "figures.py",
    "config.py",
    "run.py",
    "limits.py",
    "lost_time.py",
    "__main__.py",
    "__init__.py",
)
"""Files that only read finished cases."""
PART, STILL, SCALED = 256, 4, 6
"""Episodes by chance in a case; of so many cases those of the first round through the scenes are played in variations too; episodes of the part path."""


def people(config: SafetyConfig) -> tuple[str, ...]:
    """Names and files of the people, those of the folder at the end."""
    found = sorted(config.recordings.glob("*.bvh")) if config.recordings else []
    return (*config.people, *(str(path) for path in found))


def _check(config: SafetyConfig) -> None:
    unknown = [name for name in config.parts if name not in PARTS]
    if unknown:
        raise UsageError(f"--parts {unknown[0]}: accepted are {', '.join(PARTS)}")
    if config.recordings is not None and not config.recordings.is_dir():
        raise UsageError(f"--recordings {config.recordings}: no such folder")
    for option in ("parts", "scenes", "people"):
        values = getattr(config, option)
        if not values or len(set(values)) < len(values):
            raise UsageError(f"--{option}: accepted are one or more values, each once")
    try:
        for scene in config.scenes:
            scene_named(scene, 0)
        for name in people(config):
            if len(people_of(name)) > 1:
                raise ValueError(f"--people {name}: accepted is one person at a time")
            make_person(name, scene_named(config.scenes[0], 0), 0, 1.0)
    except (ValueError, OSError) as error:
        raise UsageError(one_line(error)) from error
    for option in ("seeds", "states", "episodes"):
        if getattr(config, option) < 1:
            raise UsageError(f"--{option} {getattr(config, option)}: accepted is 1 or more")
    for option in ("json", "page"):
        file = getattr(config, option)
        if file is not None:
            if not file.parent.is_dir():
                raise UsageError(f"no folder {file.parent} for --{option}")
            check_writable(file.parent, f"--{option}")


def identity(config: SafetyConfig, params: Any) -> dict[str, Any]:
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


def stop_case(safety: SafetyParams, states: int) -> Mapping[str, Any]:
    """Random states, in double precision."""
    with jax.enable_x64(True):
        params = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), safety)
        keys = jax.random.split(jax.random.key(0), states)
        play = jax.jit(margins, static_argnums=(3, 4))
        blind = eqx.tree_at(lambda p: p.ssm.reaction_time, params, jnp.zeros((), jnp.float64))
        asked = {
            "": (params, False, True),
            "_harsh": (params, True, True),
            "_old": (params, False, False),
            "_no_reaction": (blind, False, True),
        }
        found: dict[str, Any] = {"states": states}
        for name, (law, harsh, encoders) in asked.items():
            stopped, _ = play(law, params.ssm, keys, harsh, encoders)
            found[f"margin{name}"] = np.min(stopped.moving_least)
        return found


Make = Callable[[], Mapping[str, Any]]


def wanted(config: SafetyConfig, named: NamedCell) -> dict[str, tuple[str, Make]]:
    """Name of every case -> name of its file, how to make it."""
    cell, params = named.cell, named.params
    bench = Bench(cell, params)
    cases: dict[str, tuple[str, Make]] = {}
    if "stop" in config.parts:
        cases["stop"] = f"stop-{config.states}", partial(stop_case, params.safety, config.states)
    if "episodes" in config.parts:
        for scene in config.scenes:
            for name in ("nobody", *people(config)):
                for seed in range(1 if motion_spec(name) and scene != "clutter" else config.seeds):
                    for mode in MODES:
                        key = f"episode/{mode}/{scene}-{seed}-{person_key(name)}"
                        cases[key] = key, partial(bench.case, mode, scene, name, seed)
    if "path" in config.parts:
        for scene in config.scenes:
            cases[f"path/{scene}"] = f"path/{scene}", partial(deviation_case, cell, params, scene, SCALED)
    if "chance" in config.parts:
        clean = tuple(name for name in people(config) if is_clean(name, cell.ticks * cell.dt))
        chance = Chance(cell, params, clean)
        mark = fingerprint({"people": [person_key(name) for name in clean]})[:8]
        for number, first in enumerate(range(0, config.episodes, PART)):
            scene, count = config.scenes[number % len(config.scenes)], min(PART, config.episodes - first)
            end = f"{mark}-{scene}-{first}-{count}"
            cases[f"chance/{end}"] = f"chance/{end}", partial(chance.case, scene, 0, first, count)
            if number % STILL < len(config.scenes) and number < 2 * STILL:
                cases[f"still/{end}"] = f"still/{end}", partial(chance.case, scene, 0, first, count, False)
                cases[f"ways/{end}"] = f"ways/{end}", partial(chance.case, scene, 0, first, count, True, np.inf)
    return cases


def collect(store: RunStore, cases: Mapping[str, tuple[str, Make]], finished: bool = False) -> dict[str, Case]:
    """All cases, computed as far as they are not there; or those that are there."""
    if finished:
        there = {name: store.get(file) for name, (file, _) in cases.items()}
        return {name: case for name, case in there.items() if case is not None}
    found: dict[str, Case] = {}
    with Progress(len(cases), unit="case") as progress:
        for name, (file, make) in cases.items():
            found[name], computed = store.take(file, make)
            progress.advance(1, None if computed else 0.0, name)
    return found


def run(config: SafetyConfig) -> int:
    """Runs or resumes; returns the exit status: 0."""
    begin = time.monotonic()
    _check(config)
    named = find_cell(config.cell, CELLS)
    given = given_params(named.params, config.params, "--params", named.known_domains())
    named = replace(named, params=given.params)
    if not isinstance(named.params.safety, SafetyParams):
        raise UsageError(f"--cell {config.cell}: accepted is a cell with the monitor of hrcjax.safety")
    mark = fingerprint(identity(config, named.params))
    folder = config.out or Path("runs") / f"safety-{mark[:8]}"
    asked = {key: str(value) if isinstance(value, Path) else value for key, value in asdict(config).items()}
    about = {"program": "safety", "config": asked, "params": leaf_names(named.params), **provenance()}
    with locked_store(folder, mark, about, config.overwrite) as store:
        print(f"-> {folder}", file=sys.stderr, flush=True)
        if given.place:
            print(given.line(), file=sys.stderr, flush=True)
        return _measured(config, named, store, begin)


def _measured(config: SafetyConfig, named: NamedCell, store: RunStore, begin: float) -> int:
    folder, clock = store.folder, named.params.motion.clock
    asked = wanted(config, named)
    cases = collect(store, asked, config.finished)
    if len(cases) < len(asked):
        print(f"{len(cases)} of {len(asked)} cases are finished", file=sys.stderr, flush=True)
    rows = all_rows(cases, named.cell.dt, float(clock.acceleration), float(clock.jerk))
    write_bytes(folder / "rows.json", (json.dumps({"safety": rows}, indent=1) + "\n").encode())
    if config.json:
        write_bytes(config.json, (json.dumps(read_results(config.json) | {"safety": rows}, indent=1) + "\n").encode())
    names: list[str] = []
    if config.figures:
        from .figures import draw  # here: drawing is slow to import, and not always wanted

        names = list(draw(folder / FIGURES, cases, named.cell.dt, named.params.safety))
    if config.page:
        write_bytes(
            config.page,
            page(rows, config, people(config), names, named.params.safety, (len(cases), len(asked))).encode(),
        )
    _report(rows, folder, time.monotonic() - begin)
    return 0


def _report(rows: Rows, folder: Path, seconds: float) -> None:
    print(table("safety", rows))
    failed = [name for name, entry in rows.items() if holds(name, entry["value"]) is False]
    print(f"\n{len(failed)} bars do not hold" + (f": {', '.join(failed)}" if failed else ""))
    print(f"Took {duration(seconds)}. Cases and rows: {folder}")
