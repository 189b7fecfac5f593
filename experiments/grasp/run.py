"""One run: from options to objects, rows, page and figures."""

import sys
import time
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from hrcjax.grasp.motion_policy import MotionPolicyParams
from hrcjax.grasp.params import GraspParams
from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.case_store import FIGURES, Make, RunStore, collect, locked_store
from hrcjax.lab.checks import among, at_least, check_outputs
from hrcjax.lab.errors import UsageError
from hrcjax.lab.page_figures import copy_figures
from hrcjax.lab.parameters import leaf_names
from hrcjax.lab.progress import duration
from hrcjax.lab.provenance import LOADED_CODE, as_asked, fingerprint, program_digests, provenance
from hrcjax.lab.rows import report, write_rows

from .case import make_bench
from .config import GraspConfig
from .objects import NAMES
from .page import page
from .rows import all_rows, holds

RESULT = ("seed", "hand", "frames", "friction", "slippery")
"""Options that change the result of an object."""
AFTERWARDS = ("rows.py", "page.py", "figures.py", "picture.py", "animation.py", "config.py", "run.py", "__main__.py", "__init__.py")  # fmt: skip
"""Files that only read finished objects."""


def _check(config: GraspConfig) -> None:
    among(config, "shapes", NAMES)
    if len(set(config.shapes)) < len(config.shapes):
        raise UsageError("--shapes: accepted is each once")
    at_least(config, 1, "poses", "frames")
    at_least(config, 0, "seed")
    frictions = [config.friction, *config.slippery]
    fit = all(0 <= mu <= 2 for mu in frictions)  # not so where one is no number
    if not fit or len({round(100 * mu) for mu in frictions}) < len(frictions):
        raise UsageError("--friction, --slippery: accepted are coefficients from 0 to 2, each hundredth once")
    check_outputs(config, "json", "page")


def identity(config: GraspConfig) -> dict[str, Any]:
    """Everything that decides what becomes of an object."""
    return {
        "options": {key: asdict(config)[key] for key in RESULT},
        "params": leaf_names(GraspParams()),
        "motion": leaf_names(MotionPolicyParams()),
        "code": LOADED_CODE,
        "program": program_digests(Path(__file__).parent, AFTERWARDS),
    }


def wanted(config: GraspConfig) -> dict[str, tuple[str, Make]]:
    """Every object by name, and what computes it."""
    bench = make_bench(config.frames, config.hand, (config.friction, *config.slippery))
    names = [(shape, k) for shape in config.shapes or NAMES for k in range(config.poses)]
    return {f"{shape}/{k}": (f"{shape}/{k}", partial(bench.case, shape, config.seed, k)) for shape, k in names}


def run(config: GraspConfig) -> int:
    """Runs or resumes; returns the exit status: 0."""
    begin = time.monotonic()
    _check(config)
    mark = fingerprint(identity(config))
    folder = config.out or Path("runs") / f"grasp-{mark[:8]}"
    about = {"program": "grasp", "config": as_asked(config), "params": leaf_names(GraspParams()), **provenance()}
    with locked_store(folder, mark, about, config.overwrite) as store:
        print(f"-> {folder}", file=sys.stderr, flush=True)
        return _measured(config, store, begin)


def _measured(config: GraspConfig, store: RunStore, begin: float) -> int:
    folder = store.folder
    cases = collect(store, wanted(config))
    rows = all_rows(cases, (config.friction, *config.slippery))
    write_rows(folder, config.json, {"grasp": rows})
    names: list[str] = []
    if config.figures:
        from .figures import draw  # here: drawing is slow to import, and not always wanted

        names = draw(folder / FIGURES, cases, (config.friction, *config.slippery))
    if config.page:
        write_bytes(
            config.page, page(rows, config, copy_figures(folder / FIGURES, config.page, names, "grasp")).encode()
        )
    report("grasp", rows, holds)
    print(f"Took {duration(time.monotonic() - begin)}. Objects and rows: {folder}")
    return 0
