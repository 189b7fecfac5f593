"""One run of the program: from options to trials, rows, page and figures."""

import sys
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from hrcjax.hand import PointingParams
from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.case_store import FIGURES, Case, Make, RunStore, collect, locked_store
from hrcjax.lab.checks import among, at_least, check_outputs, each_once
from hrcjax.lab.errors import UsageError
from hrcjax.lab.page_figures import copy_figures
from hrcjax.lab.parameters import leaf_names
from hrcjax.lab.progress import duration
from hrcjax.lab.provenance import LOADED_CODE, as_asked, fingerprint, program_digests, provenance
from hrcjax.lab.rows import report, write_rows
from hrcjax.sim import PlaceParams
from hrcjax.world import SCENES

from .bench import Bench
from .config import PointingConfig
from .page import page
from .rows import all_rows, holds, together
from .trials import KINDS

AFTERWARDS = ("rows.py", "page.py", "figures.py", "config.py", "run.py", "__main__.py", "__init__.py")
"""Files that only read finished trials."""


def _check(config: PointingConfig) -> None:
    among(config, "kinds", tuple(KINDS))
    among(config, "scenes", tuple(SCENES))
    each_once(config, "kinds", "scenes")
    at_least(config, 1, "seeds", "trials")
    at_least(config, 0, "first")
    if not 0 <= config.pixel <= 50:
        raise UsageError(f"--pixel {config.pixel:g}: accepted are 0 to 50")
    if not 0 <= config.shared <= 1:
        raise UsageError(f"--shared {config.shared:g}: accepted are 0 to 1")
    check_outputs(config, "json", "page")


def scenes_of(config: PointingConfig) -> list[tuple[str, int]]:
    """Scenes and seeds."""
    return [(name, config.first + k) for name in config.scenes for k in range(config.seeds if name == "clutter" else 1)]


def wanted(config: PointingConfig, bench: Bench) -> dict[str, tuple[str, Make]]:
    """Every set of trials by name, with the name of its file and what computes it."""
    mark = fingerprint({"pixel": config.pixel, "shared": config.shared, "trials": config.trials})[:6]
    return {
        f"{kind}/{scene} {seed}": (f"{kind}/{scene}-{seed}-{mark}", partial(bench.play, scene, seed, kind, config.trials))
        for scene, seed in scenes_of(config)
        for kind in config.kinds
    }  # fmt: skip


def by_kind(cases: Mapping[str, Case]) -> dict[str, dict[str, Case]]:
    """Sets of trials by kind, then by scene."""
    found: dict[str, dict[str, Case]] = {}
    for name, case in cases.items():
        kind, scene = name.split("/", 1)
        found.setdefault(kind, {})[scene] = case
    return found


def run(config: PointingConfig) -> int:
    """Runs or resumes; returns the exit status: 0."""
    begin = time.monotonic()
    _check(config)
    numbers = {"pointing": leaf_names(PointingParams()), "place": leaf_names(PlaceParams())}
    mark = fingerprint({"code": LOADED_CODE, "program": program_digests(Path(__file__).parent, AFTERWARDS), "numbers": numbers})  # fmt: skip
    folder = config.out or Path("runs") / f"pointing-{mark[:8]}"
    about = {"program": "pointing", "config": as_asked(config), **provenance()}
    with locked_store(folder, mark, about, config.overwrite) as store:
        print(f"-> {folder}", file=sys.stderr, flush=True)
        return _measured(config, store, begin)


def _measured(config: PointingConfig, store: RunStore, begin: float) -> int:
    folder, bench = store.folder, Bench(config.pixel, config.shared)
    cases = by_kind(collect(store, wanted(config, bench)))
    joined = {kind: together(list(own.values())) for kind, own in cases.items()}
    rows = all_rows(joined)
    write_rows(folder, config.json, {"pointing": rows})
    names: list[str] = []
    if config.figures:
        from .figures import draw  # here: drawing is slow to import, and not always wanted

        names = draw(folder / FIGURES, {kind: next(iter(own.values())) for kind, own in cases.items()}, joined)
    if config.page:
        figures = copy_figures(folder / FIGURES, config.page, names, "pointing")
        write_bytes(
            config.page,
            page(rows, joined, config, [f"{name} {seed}" for name, seed in scenes_of(config)], figures).encode(),
        )
    report("pointing", rows, holds)
    print(f"Took {duration(time.monotonic() - begin)}. Trials and rows: {folder}")
    return 0
