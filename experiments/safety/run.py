"""One run: from options to cases, rows, page and figures."""

import sys
import time
from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.cells.named_cell import NamedCell, find_cell
from hrcjax.cells.people import check_worlds, person_key, with_recordings
from hrcjax.cells.ur5 import CELLS
from hrcjax.io.motions.spec import motion_spec, people_of
from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.case_store import FIGURES, Case, Make, RunStore, collect, locked_store
from hrcjax.lab.checks import among, at_least, check_outputs, each_once
from hrcjax.lab.errors import UsageError
from hrcjax.lab.parameters import leaf_names
from hrcjax.lab.progress import duration
from hrcjax.lab.provenance import LOADED_CODE, as_asked, fingerprint, program_digests, provenance
from hrcjax.lab.rows import table, write_rows
from hrcjax.safety import SafetyParams
from hrcjax.tune.given import given_params

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
    return with_recordings(config.people, config.recordings)


def _check(config: SafetyConfig) -> None:
    among(config, "parts", PARTS)
    each_once(config, "parts", "scenes", "people")
    for name in people(config):
        if len(people_of(name)) > 1:
            raise UsageError(f"--people {name}: accepted is one person at a time")
    check_worlds(config.scenes, people(config))
    at_least(config, 1, "seeds", "states", "episodes")
    check_outputs(config, "json", "page")


def identity(config: SafetyConfig, params: Any) -> dict[str, Any]:
    """Everything that decides the cases."""
    return {
        "options": {key: value for key, value in asdict(config).items() if key not in NO_RESULT},
        "params": leaf_names(params),
        "code": LOADED_CODE,
        "program": program_digests(Path(__file__).parent, AFTERWARDS),
    }


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


def finished(store: RunStore, cases: Mapping[str, tuple[str, Make]]) -> dict[str, Case]:
    """The cases that are there."""
    there = {name: store.get(file) for name, (file, _) in cases.items()}
    return {name: case for name, case in there.items() if case is not None}


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
    about = {"program": "safety", "config": as_asked(config), "params": leaf_names(named.params), **provenance()}
    with locked_store(folder, mark, about, config.overwrite) as store:
        print(f"-> {folder}", file=sys.stderr, flush=True)
        if given.place:
            print(given.line(), file=sys.stderr, flush=True)
        return _measured(config, named, store, begin)


def _measured(config: SafetyConfig, named: NamedCell, store: RunStore, begin: float) -> int:
    folder, clock = store.folder, named.params.motion.clock
    asked = wanted(config, named)
    cases = finished(store, asked) if config.finished else collect(store, asked)
    if len(cases) < len(asked):
        print(f"{len(cases)} of {len(asked)} cases are finished", file=sys.stderr, flush=True)
    rows = all_rows(cases, named.cell.dt, float(clock.acceleration), float(clock.jerk))
    write_rows(folder, config.json, {"safety": rows})
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
