"""Hands that appear in free space: are they in the cloud after the first image that shows them?"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.geom.capsules import Capsules
from hrcjax.presence import centres, unpack_columns
from hrcjax.robot import arm_capsules
from hrcjax.sense import no_faults
from hrcjax.sense.camera import render_capsules
from hrcjax.sim.prepare import stage_for
from hrcjax.sim.watch import initial_watch, people_seen, watch_image
from hrcjax.typing import Array
from hrcjax.world import Person
from hrcjax.world.person import person_at

from .truth import arm_axes, obstacles_distance, point_to_segment
from .worlds import Bench, SetUp

THICKNESS = 0.02
"""Of a thin hand [m]."""
LENGTHS = (0.08, 0.18)
"""Least and greatest length of a thin hand, whole [m]."""
LEAST_PIXELS = 12
"""Pixels of the exact image that must show the hand for it to count."""
FOUND = 0.06
"""A point of the cloud this near to the hand's surface finds it [m]."""
KINDS = ("thin", "body")
EVERY_BODY = 4
"""Of so many hands one is the person model's, the others are thin; many thin ones are too small in the image to count."""
WARM = 6
"""Images of the empty cell before the hand appears."""


def hand_person(bench: Bench, made: SetUp, a: NDArray, b: NDArray, radius: float) -> Person:
    """A single capsule, as a person who is there all the time."""
    person = bench.person(made, "nobody")
    radii = np.full(person.radius.shape, -1.0, np.float32)
    radii[0] = radius
    ends_a, ends_b = (jnp.broadcast_to(jnp.asarray(x, person.a.dtype), person.a.shape) for x in (a, b))
    there = jnp.ones_like(person.present)
    return eqx.tree_at(lambda p: (p.a, p.b, p.radius, p.present), person, (ends_a, ends_b, jnp.asarray(radii), there))


def place_hands(
    bench: Bench, made: SetUp, count: int, draw: np.random.Generator
) -> list[tuple[int, NDArray, NDArray, float]]:
    """Kind, both ends and radius of hands in watched free space, clear of obstacles and arm."""
    cell = bench.cell
    middle = np.asarray(centres(cell.voxels, jnp.float32), float)
    free = np.array(unpack_columns(cell.voxels, made.survey.empty.watched))
    free &= (np.linalg.norm(middle[:, :2], axis=1) < 1.1) & (middle[:, 2] > 0.15) & (middle[:, 2] < 0.8)
    free &= obstacles_distance(made.scene, middle)[0] > 0.2
    a, b = arm_axes(cell.arm, np.asarray(made.q_start, float)[None])
    gaps = [point_to_segment(middle, a[0, k], b[0, k])[0] for k in range(a.shape[1])]
    free &= np.min(gaps, axis=0) > 0.3
    places = draw.permutation(np.flatnonzero(free))[:count]
    hands = []
    for k, place in enumerate(places):
        way = draw.normal(size=3)
        way /= np.linalg.norm(way)
        kind = int(k % EVERY_BODY == 0)
        if KINDS[kind] == "thin":
            radius = THICKNESS / 2
            half = (draw.uniform(*LENGTHS) - THICKNESS) / 2
        else:  # the person model's own hand
            radius, half = 0.103, 0.05
        x = middle[place]
        hands.append((kind, x - half * way, x + half * way, radius))
    return hands


def hands_case(bench: Bench, made: SetUp, count: int) -> dict[str, Any]:
    """Hands one by one, each before one camera."""
    cell, params = bench.cell, bench.sense
    draw = np.random.default_rng(2000 + made.seed)
    nobody = bench.person(made, "nobody")
    stage = stage_for(made.rig, made.scene, nobody, no_faults(made.rig.count, bench.dtype))
    robot = arm_capsules(cell.arm, made.q_start)
    period = 1.0 / sum(made.rig.rates)

    @jax.jit
    def look(survey: Any, stage: Any, state: Any, camera: Array, at: Array, robot: Capsules, key: Array) -> tuple:
        state, _ = watch_image(cell.voxels, params, survey, stage, state, camera, at, robot, key, cell.latency)
        seen = people_seen(
            cell.voxels, params.presence, survey, stage.rig, state, robot, cell.moving_points * cell.people
        )
        eye = jax.tree.map(lambda a: a[camera], stage.rig.cameras)
        nothing = jnp.full((eye.height, eye.width), jnp.inf, stage.scene_depth.dtype)
        behind = jnp.minimum(stage.scene_depth[camera], render_capsules(eye, robot, nothing))
        shown = render_capsules(eye, person_at(stage.person, at), nothing) < behind
        return state, seen.cloud.points, seen.cloud.mask, jnp.sum(shown)

    state = initial_watch(cell.voxels, made.survey, jnp.asarray(0.0, bench.dtype))
    keys = jax.random.split(jax.random.fold_in(made.key, 7), WARM + count)
    for k in range(WARM):
        camera, at = jnp.asarray(k % made.rig.count, jnp.int32), jnp.asarray(k * period, bench.dtype)
        state, *_ = look(made.survey, stage, state, camera, at, robot, keys[k])

    kinds, pixels, found = [], [], []
    for k, (kind, a, b, radius) in enumerate(place_hands(bench, made, count, draw)):
        with_hand = eqx.tree_at(lambda s: s.person, stage, hand_person(bench, made, a, b, radius))
        camera = jnp.asarray(k // EVERY_BODY % made.rig.count, jnp.int32)
        at = jnp.asarray((WARM + int(camera)) * period, bench.dtype)
        _, points, mask, shown = look(made.survey, with_hand, state, camera, at, robot, keys[WARM + k])
        there = np.asarray(points, float)[np.asarray(mask)]
        near = (point_to_segment(there, a, b)[0] - radius).min() if len(there) else np.inf
        kinds.append(kind)
        pixels.append(int(shown))
        found.append(near < FOUND)
    return {"kind": kinds, "pixels": pixels, "found": found}
