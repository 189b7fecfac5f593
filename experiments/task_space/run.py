"""One run of the program: random tables with rows, or a recording into scene files; page and figures."""

import sys
import time
from pathlib import Path

from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.case_store import FIGURES, Case, RunStore, collect, locked_store
from hrcjax.lab.checks import at_least, check_outputs
from hrcjax.lab.errors import UsageError
from hrcjax.lab.page_figures import copy_figures
from hrcjax.lab.progress import duration
from hrcjax.lab.provenance import LOADED_CODE, as_asked, fingerprint, program_digests, provenance
from hrcjax.lab.rows import report, write_rows

from .config import FRESH, TaskSpaceConfig
from .evaluate import wanted
from .page import page
from .recorded import check_input, frames_text, map_input
from .rows import Rows, all_rows, holds

AFTERWARDS = ("rows.py", "page.py", "figures.py", "config.py", "run.py", "recorded.py", "__main__.py", "__init__.py")
"""Files that do not decide what is stored."""


def _check(config: TaskSpaceConfig) -> None:
    if not config.evaluate and not config.input:
        raise UsageError("nothing to do: give --evaluate, --input RECORDING, or both")
    at_least(config, 1, "tables", "images")
    at_least(config, 0, "frames", "first", "fresh")
    both = sorted(set(config.numbers) & set(config.fresh_numbers))
    if both:
        raise UsageError(f"--first, --tables and --fresh: table {both[0]} is among both; fresh tables begin at {FRESH}")
    check_outputs(config, "json", "page")
    if config.json and not config.evaluate:
        raise UsageError("--json needs --evaluate")
    check_input(config)


def run(config: TaskSpaceConfig) -> int:
    """Runs or resumes; returns the exit status: 0."""
    begin = time.monotonic()
    _check(config)
    mark = fingerprint({"code": LOADED_CODE, "program": program_digests(Path(__file__).parent, AFTERWARDS), "input": list(config.input)})  # fmt: skip
    folder = config.out or Path("runs") / f"task_space-{mark[:8]}"
    about = {"program": "task_space", "config": as_asked(config), **provenance()}
    with locked_store(folder, mark, about, config.overwrite) as store:
        print(f"-> {folder}", file=sys.stderr, flush=True)
        cases: list[Case] = []
        others: list[Case] = []
        rows: Rows = {}
        fresh: Rows = {}
        names: list[str] = []
        if config.evaluate:
            every = list(collect(store, wanted((*config.numbers, *config.fresh_numbers), config.images)).values())
            cases, others = every[: config.tables], every[config.tables :]
            rows, fresh = all_rows(cases), all_rows(others) if others else {}
            write_rows(folder, config.json, {"task_space": rows} | ({"task_space_fresh": fresh} if fresh else {}))
            names = _tables(store, cases, config)
            report("task_space", rows, holds)
            if fresh:
                report("task_space_fresh", fresh, holds)
        frames = map_input(config, folder) if config.input else []
        if config.page:
            text = page(rows, cases, config, copy_figures(folder / FIGURES, config.page, names, "task-space"), frames_text(frames, copy_figures(folder / FIGURES, config.page, [f.figure for f in frames if f.figure], "task-space")), fresh, others)  # fmt: skip
            write_bytes(config.page, text.encode())
    print(f"Took {duration(time.monotonic() - begin)}. Results: {folder}")
    return 0


def _tables(store: RunStore, cases: list[Case], config: TaskSpaceConfig) -> list[str]:
    """Figures of the tables; their names."""
    if not config.figures:
        return []
    import numpy as np

    from hrcjax.task_space import obstacle_grid

    from .evaluate import mapped
    from .figures import size_figure, table_figure, write_grid  # here: drawing is slow to import, and not always wanted
    from .tables import table_of

    place = store.folder / FIGURES
    place.mkdir(exist_ok=True)
    size_figure(place / "errors.png", cases)
    most = config.numbers[int(np.argmax([len(case["kind"]) for case in cases]))]
    found, _, _ = mapped(most, config.images)
    grid = obstacle_grid(found, 0.01, np.array([-0.25, 0.0]), np.array([1.05, 0.9]))
    write_grid(place, grid)
    table_figure(place / "table.png", table_of(most), found, grid)
    return ["table.png", "errors.png"]
