"""One run: from options to rows and page."""

import json
import math
import sys
from dataclasses import asdict
from pathlib import Path

from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.errors import UsageError
from hrcjax.lab.rows import read_results, table
from hrcjax.lab.writable import check_writable
from hrcjax.plan import arm_body

from .checker import Checker
from .config import PlanBenchmarkConfig
from .page import page
from .points.page import printed
from .points.run import measure_points
from .problems import TIGHT, read_problems, thin_arm
from .rows import POINT, Rows, holds, problem_rows, row
from .solve import solve_all
from .speed import alone_ms, robotica_speed

INFLATION = 0.005
"""Of the arm's spheres in the problems [m]."""
SECTION = "plan_benchmark"


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _check(config: PlanBenchmarkConfig) -> None:
    if config.settings < 0:
        raise UsageError(f"--settings {config.settings}: accepted is 0 or more")
    for option, least in (("scenes", 1), ("seed", 0)):
        if getattr(config, option) < least:
            raise UsageError(f"--{option} {getattr(config, option)}: accepted is {least} or more")
    if not 0 < config.budget < math.inf:
        raise UsageError(f"--budget {config.budget:g}: accepted is a time above 0 s")
    if len(set(config.planners)) < len(config.planners):
        raise UsageError("--planners: each once")
    for option in ("json", "page"):
        file: Path | None = getattr(config, option)
        if file is not None:
            if not file.parent.is_dir():
                raise UsageError(f"no folder {file.parent} for --{option}")
            check_writable(file.parent, f"--{option}")


def arm_rows(config: PlanBenchmarkConfig) -> Rows:
    """Rows of the whole arm."""
    rows: Rows = {}
    if config.problems.exists():
        problems = read_problems(config.problems, config.count)
        arm = thin_arm()
        checker = Checker(arm)
        reference_free = checker.free(problems, range(len(problems)), problems.reference)
        body = arm_body(arm, INFLATION, floor=0.0, tight=TIGHT)
        rows |= problem_rows(problems, reference_free, solve_all(body, checker, problems, _say))
    else:
        _say(f"no problems at {config.problems}: their rows are left out; --problems FILE names another place")
    if config.settings:
        _say(f"{config.settings} settings in the Robotica paper's scene")
        speed = robotica_speed(config.settings)
        rows |= {
            "settings_per_s": row(speed["settings_per_s"], "1/s"),
            "compile_s": row(speed["compile_s"], "s"),
            "robotica_kept": row(speed["kept"], "1"),
            "ms_alone": row(alone_ms(), "ms"),
        }
    return rows


def merged(old: Rows, new: Rows, space: str) -> Rows:
    """The new rows, and of the old ones those of the space that was not measured."""
    kept = {k: v for k, v in old.items() if space == ("arm" if k.startswith(POINT) else "point")}
    return {**kept, **new} if space == "point" else {**new, **kept}


def run(config: PlanBenchmarkConfig) -> int:
    """Measures; returns the exit status: 0."""
    _check(config)
    rows: Rows = {}
    figures: list[str] = []
    if config.space != "arm":
        asked = {key: str(value) if isinstance(value, Path) else value for key, value in asdict(config).items()}
        found = measure_points(
            config.scenes,
            config.seed,
            config.planners,
            config.budget,
            config.out,
            config.overwrite,
            config.figures,
            asked,
        )
        rows, figures = dict(found.rows), found.figures
        print(printed(rows) + "\n")
    if config.space != "point":
        mine = arm_rows(config)
        print(table(SECTION, mine) + "\n")
        rows = {**mine, **rows}
    if config.json:
        sections = read_results(config.json)
        old = {name: dict(entry) for name, entry in sections.get(SECTION, {}).items()}
        section = merged(old, rows, config.space)
        write_bytes(config.json, (json.dumps(sections | {SECTION: section}, indent=1) + "\n").encode())
    else:
        section = rows
    if config.page:
        write_bytes(config.page, page(section, figures).encode())
    missed = [name for name, entry in rows.items() if holds(name, entry["value"]) is False]
    print(f"{len(missed)} bars do not hold" + (f": {', '.join(missed)}" if missed else ""))
    return 0
