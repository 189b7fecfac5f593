"""Sensor poses of a bag, from tf or from a pose topic."""

from collections.abc import Callable

import numpy as np

from hrcjax.io.recordings.bag_file import Bag
from hrcjax.io.recordings.bag_messages import frame_name, pose_row, stamp_of
from hrcjax.io.recordings.pose import Pose, Trajectory, fault_of_numbers
from hrcjax.io.recordings.transforms import NoPoseError, TransformTree
from hrcjax.lab.errors import UsageError

PoseLookup = Callable[[str, float], Pose]  # frame of a sensor, stamp [s] -> world from sensor, or NoPoseError
TF_TYPES = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
PLAIN = "geometry_msgs/msg/PoseStamped"
COVERED = ("nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseWithCovarianceStamped")
ACCEPTED = "a topic of geometry_msgs/PoseStamped, geometry_msgs/PoseWithCovarianceStamped or nav_msgs/Odometry"


def read_transforms(bag: Bag) -> TransformTree:
    """All transforms of tf and tf_static, in any namespace."""
    tree = TransformTree()
    for topic, message in bag.messages(*bag.of_type(*TF_TYPES)):
        tree.add(message.transforms, static=topic.endswith("tf_static"))
    tree.close()
    return tree


def poses_of_tf(bag: Bag, tree: TransformTree, frames: set[str], world: str | None, tolerance: float) -> PoseLookup:
    """Poses by tf from a sensor's frame to `world`; without a name, to the common root of the sensors.

    Raises:
        UsageError: a sensor's frame is not in tf or not connected to the world, or tf has several roots.
    """
    if world is None:
        alone = sorted(frame for frame in frames if len(tree.chain(frame)) == 1)
        if alone:
            raise UsageError(
                f"bag {bag.path}: no pose of frame {', '.join(alone)}: accepted is tf above it, a topic of poses, or "
                "the frame itself as the world frame if it stands still"
            )
        roots = sorted({tree.chain(frame)[-1] for frame in frames})
        if len(roots) > 1:
            raise UsageError(f"bag {bag.path}: tf has the roots {', '.join(roots)}: accepted is one above all sensors")
        world = roots[0]
    name = frame_name(world)
    for frame in sorted(frames):
        if tree.chain(frame)[-1] != tree.chain(name)[-1]:
            above = " -> ".join(reversed(tree.chain(frame)))
            raise UsageError(
                f"bag {bag.path}: tf does not connect {frame} to {name}: accepted is a frame connected to {above}"
            )
    return lambda frame, stamp: tree.pose(name, frame, stamp, tolerance)


def poses_of_topic(
    bag: Bag, tree: TransformTree, frames: set[str], topic: str, body: str | None, tolerance: float
) -> PoseLookup:
    """Poses of a body from a topic, and from the body to a sensor by tf.

    The body is the frame `body`; without a name, the child frame of nav_msgs/Odometry, or else the sensor itself.

    Raises:
        UsageError: no such topic, no valid pose in it, tf does not connect body and sensor.
    """
    kind = bag.types.get(topic)
    if kind is None or not bag.counts[topic]:
        there = ", ".join(bag.of_type(PLAIN, *COVERED)) or "none"
        raise UsageError(f"bag {bag.path} has no poses at {topic}: accepted is {ACCEPTED}, here {there}")
    if kind != PLAIN and kind not in COVERED:
        raise UsageError(f"bag {bag.path}: topic {topic} is of {kind}: accepted is {ACCEPTED}")
    rows, bad = [], 0
    for _, message in bag.messages(topic):
        pose = message.pose if kind == PLAIN else message.pose.pose
        row = pose_row(stamp_of(message.header), pose.position, pose.orientation)
        if fault_of_numbers(np.array(row[1:])):
            bad += 1
            continue
        rows.append(row)
    if bad:
        tree.faults.append(f"{topic}: {bad} poses are not finite or have no unit quaternion")
    if not rows:
        raise UsageError(f"bag {bag.path}: no pose of {topic} is finite with a unit quaternion: accepted is {ACCEPTED}")
    trajectory = Trajectory(np.array(rows, np.float64))
    name = frame_name(body or getattr(bag.first(topic), "child_frame_id", ""))
    if not name and len(frames) > 1:
        raise UsageError(
            f"bag {bag.path}: {topic} is of one body, the sensors are {', '.join(sorted(frames))}: "
            "accepted is a named frame of the body"
        )
    for frame in sorted(frames):
        if name and tree.chain(frame)[-1] != tree.chain(name)[-1]:
            raise UsageError(
                f"bag {bag.path}: tf does not connect {frame} to {name}, the body of {topic}: "
                f"accepted is a connected frame, or {frame} itself as the body if the poses are its own"
            )

    def lookup(frame: str, stamp: float) -> Pose:
        pose = trajectory.at(stamp, tolerance)
        if pose is None:
            raise NoPoseError(f"{topic} has nothing within {tolerance:g} s")
        return pose @ tree.pose(name or frame, frame, stamp, tolerance)

    return lookup
