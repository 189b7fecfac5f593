"""One run: from options to rows and page."""

import math
import sys
from pathlib import Path

from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.case_store import locked_store
from hrcjax.lab.checks import at_least, check_outputs
from hrcjax.lab.errors import UsageError
from hrcjax.lab.provenance import as_asked, fingerprint, provenance
from hrcjax.lab.rows import table

from .about import about, read, stored
from .arm import arm_rows
from .config import PlanBenchmarkConfig
from .page import page
from .points.page import printed
from .points.run import chosen, identity, measure_points
from .problems import read_problems
from .results import SECTION, Origins, merged, read_kept, write_results
from .rows import Rows, holds


def _check(config: PlanBenchmarkConfig) -> None:
    """Everything that can be refused before anything is measured."""
    at_least(config, 0, "settings", "seed", "unseen", "lagrange", "families", "peers", "processes")
    at_least(config, 1, "scenes")
    if not 0 < config.budget < math.inf:
        raise UsageError(f"--budget {config.budget:g}: accepted is a time above 0 s")
    if len(set(config.planners)) < len(config.planners):
        raise UsageError("--planners: each once")
    check_outputs(config, "json", "page")
    if config.json and config.page and config.json.resolve() == config.page.resolve():
        raise UsageError(f"--json and --page are both {config.json}; give two files")
    if config.space != "point" and config.problems.exists():
        read_problems(config.problems, config.count)


def _check_kept(config: PlanBenchmarkConfig) -> None:
    """Refuses, before anything is measured, a file of rows that cannot be read, or whose rows make no page."""
    kept, origins = read_kept(config.json, config.space)
    if config.page:
        try:
            page(kept, (), origins)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise UsageError(
                f"{config.json}: its rows make no page ({error!r}); remove it or choose another --json"
            ) from error


def measured(config: PlanBenchmarkConfig, planners: tuple[str, ...]) -> tuple[Rows, Origins, list[str]]:
    """The rows of a run, what those of each space were measured on, and figures; all that is finished is in its folder."""
    mark = fingerprint(identity(config.budget))
    folder = config.out or Path("runs") / f"plan_benchmark-{mark[:8]}"
    rows: Rows = {}
    origins: Origins = {}
    figures: list[str] = []
    with locked_store(
        folder, mark, {"program": SECTION, "config": as_asked(config), **provenance()}, config.overwrite
    ) as store:
        print(f"-> {folder}", file=sys.stderr, flush=True)
        if config.space != "arm":
            origins["point"] = read(store.take("about", lambda: stored(about()))[0])
            found = measure_points(
                store,
                config.scenes,
                config.seed,
                config.unseen,
                config.lagrange,
                planners,
                config.budget,
                config.figures,
            )
            rows, figures = dict(found.rows), found.figures
            print(printed(rows) + "\n")
        if config.space != "point":
            mine, origin = arm_rows(
                store,
                config.problems,
                config.count,
                config.settings,
                config.families,
                config.peers,
                config.processes,
            )
            if origin:
                origins["arm"] = origin
            print(table(SECTION, mine) + "\n")
            rows = {**mine, **rows}
    return rows, origins, figures


def run(config: PlanBenchmarkConfig) -> int:
    """Measures; returns the exit status: 0."""
    _check(config)
    _check_kept(config)
    planners = chosen(config.planners) if config.space != "arm" else ()
    rows, origins, figures = measured(config, planners)
    kept, kept_origins = read_kept(config.json, config.space)  # again: others may have written meanwhile
    section, origins = merged(kept, rows, config.space), kept_origins | origins
    if config.json:
        write_results(config.json, section, origins)
    if config.page:
        old = config.page.read_text(encoding="utf-8") if config.page.exists() else ""
        write_bytes(config.page, page(section, figures, origins, old).encode())
    missed = [name for name, entry in rows.items() if holds(name, entry["value"]) is False]
    print(f"{len(missed)} bars do not hold" + (f": {', '.join(missed)}" if missed else ""))
    return 0
