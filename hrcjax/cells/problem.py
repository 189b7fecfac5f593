"""The problem of a sweep: a cell with its scenes and people."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from hrcjax.cells.check import check_cell
from hrcjax.cells.digest import cell_digest
from hrcjax.cells.named_cell import find_cell
from hrcjax.cells.people import PERSON_RATE, make_person, recording_notes
from hrcjax.cells.results import STATUSES, TRACES, evaluate
from hrcjax.cells.scenes import scene_of, sensed_scenes
from hrcjax.cells.ur5 import CELLS
from hrcjax.cells.worlds import DESCRIBED, build_world, describe
from hrcjax.io.motions.spec import people_of
from hrcjax.metrics import METRICS
from hrcjax.sweeps.sweepable import Metric, Sweepable
from hrcjax.world import MOTIONS, Scene

BYTES_PER_TICK = 2200
"""Memory per tick and setting while a chunk runs, measured [bytes]."""


def build_problem(
    scenes: Sequence[str],
    people: Sequence[str],
    seeds: Sequence[int],
    backend: str | None = None,
    cell_name: str = "ur5",
    motion: str | None = None,
    obstacles: str = "known",
) -> Sweepable:
    """The problem that the sweep runs.

    Args:
        people: names of motions, BVH files, or several of them joined by "+" for people in the cell at the same time.
        backend: of the arm's dynamics; None: that of the cell.
        motion: how the arm moves, `Cell.motion`; None: as the cell says.
        obstacles: what the planner is given: "known", the exact shapes, or "sensed", what the set-up's cameras make of them.
        cell_name: a built-in cell, or MODULE:FUNCTION that returns one.

    Raises:
        ValueError: an unknown scene, person or cell.
    """
    named = find_cell(cell_name, CELLS)
    chosen = {"backend": backend, "motion": motion}
    cell = replace(named.cell, **{name: value for name, value in chosen.items() if value is not None})
    cell = replace(cell, people=max(cell.people, *(len(people_of(name)) for name in people)))
    given: dict[tuple[str, int], Scene] = {key: scene_of(*key) for key in product(scenes, seeds)}
    if obstacles == "sensed":
        given = sensed_scenes(cell, list(given))
    most = max(int(np.sum(scene.mask)) for scene in given.values())
    cell = replace(cell, obstacles=max(most, 1))
    named = replace(named, cell=cell)
    check_cell(named)
    duration = cell.ticks * cell.dt
    frames = round(duration * PERSON_RATE) + 1
    singles = [one for name in people for one in people_of(name)]
    for one in singles:
        make_person(one, scene_of(scenes[0], 0), 0, 1.0)
    worlds: list[tuple[Mapping[str, Any], Callable[[], Any]]] = [
        (
            {"scene": scene, "person": person, "seed": seed},
            partial(build_world, cell, scene, person, seed, given[scene, seed] if obstacles == "sensed" else None),
        )
        for scene, person, seed in product(scenes, people, seeds)
    ]
    own = {name: metric for name, (metric, _) in named.metrics.items()}
    return Sweepable(
        params=named.params,
        evaluate=partial(evaluate, named),
        worlds=worlds,
        metrics={name: Metric(*entry) for name, entry in METRICS.items()} | own,  # type: ignore[arg-type]
        traces=TRACES,
        bytes_per_setting=cell.ticks * BYTES_PER_TICK,
        aliases=named.known_aliases(),
        domains=named.known_domains(),
        notes=[
            note for name in dict.fromkeys(singles) if name not in MOTIONS for note in recording_notes(name, duration)
        ],
        rank="score_sound",
        trade_off=("tool_length", "tool_bending_energy", "clearance"),
        statuses=STATUSES,
        identity=named.identity and f"{named.identity} {cell.backend} {cell.motion} {cell.people} {cell.obstacles}",
        code=cell_digest(named),
        open_ended=frozenset({"clearance", "separation"}),
        describe=describe,
        described=DESCRIBED,
        coords={
            "frame": (np.arange(frames) / PERSON_RATE, "s", "time of the person's pose"),
            "time": (np.asarray(cell.times[:: cell.metric_stride]), "s", "time since the start"),
            "xyz": (np.array(["x", "y", "z"]), "", "axis of the world"),
        },
    )
