"""The rows of the whole arm: problems, and speed in the Robotica paper's scene, each kept in the folder of the run."""

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hrcjax.lab.case_store import RunStore
from hrcjax.lab.provenance import LOADED_CODE, file_digest, fingerprint
from hrcjax.plan.link_model import link_model

from .about import about, read, stored
from .alone import seconds_alone
from .checker import Checker
from .others import family_rows, peer_rows
from .peers import installed
from .problems import TIGHT, read_problems, thin_arm
from .rows import Rows, problem_rows, row
from .side_by_side import process_count, solve_side_by_side
from .solve import solve_all
from .speed import alone_ms, robotica_speed

INFLATION = 0.005
"""Of the arm's spheres in the problems [m]."""
DECIDING = (
    "alone.py", "arm.py", "checker.py", "families.py", "others.py", "peers.py", "problems.py", "rows.py", "side_by_side.py",
    "solve.py", "speed.py",
)  # fmt: skip
"""Files that decide the rows, beside the library."""


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _problems(path: Path, count: int, peers: int, processes: int) -> Rows:
    problems = read_problems(path, count)
    arm = thin_arm()
    checker = Checker(arm)
    reference_free = checker.free(problems, range(len(problems)), problems.reference)
    model = link_model(arm, INFLATION, floor=0.0, tight=TIGHT)
    side = process_count(processes, len(problems))
    solved = solve_side_by_side(problems, INFLATION, side) if side > 1 else solve_all(model, checker, problems, _say)
    rows = problem_rows(problems, reference_free, solved) | {"processes": row(side, "processes")}
    seconds, stages = seconds_alone(model, checker, problems)
    rows["ms_alone"] = row(1e3 * np.median(seconds), "ms")
    if (optimised := stages != 0).any():
        rows["ms_alone_optimised"] = row(1e3 * np.median(seconds[optimised]), "ms")
    rows["alone_unsolved"] = row((stages < 0).sum(), "problems")
    rows["ms_alone_p95"] = row(1e3 * np.percentile(seconds, 95), "ms")
    both = [(int(k), own) for k in np.flatnonzero(reference_free) if (own := solved.paths[k]) is not None]
    if both:
        there, paths = [k for k, _ in both], [own for _, own in both]
        rows["clearance"] = row(1e3 * np.median(checker.clearances(problems, there, paths)), "mm")
        references = [problems.reference[k] for k in there]
        rows["clearance_reference"] = row(1e3 * np.median(checker.clearances(problems, there, references)), "mm")
    if peers and installed():
        rows |= peer_rows(arm, checker, problems, reference_free, solved, peers, _say)
    return rows


def _families(count: int) -> Rows:
    arm = thin_arm()
    model = link_model(arm, INFLATION, floor=0.0, tight=TIGHT)
    return family_rows(model, Checker(arm), count, installed(), _say)


def _speed(settings: int) -> Rows:
    _say(f"{settings} settings in the Robotica paper's scene")
    speed = robotica_speed(settings)
    return {
        "settings_per_s": row(speed["settings_per_s"], "1/s"),
        "compile_s": row(speed["compile_s"], "s"),
        "robotica_kept": row(speed["kept"], "1"),
        "robotica_ms_alone": row(alone_ms(), "ms"),
    }


def _kept(
    store: RunStore, name: str, asked: Mapping[str, Any], make: Callable[[], Rows]
) -> tuple[Rows, dict[str, Any]]:
    """Rows as a case of the folder, measured if they are not there; and what they were measured on."""
    here = Path(__file__).parent
    mark = fingerprint({"code": LOADED_CODE, "program": {file: file_digest(here / file) for file in DECIDING}, **asked})

    def case() -> dict[str, Any]:
        before = about()
        rows = make()
        return {
            "name": np.array(list(rows)), "value": np.array([float(entry["value"]) for entry in rows.values()]),
            "unit": np.array([entry["unit"] for entry in rows.values()]), **stored(before),
        }  # fmt: skip

    found, computed = store.take(f"arm/{name}-{mark[:12]}", case)
    if not computed:
        _say(f"rows of the arm's {name} are taken from {store.folder}")
    rows = {str(n): row(x, str(u)) for n, x, u in zip(found["name"], found["value"], found["unit"], strict=True)}
    return rows, read(found)


def arm_rows(
    store: RunStore, path: Path, count: int, settings: int, families: int = 0, peers: int = 0, processes: int = 0
) -> tuple[Rows, dict[str, Any]]:
    """Rows of the whole arm, and what they were measured on; without the file of problems those are left out."""
    rows: Rows = {}
    origin: dict[str, Any] = {}
    if path.exists():
        asked = {"problems": file_digest(path), "count": count, "peers": peers, "processes": processes}
        rows, origin = _kept(store, "problems", asked, lambda: _problems(path, count, peers, processes))
    else:
        _say(f"no problems at {path}: their rows are left out; --problems FILE names another place")
    if families:
        more, measured = _kept(store, "families", {"families": families}, lambda: _families(families))
        rows, origin = {**rows, **more}, origin or measured
    if settings:
        more, measured = _kept(store, "speed", {"settings": settings}, lambda: _speed(settings))
        rows, origin = {**rows, **more}, origin or measured
    return rows, origin
