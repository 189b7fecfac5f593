"""One run: from options to cases, rows, pages and figures."""

import sys
import time
from collections.abc import Callable, Mapping
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any

from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.case_store import FIGURES, Case, RunStore, locked_store
from hrcjax.lab.checks import among, at_least, check_outputs, each_once
from hrcjax.lab.progress import Progress, duration
from hrcjax.lab.provenance import LOADED_CODE, as_asked, file_digest, fingerprint, provenance
from hrcjax.lab.rows import write_rows

from .claims import claims_page
from .config import READINGS, ReproduceConfig
from .episode import episode_case
from .fair import field_clearance
from .page import command, page, summary
from .paths import DEFAULT, SCENE, paths_case
from .printed import TIMES
from .rows import all_rows, holds, told
from .rrt_star import STAGES, missing_ompl, rrt_case
from .times import times_case

AFTERWARDS = ("rows", "derived", "scores", "page", "time_tables", "score_tables", "claim", "rules", "claims", "robotica_claims", "hri_claims", "corrections", "config", "run", "__main__", "__init__")  # fmt: skip
"""Files that only read finished cases."""


def _check(config: ReproduceConfig) -> None:
    among(config, "readings", READINGS)
    each_once(config, "readings")
    at_least(config, 0, "seeds")
    at_least(config, 1, "samples")
    check_outputs(config, "json", "page", "claims")


def ompl_version() -> str:
    """Version of the OMPL that searches, or that there is none."""
    try:
        return metadata.version("ompl")
    except metadata.PackageNotFoundError:
        return "not installed"


def identity() -> dict[str, Any]:
    """Everything that decides the cases."""
    own = sorted(Path(__file__).parent.glob("*.py"))
    deciding = [path for path in own if path.stem not in AFTERWARDS and not path.stem.endswith(("figure", "figures"))]
    return {"code": LOADED_CODE, "program": {path.name: file_digest(path) for path in deciding}, "ompl": ompl_version()}


def wanted(
    config: ReproduceConfig, cases: Mapping[str, Case], searching: bool
) -> dict[str, tuple[str, Callable[[], Mapping[str, Any]]]]:
    """Name of every case -> name of its file, how to make it."""
    found: dict[str, tuple[str, Callable[[], Mapping[str, Any]]]] = {}
    for reading in config.readings:
        found[f"times/{reading}"] = f"times/{reading}", partial(times_case, reading)
        found[f"paths/{reading}"] = f"paths/{reading}", partial(paths_case, reading)
    reading = told(config.readings)
    found["episode"] = (
        f"episode/{reading}",
        lambda: episode_case(reading, cases[f"paths/{reading}"]["planned"][-1, DEFAULT]),
    )
    if searching:
        for where in config.readings:
            for row in TIMES:
                if row.rrt is not None:
                    name = f"rrt/{where}-{row.key}"
                    found[name] = f"{name}-{config.seeds}-{config.samples}", partial(rrt_case, where, row, config.seeds, config.samples)  # fmt: skip
        if not config.quick:
            for where in config.readings:
                long = partial(rrt_case, where, SCENE, config.seeds, STAGES[-1])
                found[f"rrt-long/{where}"] = f"rrt-long/{where}-{config.seeds}", long
                found[f"rrt-equal/{where}"] = (
                    f"rrt-equal/{where}-{config.seeds}",
                    lambda where=where, long=long: long(margin=field_clearance(where, cases[f"times/{where}"])),
                )
    return found


def collect(store: RunStore, config: ReproduceConfig, searching: bool) -> dict[str, Case]:
    """All cases, computed as far as they are not there."""
    found: dict[str, Case] = {}
    cases = wanted(config, found, searching)
    with Progress(len(cases), unit="case") as progress:
        for name, (file, make) in cases.items():
            found[name], computed = store.take(file, make)
            progress.advance(1, None if computed else 0.0, name)
    return found


def run(config: ReproduceConfig) -> int:
    """Runs or resumes; returns the exit status: 0."""
    begin = time.monotonic()
    _check(config)
    mark = fingerprint(identity())
    folder = config.out or Path("runs") / f"reproduce-{mark[:8]}"
    searching = config.seeds > 0
    if searching and (why := missing_ompl()):
        print(why, file=sys.stderr, flush=True)
        searching = False
    with locked_store(
        folder, mark, {"program": "reproduce", "config": as_asked(config), **provenance()}, config.overwrite
    ) as store:
        print(f"-> {folder}", file=sys.stderr, flush=True)
        cases = collect(store, config, searching)
        rows = all_rows(cases, config.readings)
        write_rows(folder, config.json, {"reproduce": rows})
        names: list[str] = []
        if config.figures:
            from .figures import draw  # here: drawing is slow to import, and not always wanted

            names = list(draw(folder / FIGURES, cases, config.readings))
        if config.page:
            write_bytes(config.page, page(cases, rows, config, names).encode())
        if config.claims:
            write_bytes(config.claims, claims_page(rows, command(config)).encode())
    print(summary(cases, rows, config.readings))
    failed = [name for name, entry in rows.items() if holds(name, entry["value"]) is False]
    print(f"{len(failed)} bars do not hold" + (f": {', '.join(failed)}" if failed else ""))
    print(f"Took {duration(time.monotonic() - begin)}. Cases and rows: {folder}")
    return 0
