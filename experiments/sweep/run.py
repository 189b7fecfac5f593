"""One run of the sweep: from options to a folder with results and figures."""

import json
import sys
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import jax

from hrcjax.io.motions.spec import motion_spec, people_of
from hrcjax.io.scene_file import is_scene_file
from hrcjax.lab.configs import read_config
from hrcjax.lab.errors import UsageError, one_line
from hrcjax.lab.field_docs import leaf_docs
from hrcjax.lab.parameters import leaf_names, resolve
from hrcjax.lab.progress import duration
from hrcjax.lab.provenance import LOADED_CODE, file_digest, fingerprint, provenance, versions
from hrcjax.lab.run_folder import folder_name
from hrcjax.lab.table import aligned
from hrcjax.lab.writable import check_writable
from hrcjax.sweeps.dataset import taken_names, world_shape
from hrcjax.sweeps.devices import choose_devices
from hrcjax.sweeps.engine import Tally, chunk_size, run_sweep
from hrcjax.sweeps.hosts import check_hosts, join
from hrcjax.sweeps.merge import merge_results
from hrcjax.sweeps.settings import Settings, make_settings
from hrcjax.sweeps.shard import parse_shard
from hrcjax.sweeps.store import RESULTS, open_run, open_store
from hrcjax.sweeps.summary import best_table
from hrcjax.sweeps.sweepable import Sweepable
from hrcjax.tune.given import given_params

from .analyse import analyse
from .config import SweepConfig
from .job import Job
from .share import check_folders, collect, recorded, run_shard


def _people(config: SweepConfig) -> list[dict[str, str]]:
    """People by name; recorded ones also with the digest of their files."""
    people = []
    for name in config.person:
        specs = [motion_spec(one) for one in people_of(name)]
        files = [path for spec in specs if spec for path in spec.files if path.is_file()]
        people.append({"name": name} | ({"sha256": " ".join(map(file_digest, files))} if files else {}))
    return people


def _scenes(config: SweepConfig) -> list[Any]:
    """Scenes by name; files also with their digest."""
    return [[name, file_digest(Path(name))] if is_scene_file(name) else name for name in config.scene]


def identity(config: SweepConfig, problem: Sweepable, settings: Settings, chunk: int) -> dict[str, Any]:
    """Everything that determines the results of a run, as JSON values."""
    used = versions()
    return {
        "cell": [config.cell, problem.code],
        "scene": _scenes(config),
        "obstacles": config.obstacles,
        "person": _people(config),
        "seed": list(config.seed),
        "axes": {axis.name: list(axis.values) or [axis.scale, axis.low, axis.high] for axis in settings.axes},
        "sobol": [settings.count, config.sobol_seed] if config.sobol else [],
        "quick": config.quick,
        "backend": config.backend,
        "motion": config.motion,
        "chunk": chunk,
        "x64": bool(jax.config.jax_enable_x64),  # pyright: ignore[reportAttributeAccessIssue]  # set at run time
        "params": leaf_names(problem.params),
        "versions": {name: used[name] for name in ("jax", "jaxlib", "mujoco", "mujoco-mjx", "numpy", "scipy")},
        "code": LOADED_CODE,
    }


def _list_parameters(problem: Sweepable) -> str:
    short = {full: alias for alias, full in problem.aliases.items()}
    docs = leaf_docs(problem.params)
    lines = []
    for name, default in leaf_names(problem.params).items():
        domain = problem.domains.get(name)
        bounds = f"[{domain[0]:g}, {domain[1]:g}]" if domain else ""
        description, unit = docs.get(name, ("", "1"))
        lines.append([name, f"{default:g}", unit, bounds, short.get(name, ""), description])
    return aligned([["parameter", "default", "unit", "domain", "alias", "meaning"], *lines])


def _build(config: SweepConfig) -> Sweepable:
    from hrcjax.cells.problem import build_problem  # here, so that --help and wrong options answer at once

    try:
        return build_problem(
            config.scene, config.person, config.seed, config.backend, config.cell, config.motion, config.obstacles
        )
    except (ValueError, OSError) as error:
        raise UsageError(one_line(error)) from error


def _check(config: SweepConfig) -> None:
    for option in ("scene", "person", "seed"):
        values = getattr(config, option)
        if not values:
            raise UsageError(f"--{option} is empty")
        if len(set(values)) < len(values):
            raise UsageError(f"--{option}: a value is given twice")
    for seed in config.seed:
        if not 0 <= seed < 2**32:
            raise UsageError(f"--seed {seed}: accepted is 0 to {2**32 - 1}")
    if not 0 < config.memory < float("inf"):
        raise UsageError(f"--memory {config.memory:g}: accepted is a number of MB above 0")
    if config.json:
        raise UsageError("--json needs --analyse RUN")
    part = f"--shard {config.shard}" if config.shard else f"--hosts {config.hosts}"
    others = {"--hosts": bool(config.shard and config.hosts), "--merge": config.merge is not None}
    others["--overwrite"] = config.overwrite
    if (config.shard or config.hosts) and any(others.values()):
        other = next(option for option, given in others.items() if given)
        raise UsageError(f"{part} and {other} exclude each other")
    check_hosts(config.hosts, config.coordinator, config.host_timeout)
    if config.merge and (config.out is None):
        raise UsageError("--merge FOLDER ... needs --out, the folder of the results")
    if config.devices < 0:
        raise UsageError(f"--devices {config.devices}: accepted is 0 or more")
    if config.best < 1:
        raise UsageError(f"--best {config.best}: accepted is 1 or more")


def _check_grid(config: SweepConfig, problem: Sweepable) -> None:
    """Refuses the grid of the named settings, which the user did not type, for a cell that lacks its parameters."""
    if config.grid != read_config(SweepConfig, "sweep", config.config).grid:
        return
    names = leaf_names(problem.params)
    try:
        for axis in config.grid:
            resolve(axis.partition("=")[0].strip(), names, problem.aliases)
    except UsageError as error:
        raise UsageError(
            f"the cell {config.cell} lacks a parameter that is swept by default ({error}): give --grid, for example "
            f"--grid {next(iter(names), 'NAME')}=lin:LOW:HIGH:COUNT"
        ) from error


def _default_folder(config: SweepConfig, mark: str) -> Path:
    singles = [one for name in config.person for one in people_of(name)]
    people = [spec.path.stem if (spec := motion_spec(name)) else name for name in singles]
    scenes = [Path(name).stem if is_scene_file(name) else name for name in config.scene]
    return Path("runs") / f"{folder_name('-'.join(['sweep', '+'.join(scenes), '+'.join(people)]))}-{mark[:8]}"


def run(config: SweepConfig) -> int:
    """Runs or resumes a sweep; returns the exit status: 0, or 3 if some results are not finite."""
    begin = time.monotonic()
    if config.analyse:
        return analyse(config.analyse, config.by, config.json, config.figures)
    _check(config)
    shard = parse_shard(config.shard) if config.shard else None
    if config.merge:
        config = recorded(config.merge[0], config)
    if not config.list:
        check_writable(config.out or Path("runs"), "--out")
        if config.hosts:
            shard = join(config.hosts, config.coordinator, config.host_timeout)
    problem = _build(config)
    given = given_params(problem.params, config.params, "--params", problem.domains)
    problem = replace(problem, params=given.params)
    if config.list:
        print(_list_parameters(problem))
        return 0
    by = config.by or problem.rank
    if by not in problem.metrics:
        raise UsageError(f"--by {by}: no such metric; accepted: {', '.join(problem.metrics)}")
    _check_grid(config, problem)
    settings = make_settings(
        config.grid,
        problem.params,
        aliases=problem.aliases,
        domains=problem.domains,
        samples=config.sobol,
        sample_seed=config.sobol_seed,
        quick=config.quick,
        taken=taken_names(problem),
    )
    if given.place:
        print(given.line(settings.values), file=sys.stderr, flush=True)
    world_shape(problem)
    chunk = chunk_size(settings.count, config.memory, problem.bytes_per_setting)
    for text in problem.notes:
        print(text, file=sys.stderr, flush=True)
    who = identity(config, problem, settings, chunk)
    mark = fingerprint(who)
    folder = config.out or _default_folder(config, mark)
    origin = provenance()
    devices = choose_devices(config.devices)
    asked = json.loads(json.dumps(asdict(config), default=str))
    record = {"program": "sweep", "config": asked, "provenance": origin, "identity": who}
    attrs = {"title": "sweep", "rank": by, "trade_off": list(problem.trade_off), "fingerprint": mark}
    attrs |= {"config": asked, **origin, "statuses": {str(k): v for k, v in problem.statuses.items()}}
    job = Job(problem, settings, chunk, mark, folder, record, attrs)
    if shard:
        tally, last = run_shard(job, shard, config.memory, devices)
        if not last:
            return 3 if tally.not_finite else 0
    else:
        tally = _run_whole(job, config, devices)
    if config.figures:
        print("drawing figures", file=sys.stderr, flush=True)
        _draw(folder, by)
    return _report(config, problem, folder, by, tally, time.monotonic() - begin)


def _run_whole(job: Job, config: SweepConfig, devices: list[Any]) -> Tally:
    """Computes what is missing, or with --merge collects it, and writes the results."""
    worlds = len(job.problem.worlds)
    where = f" in {worlds} worlds" if worlds > 1 else ""
    print(f"{job.settings.count} settings{where} -> {job.folder}", file=sys.stderr, flush=True)
    if config.merge is not None:
        check_folders(job, config.merge)
    with open_store(job.folder, job.mark, job.record, config.overwrite) as store:
        if config.merge is None:
            tally = run_sweep(job.problem, job.settings, store, job.chunk, config.memory, devices=devices)
        else:
            tally = collect(job, store, config.merge)
        done = store.finished()
        if done is not None:
            done.close()
        if done is None or tally.computed:
            merge_results(job.problem, job.settings, store, job.chunk, job.attrs)
    return tally


def _draw(folder: Path, by: str) -> None:
    from hrcjax.sweeps.figures import draw_run  # here: drawing is slow to import, and not always wanted

    draw_run(folder, by)


def _report(config: SweepConfig, problem: Sweepable, folder: Path, by: str, tally: Tally, seconds: float) -> int:
    with open_run(folder) as results:
        better = "lowest" if problem.metrics[by][1] == "low" else "highest"
        over = ", means over all worlds" if len(problem.worlds) > 1 else ""
        none = "" if (results.status == 0).any() else "; all of them failed"
        print(f"\nBest settings ({better} {by}{over}; failed settings last{none}):")
        print(best_table(results, by, config.best))
    total = sum(tally.statuses.values())
    failed = {code: times for code, times in sorted(tally.statuses.items()) if code > 0}
    for code, times in failed.items():
        print(f"{times} of {total} results: {problem.statuses.get(code, f'status {code}')}")
    rate = f", {tally.computed / tally.compute_seconds:.3g} settings/s" if tally.computed else ""
    compiled = f" ({duration(tally.compile_seconds)} of it compilation{rate})" if tally.computed else ""
    print(f"\nTook {duration(seconds)}{compiled}.")
    print(f"Results: {folder / RESULTS}" + (f"; figures: {folder / 'figures'}" if config.figures else ""))
    if tally.not_finite:
        text = f"warning: {tally.not_finite} of {total} results are not finite, or a command was not (status -1 in the dataset)"
        print(text, file=sys.stderr, flush=True)
        return 3
    return 0
