"""A person from recorded joint positions, stood up in the cell."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.typing import Array, Float, Vector3
from hrcjax.world.joint_names import JOINTS, joint_columns
from hrcjax.world.motions import frame_count
from hrcjax.world.person import Person
from hrcjax.world.place import path_middle, standing_place
from hrcjax.world.scene import FLOOR_Z, Scene
from hrcjax.world.skeleton import HAND, HEAD, HIP, HIP_HEIGHT, SHANK, THIGH, Body, body_capsules


def person_from_joints(
    positions: Float[np.ndarray, "frame joint 3"],
    names: Sequence[str],
    rate: float,
    scene: Scene,
    duration: float = 8.0,
    new_rate: float = 30.0,
    aside: float = 0.0,
    back: float = 0.0,
) -> Person:
    """A recorded person, stood at the table where our own motions stand, facing the middle of the robot's path.

    The record's y axis is up, as in BVH files; its front is where the shoulders face on the median. Turned and moved as a
    whole: the place nearest to the table that the hip takes (95th percentile, against glitches) comes to the standing
    place, the median hip height to that of our own motions. Legs are added standing below the hip. Jumps of the record
    are kept: they are for tests of fail-safe behaviour. After its end the last pose is held.

    Args:
        positions: of the joints, y up [m].
        names: of the joints; see `joint_columns`.
        rate: frames a second of the record [Hz].
        scene: the cell.
        duration: of the person's record, from 0 [s].
        new_rate: frames a second of the person's record [Hz].
        aside: of the standing place, along the table's edge [m].
        back: of the standing place, away from the table [m].

    Raises:
        ValueError: a missing joint, an empty or non-finite record, a body that is not of human size (wrong unit).
    """
    positions = np.asarray(positions, float)
    columns = joint_columns(names)
    frames = positions.shape[0]
    if frames < 1 or not np.isfinite(positions).all():
        raise ValueError(f"a record of {frames} frames with finite positions only is needed")
    if not rate > 0:
        raise ValueError(f"the record's rate {rate} Hz must be positive")
    point = {joint: positions[:, columns[joint]] for joint in JOINTS}
    trunk = float(np.median(np.linalg.norm(point["neck"] - point["hip"], axis=-1)))
    if not 0.2 < trunk < 1.0:
        raise ValueError(
            f"hip to neck measures {trunk:.3g} m, not 0.2 to 1.0 m: give the unit of the file's lengths in metres"
        )
    upright = {joint: np.stack([p[:, 0], -p[:, 2], p[:, 1]], axis=-1) for joint, p in point.items()}  # y up to z up
    right = np.median(upright["right_upper_arm"] - upright["left_upper_arm"], axis=0)
    front = np.array([-right[1], right[0]]) / max(float(np.hypot(right[0], right[1])), 1e-9)  # up x right
    place = np.asarray(standing_place(scene, aside, back), float)
    facing = np.asarray(path_middle(scene), float)[:2] - place
    turn = float(np.arctan2(facing[1], facing[0]) - np.arctan2(front[1], front[0]))
    R = np.array([[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])
    turned = {joint: p @ R.T for joint, p in upright.items()}
    hip = turned["hip"]
    ahead = hip[:, :2] @ (facing / np.hypot(*facing))
    nearest = hip[ahead >= np.percentile(ahead, 95)]
    offset = np.array([*(place - np.median(nearest[:, :2], axis=0)), FLOOR_Z + HIP_HEIGHT - np.median(hip[:, 2])])

    count = frame_count(duration, new_rate)
    at = np.clip(np.arange(count) / new_rate * rate, 0, frames - 1)
    first = np.clip(np.floor(at).astype(int), 0, max(frames - 2, 0))
    second, weight = np.minimum(first + 1, frames - 1), (at - first)[:, None]
    dtype = scene.start.dtype
    joints = {
        joint: jnp.asarray((1 - weight) * p[first] + weight * p[second] + offset, dtype) for joint, p in turned.items()
    }
    capsules = jax.vmap(lambda j: body_capsules(_recorded_body(j)))(joints)
    return Person(
        a=capsules.a,
        b=capsules.b,
        radius=capsules.radius[0],
        rate=jnp.asarray(new_rate, dtype),
        present=jnp.ones((count,), bool),
    )


def _recorded_body(j: dict[str, Array]) -> Body:
    """The body of one frame: hands go on from the forearms, legs stand below the hip."""
    hip, neck, head = j["hip"], j["neck"], j["head"]

    def along(start: Vector3, end: Vector3, length: float) -> Vector3:
        way = end - start
        return end + way * (length / jnp.maximum(jnp.sqrt(way @ way + 1e-12), 1e-3))

    across = j["right_upper_arm"] - j["left_upper_arm"]
    flat = jnp.stack([across[0], across[1], jnp.zeros_like(across[0])])
    right = flat / jnp.sqrt(flat @ flat + 1e-9)
    down = jnp.asarray([0.0, 0.0, -1.0], hip.dtype)
    sides = ("left", "right")
    hip_joint = (hip - HIP * right, hip + HIP * right)
    knee = tuple(p + THIGH * down for p in hip_joint)
    return Body(
        hip=hip,
        waist=hip + 0.45 * (neck - hip),
        collar=neck,
        chin=neck + 0.75 * (head - neck),
        crown=along(neck, neck + 0.75 * (head - neck), HEAD),
        shoulder=tuple(j[f"{s}_upper_arm"] for s in sides),  # pyright: ignore[reportArgumentType]  # two of them
        elbow=tuple(j[f"{s}_forearm"] for s in sides),  # pyright: ignore[reportArgumentType]  # two of them
        wrist=tuple(j[f"{s}_hand"] for s in sides),  # pyright: ignore[reportArgumentType]  # two of them
        hand=tuple(along(j[f"{s}_forearm"], j[f"{s}_hand"], HAND) for s in sides),  # pyright: ignore[reportArgumentType]  # two of them
        hip_joint=hip_joint,
        knee=knee,  # pyright: ignore[reportArgumentType]  # two of them
        ankle=tuple(p + SHANK * down for p in knee),  # pyright: ignore[reportArgumentType]  # two of them
    )
