"""The comparison of planners of a point: scenes and planners as cases of a folder, then rows, figures and sentences."""

import sys
from collections.abc import Mapping, Sequence
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hrcjax.lab.case_store import FIGURES, Case, RunStore
from hrcjax.lab.errors import UsageError
from hrcjax.lab.progress import Progress
from hrcjax.lab.provenance import LOADED_CODE, file_digest

from . import sampling, timing
from .cases import PLANNERS, Bench, names_of, stored_scenes
from .measures import BASELINES, MANY, UNSEEN, Rows, point_rows, unseen_rows
from .optimum import compared, hard_scenes
from .optimum_rows import optimum_rows
from .paper import paper_rows
from .scenes import PointScene, draw_scene, feasible_scenes

AFTERWARDS = (
    "measures.py",
    "intervals.py",
    "figures.py",
    "page.py",
    "words.py",
    "run.py",
    "optimum_rows.py",
    "optimum_page.py",
)
"""Files that only read finished cases."""
EXTRA = "pip install 'hrcjax[baselines]'"


class Measured(NamedTuple):
    """What a run found."""

    rows: Rows
    figures: list[str]
    """Name and content of each, as Markdown."""


def chosen(planners: tuple[str, ...]) -> tuple[str, ...]:
    """The planners of a run; those whose package is missing are left out, with one line.

    Raises:
        UsageError: an unknown name, or none is left.
    """
    unknown = [name for name in planners if name not in PLANNERS]
    if unknown:
        raise UsageError(f"--planners {unknown[0]}: accepted are {', '.join(PLANNERS)}")
    names = names_of(planners)
    if not sampling.installed() and set(names) & set(sampling.SAMPLING):
        left_out = [name for name in names if name in sampling.SAMPLING]
        print(f"ompl is not installed ({EXTRA}): {', '.join(left_out)} are left out", file=sys.stderr, flush=True)
        names = tuple(name for name in names if name not in sampling.SAMPLING)
    if timing.toppra is None:
        print(f"toppra is not installed ({EXTRA}): time-optimal travel times are left out", file=sys.stderr, flush=True)
    if not names:
        raise UsageError("--planners: all of these need ompl, which is not installed")
    return names


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


def identity(budget: float) -> dict[str, Any]:
    """Everything that decides a case."""
    files = [path for path in sorted(Path(__file__).parent.glob("*.py")) if path.name not in AFTERWARDS]
    return {
        "budget": budget,
        "code": LOADED_CODE,
        "program": {path.name: file_digest(path) for path in files},
        "packages": {name: _version(name) for name in ("ompl", "toppra")},
    }


def _scenes(store: RunStore, count: int, seed: int) -> tuple[dict[int, PointScene], dict[str, int]]:
    """The feasible scenes, whose seeds are stored, as the check takes a third of a second for each."""
    kept, _ = store.take(f"scenes/{seed}-{count}", lambda: stored_scenes(*feasible_scenes(count, seed)))
    drawn = {int(s): draw_scene(int(s)) for s in kept["seed"]}
    rejected = {str(r): int(n) for r, n in zip(kept["reason"], kept["count"], strict=True)}
    return {s: scene for s, scene in drawn.items() if scene is not None}, rejected


def measure_points(
    store: RunStore,
    count: int,
    seed: int,
    unseen: int,
    lagrange: int,
    names: Sequence[str],
    budget: float,
    figures: bool,
) -> Measured:
    """Runs or resumes the comparison in the folder of a run.

    Args:
        count: number of scenes; seed: first seed.
        unseen: number of scenes of other seeds, for shares alone.
        lagrange: number of scenes in which the optimiser is held against an augmented Lagrangian.
        names: planners, as of `chosen`.
        budget: time of each sampling planner for a scene [s].
    """
    bench = Bench(budget)
    scenes, rejected = _scenes(store, count, seed)
    cases = _collect(store, scenes, names, bench)
    rows = point_rows(cases, rejected)
    compared = [name for name in names if name in (*MANY, *BASELINES)]
    if unseen and set(compared) & set(MANY) and set(compared) & set(BASELINES):
        drawn, _ = _scenes(store, unseen, UNSEEN)
        others = {s: scene for s, scene in drawn.items() if s not in scenes}
        if others:
            rows |= unseen_rows(_collect(store, others, compared, bench))
    rows |= {name: {"value": float(x), "unit": str(unit)} for name, (x, unit) in _paper(store).items()}
    if lagrange:
        rows |= optimum_rows(_lagrange(store, lagrange))
    rows["point_budget"] = {"value": budget, "unit": "s"}
    made: list[str] = []
    if figures:
        from .figures import draw  # here: drawing is slow to import, and not always wanted

        made = draw(store.folder / FIGURES, scenes, cases, rows)
    return Measured(rows, made)


def _paper(store: RunStore) -> dict[str, tuple[float, str]]:
    def case() -> dict[str, Any]:
        rows = paper_rows()
        return {"name": np.array(list(rows)), "value": np.array([r["value"] for r in rows.values()]),
                "unit": np.array([r["unit"] for r in rows.values()])}  # fmt: skip

    kept, _ = store.take("paper", case)
    return {str(n): (float(x), str(u)) for n, x, u in zip(kept["name"], kept["value"], kept["unit"], strict=True)}


def _lagrange(store: RunStore, count: int) -> list[Case]:
    kept, _ = store.take(f"scenes/lagrange-{count}", lambda: {"seed": np.array(list(hard_scenes(count)))})
    found: list[Case] = []
    with Progress(count, unit="scene") as progress:
        for seed in kept["seed"]:
            scene = draw_scene(int(seed))
            if scene is not None:
                case, computed = store.take(f"lagrange/{seed}", partial(compared, scene))
                found.append(case)
                progress.advance(1, None if computed else 0.0, f"scene {seed}, augmented Lagrangian")
    return found


def _collect(
    store: RunStore, scenes: Mapping[int, PointScene], names: Sequence[str], bench: Bench
) -> dict[str, list[Case]]:
    found: dict[str, list[Case]] = {name: [] for name in names}
    with Progress(len(scenes) * len(names), unit="case") as progress:
        for seed, scene in scenes.items():
            for name in names:
                case, computed = store.take(f"{name}/{seed}", partial(bench.case, name, scene))
                found[name].append(case)
                progress.advance(1, None if computed else 0.0, f"scene {seed}, {name}")
    return found
