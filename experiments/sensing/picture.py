"""One moment for the figures: what was sensed, and what was there."""

from typing import Any

import numpy as np

from hrcjax.map import labelled_points
from hrcjax.presence import centres

from .truth import arm_axes, person_capsules, point_to_segment, solids
from .worlds import Bench, SetUp, image_in_use

WHEN = 0.47
"""Moment, as a share of the episode: somebody who reaches in has the hand in the path [1]."""


def picture_case(bench: Bench, made: SetUp, name: str) -> dict[str, Any]:
    """The cloud and the exact shapes at one moment of an episode, and the space that nobody ever saw."""
    cell = bench.cell
    person = bench.person(made, name)
    world = bench.world(made, person)
    played, frames = bench.play_in(world), world.frames
    tick = int(WHEN * cell.ticks)
    t = played.t[tick]
    image = int(image_in_use(np.asarray(frames.stamp), np.asarray(frames.valid), np.asarray([t]), cell.latency)[0][0])
    stamp = float(frames.stamp[image])
    moving = np.asarray(frames.moving.points[image], float)[np.asarray(frames.moving.mask[image])]
    a, b, radius = (part[0] for part in person_capsules(person, np.asarray([stamp])))
    there = ~np.isnan(radius)
    gaps = [point_to_segment(moving, a[k], b[k])[0] - radius[k] for k in np.flatnonzero(there)]
    static, _ = labelled_points(made.survey.map)
    arm_a, arm_b = (ends[0] for ends in arm_axes(cell.arm, played.q[tick : tick + 1].astype(float)))
    parts = solids(made.scene)
    middle = np.asarray(centres(cell.voxels, np.float32))
    return {
        "t": t,
        "static": static,
        "moving": moving,
        "off": np.min(gaps, axis=0) if gaps else np.full(len(moving), np.inf),
        "person_a": a[there],
        "person_b": b[there],
        "person_radius": radius[there],
        "arm_a": arm_a,
        "arm_b": arm_b,
        "arm_radius": cell.arm.capsule_radii,
        "kind": [part[0] for part in parts],
        "center": np.reshape([part[1] for part in parts], (-1, 3)),
        "size": np.reshape([part[2] for part in parts], (-1, 3)),
        "yaw": [part[3] for part in parts],
        "unseen": middle[np.asarray(made.survey.unseen)],
        "edge": cell.voxels.edge,
        "cameras": np.asarray(made.rig.cameras.position, float),
        "start": np.asarray(made.scene.start),
        "goal": np.asarray(made.scene.goal),
    }
