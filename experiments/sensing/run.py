"""One run: from options to cases, rows, page and figures."""

import sys
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

from hrcjax.cells.named_cell import find_cell
from hrcjax.cells.people import check_worlds, person_key
from hrcjax.cells.ur5 import CELLS
from hrcjax.io.motions.spec import motion_spec, people_of
from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.case_store import FIGURES, Case, Make, RunStore, locked_store
from hrcjax.lab.checks import at_least, check_outputs, each_once
from hrcjax.lab.parameters import leaf_names
from hrcjax.lab.progress import Progress, duration
from hrcjax.lab.provenance import LOADED_CODE, as_asked, file_digest, fingerprint, program_digests, provenance
from hrcjax.lab.rows import write_rows
from hrcjax.safety import safe_distance, zone_thresholds
from hrcjax.tune.given import given_params

from .appear import appear_case, moments
from .config import SensingConfig
from .episodes import episode_case
from .fault_cases import BESIDE, KINDS, fault_case, lost_camera_case, near_times, windows_of
from .hands import hands_case
from .image_time import images_case
from .page import page
from .picture import picture_case
from .rows import Rows, all_rows, holds, table
from .static import static_case
from .worlds import Bench, SetUp, bench

WORKERS = 2
"""Cases that are computed side by side."""
SLOTS = 40
"""Faults of one camera that a compiled program has places for."""
LEAST_SEED, NO_RESULT = 1, ("params", "out", "json", "page", "figures", "overwrite", "config", "quick")


def _check(config: SensingConfig) -> None:
    each_once(config, "scenes", "people")
    check_worlds(config.scenes, config.people)
    at_least(config, LEAST_SEED, "seeds")
    at_least(config, 0, "moments", "appearances", "hands", "images")
    check_outputs(config, "json", "page")


def identity(config: SensingConfig, params: Any) -> dict[str, Any]:
    """Everything that decides the results."""
    files = [spec.files for name in config.people for one in people_of(name) if (spec := motion_spec(one))]
    options = {key: value for key, value in asdict(config).items() if key not in NO_RESULT}
    return {
        "options": options,
        "recordings": [file_digest(path) for paths in files for path in paths],
        "params": leaf_names(params),
        "code": LOADED_CODE,
        "program": program_digests(Path(__file__).parent, AFTERWARDS),
    }


AFTERWARDS = ("rows.py", "page.py", "figures.py", "shapes.py", "config.py", "run.py", "__main__.py")
"""Files that only read finished cases."""


class Runner:
    """The cases of one scene and seed, computed as far as they are not there."""

    def __init__(self, store: RunStore, made_on: Bench, progress: Progress) -> None:
        self.store, self.bench, self.progress = store, made_on, progress
        self.cases: dict[str, Case] = {}
        self._set_up: SetUp | None = None
        self.pool = ThreadPoolExecutor(WORKERS)

    def set_up(self, scene: str, seed: int) -> SetUp:
        """The set-up of a scene, kept until the next one."""
        if self._set_up is None or (self._set_up.name, self._set_up.seed) != (scene, seed):
            self._set_up = self.bench.set_up(scene, seed)
        return self._set_up

    def one(self, name: str, make: Make) -> Case:
        """A case, computed if it is not there."""
        self.cases[name], computed = self.store.take(name, make)
        self.progress.advance(1, None if computed else 0.0, name)
        return self.cases[name]

    def many(self, wanted: Mapping[str, Make]) -> None:
        """Cases side by side; the first alone, so that each program is compiled once."""
        waiting = dict(wanted)
        for name in list(waiting):
            found = self.store.get(name)
            if found is not None:
                self.cases[name] = found
                self.progress.advance(1, 0.0, name)
                del waiting[name]
        if waiting:
            first = next(iter(waiting))
            self.one(first, waiting.pop(first))
        futures = {self.pool.submit(self.store.take, name, make): name for name, make in waiting.items()}
        try:
            for future in as_completed(futures):
                self.cases[futures[future]], _ = future.result()
                self.progress.advance(1, None, futures[future])
        except BaseException:
            for future in futures:
                future.cancel()
            raise


def _lazy(runner: Runner, scene: str, seed: int, make: Callable[..., Mapping[str, Any]], *rest: Any) -> Make:
    """A case that needs a set-up, which is made when the case is."""
    return lambda: make(runner.bench, runner.set_up(scene, seed), *rest)


def run_matrix(runner: Runner, config: SensingConfig, scene: str, seed: int) -> None:
    """Set-up, episodes and hands of one scene and seed."""
    runner.one(f"setup/{scene}-{seed}", _lazy(runner, scene, seed, static_case))
    lazy = partial(_lazy, runner, scene, seed)
    runner.many({f"episode/{scene}-{seed}-{person_key(name)}": lazy(episode_case, name) for name in config.people})
    if config.hands and seed == 0:
        each = -(-config.hands // len(config.scenes))
        runner.one(f"hands/{scene}-{seed}", lazy(hands_case, each))


def base_case(runner: Runner, scene: str, name: str) -> Case:
    """An episode of the matrix, or one beside it."""
    key = f"episode/{scene}-0-{person_key(name)}"
    if key not in runner.cases:
        runner.cases["base/" + key] = runner.store.take("base/" + key, _lazy(runner, scene, 0, episode_case, name))[0]
        return runner.cases["base/" + key]
    return runner.cases[key]


def run_appearances(runner: Runner, config: SensingConfig, scene: str) -> None:
    """People who are there at once."""
    base = base_case(runner, scene, "nobody")
    frames = moments(base["t"], base["qd"], config.appearances, 30.0)
    lazy = partial(_lazy, runner, scene, 0, appear_case, base["t"], base["q"])
    runner.many({f"appear/{scene}-0-{frame}": lazy(frame) for frame in frames})
    runner.progress.advance(config.appearances - len(frames), 0.0)


def fault_episodes(runner: Runner, scene: str, count: int) -> list[tuple[str, list[float]]]:
    """People and the moments at which cameras fail beside them, `count` in all."""
    chosen: list[tuple[str, list[float]]] = []
    for turn in range(count):
        for name in BESIDE:
            rest = count - sum(len(times) for _, times in chosen)
            if rest <= 0:
                return chosen
            base = base_case(runner, scene, name)
            times = near_times(base["t"], base["true_now"], rest, 0.23 * turn)
            if times:
                chosen.append((name, times))
        if not chosen:
            return chosen
    return chosen


def run_faults(runner: Runner, config: SensingConfig, scene: str) -> None:
    """Short faults of every kind, and cameras lost for good."""
    plan = fault_episodes(runner, scene, config.moments)
    wanted: dict[str, Make] = {}
    for kind, code in KINDS.items():
        for k, (name, times) in enumerate(plan):
            windows = windows_of(times, 2, k)
            wanted[f"fault/{kind}/{scene}-0-{name}-{k}"] = _lazy(
                runner, scene, 0, fault_case, name, code, windows, SLOTS
            )
    for camera in range(2):
        wanted[f"camera-lost/{scene}-0-{camera}"] = _lazy(runner, scene, 0, lost_camera_case, camera, SLOTS)
    runner.progress.total = (runner.progress.total or 0) + len(wanted) - 2
    runner.many(wanted)


def collect(config: SensingConfig, runner: Runner) -> None:
    """All cases."""
    first = config.scenes[0]
    order = [(scene, seed) for seed in range(config.seeds) for scene in config.scenes]
    for scene, seed in order:
        run_matrix(runner, config, scene, seed)
        if (scene, seed) == (first, 0):
            if config.figures:
                runner.one(f"picture/{first}-0", _lazy(runner, first, 0, picture_case, "reach_in"))
            if config.images:
                runner.one(f"images/{first}-0", _lazy(runner, first, 0, images_case, config.images))
            if config.appearances:
                run_appearances(runner, config, first)
            if config.moments:
                run_faults(runner, config, first)


def expected(config: SensingConfig) -> int:
    """Cases that are known beforehand."""
    worlds = len(config.scenes) * config.seeds
    hands = len(config.scenes) if config.hands else 0
    return worlds * (1 + len(config.people)) + hands + bool(config.figures) + bool(config.images) + config.appearances + 2 * bool(config.moments)  # fmt: skip


def run(config: SensingConfig) -> int:
    """Runs or resumes; returns the exit status: 0."""
    begin = time.monotonic()
    _check(config)
    named = find_cell(config.cell, CELLS)
    people = max(len(people_of(name)) for name in config.people)
    cell = replace(named.cell, people=max(named.cell.people, people))
    given = given_params(named.params, config.params, "--params", named.known_domains())
    tried = bench(cell, given.params, config.sensing)
    mark = fingerprint(identity(config, given.params))
    folder = config.out or Path("runs") / f"sensing-{mark[:8]}"
    about = {"program": "sensing", "config": as_asked(config), "params": leaf_names(given.params), **provenance()}
    with locked_store(folder, mark, about, config.overwrite) as store:
        if given.place:
            print(given.line(), file=sys.stderr, flush=True)
        print(f"{len(config.scenes) * config.seeds} worlds -> {folder}", file=sys.stderr, flush=True)
        return _measured(config, tried, store, begin)


def _measured(config: SensingConfig, tried: Bench, store: RunStore, begin: float) -> int:
    folder, cell = store.folder, tried.cell
    with Progress(expected(config), unit="case") as progress:
        runner = Runner(store, tried, progress)
        collect(config, runner)
    ssm = tried.params.safety.ssm
    rows = all_rows(
        runner.cases, tried.params, cell.latency, float(zone_thresholds(tried.params.safety).green), float(safe_distance(ssm, 0.0))
    )  # fmt: skip
    write_rows(folder, config.json, {"sensing": rows})
    names: list[str] = []
    if config.figures:
        from .figures import draw  # here: drawing is slow to import, and not always wanted

        names = draw(folder / FIGURES, runner.cases, config.scenes[0])
    if config.page:
        write_bytes(config.page, page(rows, config, names).encode())
    _report(rows, folder, time.monotonic() - begin)
    return 0


def _report(rows: Rows, folder: Path, seconds: float) -> None:
    print(table(rows))
    failed = [name for name, entry in rows.items() if holds(name, entry["value"]) is False]
    print(f"\n{len(failed)} bars do not hold" + (f": {', '.join(failed)}" if failed else ""))
    print(f"Took {duration(seconds)}. Cases and rows: {folder}")
