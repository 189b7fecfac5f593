"""A recorded person in metres with y up, from the BVH file of any common tool."""

from dataclasses import dataclass

import numpy as np

from hrcjax.io.bvh import open_bvh
from hrcjax.io.motions.body import check_size, find_unit, find_up, turned_up
from hrcjax.io.motions.spec import MotionSpec, read_names
from hrcjax.lab.errors import UsageError, one_line
from hrcjax.typing import Float
from hrcjax.world.joint_names import JOINTS, joint_columns


@dataclass(frozen=True, eq=False)
class Motion:
    """The played part of a recording."""

    positions: Float[np.ndarray, "frame joint 3"]
    """Positions of the joints `JOINTS`, y up [m]."""
    rate: float
    """Frame rate [Hz]."""
    length: float
    """Duration of the whole recording [s]."""
    notes: tuple[str, ...] = ()
    """What was inferred from the file, not given by the user."""

    names = JOINTS


def read_motion(spec: MotionSpec, seconds: float = np.inf) -> Motion:
    """Reads the first seconds of a motion file; infers joints, unit and up axis.

    Raises:
        UsageError: a missing or broken file, a missing joint, no human size; names the file.
    """
    name = str(spec.path)
    file = open_bvh(spec.path)
    given = {} if spec.names is None else read_names(spec.names)
    try:
        columns = joint_columns([joint.name for joint in file.joints], given)
    except ValueError as error:
        raise UsageError(
            f"{name}: {one_line(error)}; or name them in a file: {spec.path.name},names=FILE.toml"
        ) from error
    frames = len(file.values)
    played = min(frames, int(np.ceil(seconds * file.rate)) + 2) if np.isfinite(seconds) else frames
    places = file.positions(played)
    points, rest = ({joint: at[:, column] for joint, column in columns.items()} for at in (places, file.rest_pose()))
    notes = []
    unit = spec.unit
    if unit is None:
        word, unit = find_unit(points, name)
        notes.append(f"lengths in {word}")
    check_size({joint: unit * at for joint, at in points.items()}, name)
    up = spec.up
    if up is None:
        up = find_up(points, rest, name)
        notes.append(f"{up} up")
    found = (f"{name}: {', '.join(notes)}, inferred from the body",) if notes else ()
    body = np.stack([points[joint] for joint in JOINTS], axis=1)
    return Motion(turned_up(body * unit, up), file.rate, frames / file.rate, found)
