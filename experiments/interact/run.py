"""One run of the program: from options to runs of all functions, rows, page and figures."""

import sys
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.cells.people import check_worlds, person_key, with_recordings
from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.case_store import FIGURES, Case, Make, RunStore, collect, locked_store
from hrcjax.lab.checks import among, at_least, check_outputs, each_once
from hrcjax.lab.page_figures import copy_figures
from hrcjax.lab.parameters import leaf_names
from hrcjax.lab.progress import duration
from hrcjax.lab.provenance import LOADED_CODE, as_asked, fingerprint, program_digests, provenance
from hrcjax.lab.rows import report, write_rows
from hrcjax.world import MOTIONS

from .bench import SCENE, VARIANTS, Bench, params_of
from .config import InteractConfig
from .measures import direction_of
from .page import page
from .play import FUNCTIONS
from .rows import all_rows, holds
from .truth import truth_of

AFTERWARDS = ("measures.py", "rows.py", "page.py", "figures.py", "config.py", "run.py", "__main__.py", "__init__.py")
"""Files that only read finished runs."""
COMPARED = ("follow_close", "follow_contact", "hand_over_near")
"""Variants that a quick run leaves out."""
HANDS = {"follow": "led_hand", "hand_over": "held_out_hand"}
"""Function -> its person."""


def _check(config: InteractConfig) -> None:
    among(config, "functions", FUNCTIONS)
    each_once(config, "functions", "people")
    check_worlds((SCENE,), with_recordings(config.people, config.recordings))
    at_least(config, 1, "seeds", "hands")
    at_least(config, 10, "seconds", "task_seconds")
    check_outputs(config, "json", "page")


def people_of(config: InteractConfig, function: str) -> list[tuple[str, int]]:
    """People and seeds of a function."""
    if function in HANDS:
        return [(HANDS[function], seed) for seed in range(config.hands)]
    names = with_recordings(config.people, config.recordings)
    return [(name, seed) for seed in range(config.seeds) for name in names if seed == 0 or name in MOTIONS]


def variants_of(config: InteractConfig) -> list[str]:
    """The variants of a run."""
    return [name for name, v in VARIANTS.items() if v.function in config.functions and not (config.quick and name in COMPARED)]  # fmt: skip


def benches_of(config: InteractConfig) -> dict[str, Bench]:
    """What plays each function."""
    usual = Bench(config.seconds)
    return {name: Bench(config.task_seconds) if name == "give_way" else usual for name in FUNCTIONS}


def wanted(config: InteractConfig, benches: Mapping[str, Bench]) -> dict[str, tuple[str, Make]]:
    """Every run by name, with the name of its file and what computes it."""
    runs: dict[str, tuple[str, Make]] = {}
    for name in variants_of(config):
        bench = benches[VARIANTS[name].function]
        mark = fingerprint({"seconds": bench.seconds})[:6]
        for person, seed in people_of(config, VARIANTS[name].function):
            file = f"{name}/{person_key(person)}-{seed}-{mark}"
            runs[key(name, person, seed)] = (file, partial(_stored, bench, name, person, seed))
    return runs


def key(variant: str, person: str, seed: int) -> str:
    """Name of a run."""
    return f"{variant}/{Path(person).stem} {seed}"


def _stored(bench: Bench, name: str, person: str, seed: int) -> Mapping[str, Any]:
    found = bench.play(name, person, seed)
    truth = truth_of(bench.cell, bench.person(person, seed), found["q"])
    return found | {
        "separation_true": truth.separation, "tool_distance": truth.tool_distance, "hand_true": truth.hand,
        "hand_radius": truth.hand_radius, "axis": truth.axis, "fastest": truth.fastest,
    }  # fmt: skip


def by_variant(cases: Mapping[str, Case]) -> dict[str, dict[str, Case]]:
    """Runs by variant, then by person and seed."""
    found: dict[str, dict[str, Case]] = {}
    for name, case in cases.items():
        variant, person = name.split("/", 1)
        found.setdefault(variant, {})[person] = case
    return found


def directions_of(bench: Bench, names: list[str]) -> dict[str, NDArray]:
    """Direction from the hand to the tool, by variant [1]."""
    return {name: direction_of(name, bench.scene) for name in names}


def run(config: InteractConfig) -> int:
    """Runs or resumes; returns the exit status: 0."""
    begin = time.monotonic()
    _check(config)
    numbers = {name: leaf_names(params_of(v)) for name, v in VARIANTS.items()}
    mark = fingerprint({"code": LOADED_CODE, "program": program_digests(Path(__file__).parent, AFTERWARDS), "numbers": numbers})  # fmt: skip
    folder = config.out or Path("runs") / f"interact-{mark[:8]}"
    about = {"program": "interact", "config": as_asked(config), **provenance()}
    with locked_store(folder, mark, about, config.overwrite) as store:
        print(f"-> {folder}", file=sys.stderr, flush=True)
        return _measured(config, store, begin)


def _measured(config: InteractConfig, store: RunStore, begin: float) -> int:
    folder, benches = store.folder, benches_of(config)
    bench = benches["give_way"]
    cases = by_variant(collect(store, wanted(config, benches)))
    ends = np.stack([np.asarray(bench.scene.start, float), np.asarray(bench.scene.goal, float)])
    directions = directions_of(bench, variants_of(config))
    rows = all_rows(cases, directions, ends, bench.cell.dt)
    write_rows(folder, config.json, {"interact": rows})
    names: list[str] = []
    if config.figures:
        from .figures import draw  # here: drawing is slow to import, and not always wanted

        names = draw(folder / FIGURES, cases, directions, bench.cell.dt)
    if config.page:
        write_bytes(
            config.page,
            page(rows, cases, config, copy_figures(folder / FIGURES, config.page, names, "interact")).encode(),
        )
    report("interact", rows, holds)
    print(f"Took {duration(time.monotonic() - begin)}. Runs and rows: {folder}")
    return 0
