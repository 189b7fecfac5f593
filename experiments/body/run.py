"""One run of the program: from options to images, tracks, rows, page and figures."""

import sys
import time
from collections.abc import Mapping
from dataclasses import asdict
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any

from hrcjax.cells.people import check_worlds, person_key, with_recordings
from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.case_store import FIGURES, Case, Make, RunStore, collect, locked_store
from hrcjax.lab.checks import among, at_least, check_outputs, each_once
from hrcjax.lab.page_figures import copy_figures
from hrcjax.lab.progress import duration
from hrcjax.lab.provenance import LOADED_CODE, as_asked, fingerprint, program_digests, provenance
from hrcjax.lab.rows import Row, read_results, report, write_rows

from .config import PARTS, BodyConfig
from .loop import LoopBench
from .loop_rows import definition as loop_definition
from .loop_rows import loop_rows
from .page import page
from .rows import all_rows, holds
from .seen import SCENE, Bench
from .tracks import VARIANTS, measured, with_places

AFTERWARDS = ("rows.py", "loop_rows.py", "page.py", "figures.py", "config.py", "run.py", "__main__.py", "__init__.py")
"""Files that only read finished cases."""


def _check(config: BodyConfig) -> None:
    among(config, "parts", PARTS)
    among(config, "variants", tuple(VARIANTS))
    each_once(config, "parts", "variants", "people")
    check_worlds((SCENE,), with_recordings(config.people, config.recordings))
    at_least(config, 0, "seed", "compared")
    at_least(config, 1, "seeds")
    at_least(config, 2, "seconds")
    check_outputs(config, "json", "page")


def wanted(config: BodyConfig) -> dict[str, tuple[str, Make]]:
    """Every case by tracker and person, with the name of its file and what computes it."""

    @cache
    def bench() -> Bench:
        return Bench(config.seconds)

    @cache
    def loop() -> LoopBench:
        return LoopBench(config.seconds)

    @lru_cache(maxsize=1)  # trackers of one person follow each other
    def seen(name: str, seed: int) -> dict[str, Any]:
        return with_places(bench().seen(name, seed))

    def track_case(name: str, variant: str, seed: int) -> Mapping[str, Any]:
        return measured(seen(name, seed), variant)

    def loop_case(name: str, seed: int) -> Mapping[str, Any]:
        return loop().case(name, seed)

    people = with_recordings(config.people, config.recordings)
    found: dict[str, tuple[str, Make]] = {}
    for seed in range(config.seed, config.seed + config.seeds):
        mark = fingerprint({"seconds": config.seconds, "seed": seed})[:6]
        end = "" if seed == config.seed else f", seed {seed}"
        if "loop" in config.parts:
            for name in people:
                file = f"loop/{person_key(name)}-{mark}"
                found[f"loop/{Path(name).stem}{end}"] = (file, partial(loop_case, name, seed))
        if "track" not in config.parts:
            continue
        for k, name in enumerate(people):
            compared = k < config.compared and seed == config.seed
            for variant in config.variants if compared else config.variants[:1]:
                file = f"{variant}/{person_key(name)}-{mark}"
                found[f"{variant}/{Path(name).stem}{end}"] = (file, partial(track_case, name, variant, seed))
    return found


def by_variant(cases: Mapping[str, Case]) -> dict[str, dict[str, Case]]:
    """Cases by tracker, then by person."""
    found: dict[str, dict[str, Case]] = {}
    for name, case in cases.items():
        variant, person = name.split("/", 1)
        found.setdefault(variant, {})[person] = case
    return found


def with_other_parts(before: Mapping[str, Row], track: Mapping[str, Row], loop: Mapping[str, Row]) -> dict[str, Row]:
    """Rows of both parts; of one that was not run those that were there.

    Args:
        before: rows of the file.
        track: rows of the part track; none: it was not run.
        loop: the same of the part loop.
    """
    of_loop = {name: entry for name, entry in before.items() if loop_definition(name)}
    of_track = {name: entry for name, entry in before.items() if name not in of_loop}
    return dict(track or of_track) | dict(loop or of_loop)


def run(config: BodyConfig) -> int:
    """Runs or resumes; returns the exit status: 0."""
    begin = time.monotonic()
    _check(config)
    numbers = {name: asdict(params) for name, params in VARIANTS.items()}
    mark = fingerprint({"code": LOADED_CODE, "program": program_digests(Path(__file__).parent, AFTERWARDS), "numbers": numbers})  # fmt: skip
    folder = config.out or Path("runs") / f"body-{mark[:8]}"
    about = {"program": "body", "config": as_asked(config), **provenance()}
    with locked_store(folder, mark, about, config.overwrite) as store:
        print(f"-> {folder}", file=sys.stderr, flush=True)
        return _measured(config, store, begin)


def _measured(config: BodyConfig, store: RunStore, begin: float) -> int:
    folder = store.folder
    cases = by_variant(collect(store, wanted(config)))
    loop = cases.pop("loop", {})
    before = read_results(config.json).get("body", {}) if config.json else {}
    rows = with_other_parts(before, all_rows(cases) if cases else {}, loop_rows(loop) if loop else {})
    write_rows(folder, config.json, {"body": rows})
    names: list[str] = []
    if config.figures and "full" in cases:
        from .figures import draw  # here: drawing is slow to import, and not always wanted

        names = draw(folder / FIGURES, cases["full"])
    if config.page:
        write_bytes(
            config.page, page(rows, config, copy_figures(folder / FIGURES, config.page, names, "body")).encode()
        )
    report("body", rows, holds)
    print(f"Took {duration(time.monotonic() - begin)}. Cases and rows: {folder}")
    return 0
