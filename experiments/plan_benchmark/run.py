"""One run: from options to rows and page."""

import json
import sys
from pathlib import Path

from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.errors import UsageError
from hrcjax.lab.rows import read_results, table
from hrcjax.lab.writable import check_writable
from hrcjax.plan import arm_body

from .checker import Checker
from .config import PlanBenchmarkConfig
from .problems import TIGHT, read_problems, thin_arm
from .rows import Rows, holds, page, problem_rows, row
from .solve import solve_all
from .speed import alone_ms, robotica_speed

INFLATION = 0.005
"""Of the arm's spheres in the problems [m]."""


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _check(config: PlanBenchmarkConfig) -> None:
    if config.settings < 0:
        raise UsageError(f"--settings {config.settings}: accepted is 0 or more")
    for option in ("json", "page"):
        file: Path | None = getattr(config, option)
        if file is not None:
            if not file.parent.is_dir():
                raise UsageError(f"no folder {file.parent} for --{option}")
            check_writable(file.parent, f"--{option}")


def run(config: PlanBenchmarkConfig) -> int:
    """Measures; returns the exit status: 0."""
    _check(config)
    rows: Rows = {}
    if config.problems.exists():
        problems = read_problems(config.problems, config.count)
        arm = thin_arm()
        checker = Checker(arm)
        reference_free = checker.free(problems, range(len(problems)), problems.reference)
        body = arm_body(arm, INFLATION, floor=0.0, tight=TIGHT)
        rows |= problem_rows(problems, reference_free, solve_all(body, checker, problems, _say))
        count = len(problems)
    else:
        _say(f"no problems at {config.problems}: their rows are left out; --problems FILE names another place")
        count = 0
    if config.settings:
        _say(f"{config.settings} settings in the Robotica paper's scene")
        speed = robotica_speed(config.settings)
        rows |= {
            "settings_per_s": row(speed["settings_per_s"], "1/s"),
            "compile_s": row(speed["compile_s"], "s"),
            "robotica_kept": row(speed["kept"], "1"),
            "ms_alone": row(alone_ms(), "ms"),
        }
    if config.json:
        merged = read_results(config.json) | {"plan_benchmark": rows}
        write_bytes(config.json, (json.dumps(merged, indent=1) + "\n").encode())
    if config.page:
        write_bytes(config.page, page(rows, count).encode())
    print(table("plan_benchmark", rows))
    missed = [name for name, entry in rows.items() if holds(name, entry["value"]) is False]
    print(f"\n{len(missed)} bars do not hold" + (f": {', '.join(missed)}" if missed else ""))
    return 0
