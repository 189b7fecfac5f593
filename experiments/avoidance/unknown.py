"""Scenes with an obstacle on the path that the planner does not know."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.reference.truth import obstacle_distances, solid_distance
from hrcjax.sim import Cell
from hrcjax.sim.prepare import posture_at
from hrcjax.world import Scene, scene_named
from hrcjax.world.scene import BOX, SPHERE
from hrcjax.world.scenes import Obstacle, make_scene

from .bench import Bench, Played

ENDS_APART = 0.12
"""Least distance of an obstacle's surface from start and goal [m]."""
ARM_APART = 0.06
"""Least distance of its surface from the whole arm at both ends [m]."""
BESIDE = 0.05
"""Largest distance of its middle from the straight line, seen from above [m]."""
NEAREST = 0.25
"""Least distance of its middle from the base's axis [m]."""
TRIES = 2000
LIKE = ("robotica", "hri")
"""Scenes whose start and goal are varied, in turn."""


def drawn_obstacle(draw: np.random.Generator, start: NDArray, goal: NDArray) -> Obstacle:
    """A column, box or ball on the straight line or beside it."""
    way = goal - start
    aside = np.array([-way[1], way[0], 0.0]) / np.hypot(way[0], way[1])
    place = start + draw.uniform(0.25, 0.75) * way + draw.uniform(-BESIDE, BESIDE) * aside
    kind = int(draw.integers(3))
    if kind == SPHERE:
        size = np.full(3, draw.uniform(0.035, 0.06))
        place = place + draw.uniform(-0.04, 0.04) * np.eye(3)[2]
        place[2] = max(place[2], size[2] + 0.01)
    else:
        wide = draw.uniform(0.025, 0.045, 2) if kind == BOX else np.full(2, draw.uniform(0.02, 0.04))
        top = place[2] + draw.uniform(0.0, 0.08)
        size = np.array([*wide, top / 2])
        place = np.array([*place[:2], top / 2])
    yaw = float(draw.uniform(0, np.pi)) if kind == BOX else 0.0
    x, y, z = place.tolist()
    a, b, c = size.tolist()
    return Obstacle(kind, (x, y, z), (a, b, c), yaw, float(np.mean(size[:2])))


def unknown_scene(cell: Cell, seed: int) -> tuple[Scene, Scene]:
    """What is there, and what the planner knows: the same start and goal, and nothing else.

    Start and goal are those of a named scene, each moved by up to 6 cm; one or two obstacles stand about the straight line
    between them.
    """
    draw = np.random.default_rng(seed)
    base = scene_named(LIKE[seed % len(LIKE)])
    low, high = np.asarray(base.lower, float), np.asarray(base.upper, float)
    for _ in range(TRIES):
        start, goal = (np.asarray(x, float) + draw.uniform(-0.06, 0.06, 3) for x in (base.start, base.goal))
        start[2], goal[2] = max(start[2], 0.08), max(goal[2], 0.08)
        ends = start.tolist(), goal.tolist(), low.tolist(), high.tolist()
        known = make_scene([], *ends)
        try:
            q = np.stack([np.asarray(posture_at(cell, x), float) for x in (known.start, known.goal)])
        except ValueError:
            continue
        found: list[Obstacle] = []
        for _ in range(int(draw.integers(1, 3))):
            new = drawn_obstacle(draw, start, goal)
            solid = new.kind, np.asarray(new.center), np.asarray(new.size), new.yaw
            ends_apart = min(float(solid_distance(*solid, x)) for x in (start, goal))
            arm_apart = obstacle_distances(cell.arm, make_scene([new], *ends), q).min()
            if ends_apart >= ENDS_APART and arm_apart >= ARM_APART and np.hypot(*new.center[:2]) > NEAREST:
                found.append(new)
        if found:
            return make_scene(found, *ends), known
    raise ValueError(f"seed {seed}: no place for an obstacle in {TRIES} tries")


def obstacle_case(bench: Bench, seed: int) -> Mapping[str, Any]:
    """The episodes of a scene: with everything on, with the policy's leaves off, and with the governor's stop off too."""
    scene, known = unknown_scene(bench.cell, seed)
    world = bench.empty_world(scene, seed, known)
    case: dict[str, Any] = {
        "start": scene.start, "goal": scene.goal, "kind": scene.kind, "center": scene.center, "size": scene.size,
        "yaw": scene.yaw, "mask": scene.mask,
    }  # fmt: skip
    for name, played in zip(bench.variants, bench.play_variants(world), strict=True):
        case |= {f"{key}_{name}": value for key, value in measured(bench.cell, scene, played).items()}
    return case


def measured(cell: Cell, scene: Scene, played: Played) -> dict[str, Any]:
    """What is stored of an episode."""
    end = played.end(np.asarray(scene.goal, float))
    distance = near_ticks(cell, scene, played.q[: end + 1].astype(float))
    return {
        "clearance": np.nanmin(distance),
        "clearance_t": distance,
        "arrived": played.arrived(np.asarray(scene.goal, float)),
        "tool": played.tool[: end + 1 : 5],
    }


SELDOM = 5
"""Ticks between two exact distances far from obstacles."""
FASTEST = 2.0
"""No point of the arm is faster [m/s]."""


def near_ticks(cell: Cell, scene: Scene, q: NDArray) -> NDArray:
    """Exact clearance at every `SELDOM`-th tick, and at all about the least of them; NaN elsewhere [m]."""
    found = np.full(len(q), np.nan)
    some = np.arange(0, len(q), SELDOM)
    found[some] = obstacle_distances(cell.arm, scene, q[some]).min(axis=1)
    between = FASTEST * SELDOM * cell.dt / 2
    maybe = some[found[some] < np.nanmin(found) + between]
    more = np.unique((maybe[:, None] + np.arange(-SELDOM + 1, SELDOM)).clip(0, len(q) - 1))
    more = more[np.isnan(found[more])]
    if len(more):
        found[more] = obstacle_distances(cell.arm, scene, q[more]).min(axis=1)
    return found
