"""ROS 1 and ROS 2 bags, written here by the library's own writers, with a camera on a moving body."""

import contextlib
import sqlite3
import sys
from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hrcjax.io.recordings.open_input import open_input
from hrcjax.lab.errors import UsageError

pytest.importorskip("rosbags", reason="rosbags is an optional part: pip install hrcjax[bags]")
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

START = 1_700_000_000  # [s]
OPTICAL = Rotation.from_matrix([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])  # body (x forward, z up) from camera
MOUNT = np.array([0.1, 0.0, 0.5])  # of the camera on the body [m]
INFO = "/camera/depth/camera_info"
DEPTH = "/camera/depth/image_rect_raw"
FRAME = "camera_depth_optical_frame"
ODOMETRY = "nav_msgs/msg/Odometry"


def _body(t):
    """Rotation and position of the body at time t [s]: 0.4 m/s, 0.5 rad/s."""
    return Rotation.from_rotvec([0, 0, 0.5 * t]), np.array([0.4 * t, -0.2 * t, 0.0])


def _camera(t):
    turn, position = _body(t)
    return (turn * OPTICAL).as_matrix(), position + turn.apply(MOUNT)


class Recorder:
    """Messages of ROS 1 or ROS 2 by plain numbers, and the writer that keeps them."""

    def __init__(self, path, version):
        self.version = version
        self.store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_HUMBLE)
        if version == 1:
            transforms = "geometry_msgs/TransformStamped[] transforms"
            for kind in ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"):
                self.store.register(get_types_from_msg(transforms, kind))
        self.path = path.with_suffix(".bag") if version == 1 else path
        self.writer = rosbag1.Writer(self.path) if version == 1 else rosbag2.Writer(self.path, version=9)
        self.connections = {}

    def __enter__(self):
        self.writer.open()
        return self

    def __exit__(self, *_):
        self.writer.close()

    def make(self, kind, **fields):
        return self.store.types[kind](**fields)

    def header(self, t, frame):
        nanoseconds = round(t * 1e9)
        stamp = self.make(
            "builtin_interfaces/msg/Time",
            sec=START + nanoseconds // 10**9,
            nanosec=nanoseconds % 10**9,
        )
        sequence = {"seq": 0} if self.version == 1 else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **sequence)

    def write(self, t, topic, kind, *, recorded=None, **fields):
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, kind, typestore=self.store)
        message = self.make(kind, **fields)
        pack = self.store.serialize_ros1 if self.version == 1 else self.store.serialize_cdr
        self.writer.write(
            self.connections[topic],
            START * 10**9 + round((t if recorded is None else recorded) * 1e9),
            pack(message, kind),
        )

    def rotation(self, rotation):
        x, y, z, w = np.asarray(rotation.as_quat() if isinstance(rotation, Rotation) else rotation, float)
        return self.make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def tf(self, t, parent, child, rotation, position, topic="/tf"):
        x, y, z = (float(p) for p in position)
        transform = self.make(
            "geometry_msgs/msg/Transform",
            translation=self.make("geometry_msgs/msg/Vector3", x=x, y=y, z=z),
            rotation=self.rotation(rotation),
        )
        stamped = self.make(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(t, parent),
            child_frame_id=child,
            transform=transform,
        )
        old = self.version == 1 and topic == "/tf"  # recordings of ROS 1 have either type
        self.write(t, topic, "tf/msg/tfMessage" if old else "tf2_msgs/msg/TFMessage", transforms=[stamped])

    def pose(self, rotation, position):
        x, y, z = (float(p) for p in position)
        point = self.make("geometry_msgs/msg/Point", x=x, y=y, z=z)
        return self.make("geometry_msgs/msg/Pose", position=point, orientation=self.rotation(rotation))

    def odometry(self, t, topic, rotation, position, child):
        zero = self.make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
        cover = np.zeros(36)
        pose = self.make("geometry_msgs/msg/PoseWithCovariance", pose=self.pose(rotation, position), covariance=cover)
        twist = self.make("geometry_msgs/msg/Twist", linear=zero, angular=zero)
        covered = self.make("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=cover)
        header = self.header(t, "odom")
        self.write(t, topic, ODOMETRY, header=header, child_frame_id=child, pose=pose, twist=covered)

    def camera_info(self, t, topic=INFO, fx=60.0, width=8, height=6):
        k = np.array([fx, 0, 4.0, 0, 61.0, 3.0, 0, 0, 1])
        p = np.array([fx + 2, 0, 3.5, 0, 0, 63.0, 2.5, 0, 0, 0, 1, 0]) if fx else np.zeros(12)
        region = self.make(
            "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
        )
        names = {"d": np.zeros(5), "k": k, "r": np.eye(3).ravel(), "p": p}
        names = {name.upper() if self.version == 1 else name: value for name, value in names.items()}
        self.write(
            t,
            topic,
            "sensor_msgs/msg/CameraInfo",
            header=self.header(t, FRAME),
            height=height,
            width=width,
            distortion_model="plumb_bob",
            binning_x=0,
            binning_y=0,
            roi=region,
            **names,
        )

    def image(self, t, values, encoding="16UC1", topic=DEPTH, frame=FRAME, pad=3, big=False, cut=0, recorded=None):
        """Writes rows of `values` with `pad` bytes after each; `cut` bytes are missing at the end."""
        dtype = {"16UC1": "u2", "mono16": "u2", "32FC1": "f4", "rgb8": "u1"}[encoding]
        rows = np.asarray(values, (">" if big else "<") + dtype).reshape(len(values), -1)
        size = rows.shape[1] * rows.itemsize
        data = np.full((len(rows), size + pad), 255, np.uint8)
        data[:, :size] = np.ascontiguousarray(rows).view(np.uint8)
        self.write(
            t,
            topic,
            "sensor_msgs/msg/Image",
            recorded=recorded,
            header=self.header(t, frame),
            height=len(rows),
            width=np.shape(values)[1],
            encoding=encoding,
            is_bigendian=int(big),
            step=size + pad,
            data=data.ravel()[: data.size - cut],
        )

    def cloud(self, t, points, topic="/points", frame=FRAME, names="xyz", big=False, cut=0):
        """Points with four bytes of intensity before and five of padding after x, y, z; z is a double."""
        order = ">" if big else "<"
        layout = np.dtype(
            {
                "names": list(names),
                "formats": [order + "f4", order + "f4", order + "f8"],
                "offsets": [4, 8, 12],
                "itemsize": 25,
            }
        )
        rows = np.zeros(len(points), layout)
        for name, column in zip(names, np.transpose(points), strict=True):
            rows[name] = column
        make = self.make
        fields = [
            make("sensor_msgs/msg/PointField", name=name, offset=offset, datatype=kind, count=1)
            for name, offset, kind in (("intensity", 0, 7), *zip(names, (4, 8, 12), (7, 7, 8), strict=True))
        ]
        data = np.frombuffer(rows.tobytes(), np.uint8)
        self.write(
            t,
            topic,
            "sensor_msgs/msg/PointCloud2",
            header=self.header(t, frame),
            height=1,
            width=len(points),
            fields=fields,
            is_bigendian=big,
            point_step=25,
            row_step=25 * len(points),
            data=data[: len(data) - cut],
            is_dense=False,
        )

    def moving_tf(self, until=1.0):
        """map -> odom -> base at 10 Hz, and the camera on the base."""
        self.tf(0.0, "base", FRAME, OPTICAL, MOUNT, "/tf_static")
        self.tf(0.0, "map", "odom", Rotation.from_rotvec([0, 0, 0.3]), (1, 2, 3), "/tf_static")
        for t in np.arange(0, until + 0.01, 0.1):
            self.tf(t, "odom", "base", *_body(t))


@pytest.fixture(params=[1, 2], ids=["ros1", "ros2"])
def recorder(request, tmp_path):
    return Recorder(tmp_path / "recording", request.param)


@pytest.fixture
def ros1(tmp_path):
    """For what happens after the messages are read: bags of ROS 1 open faster."""
    return Recorder(tmp_path / "recording", 1)


def _one_line(error) -> str:
    message = str(error.value)
    assert "\n" not in message and ("accepted" in message or "name" in message or "pip install" in message)
    return message


def _refused(path, **options):
    """The line with which a bag is refused, at the latest while it is read."""
    with pytest.raises(UsageError) as error:
        list(open_input(path, **options))
    return _one_line(error)


FLAT = np.full((6, 8), 1500)
POINTS = np.array([[1.0, 2.0, 3.0], [-1.0, 0.5, 2.0], [np.nan, 1, 1], [0, 0, 0]])


def test_depth_with_moving_tf(recorder):
    with recorder as r:
        r.moving_tf()
        r.camera_info(0.0)
        for i, t in enumerate((0.0, 0.33, 0.77, 0.33, 1.05, 1.5)):
            depth = np.full((6, 8), 1000 + i)
            depth[1, 2] = 0
            r.image(t, depth, recorded=i)
    source = open_input(r.path, world_frame="odom")
    frames = list(source)
    stamps = [f.stamp - START for f in frames]
    np.testing.assert_allclose(stamps, [0, 0.33, 0.77, 0.33, 1.05], atol=1e-6)
    assert (
        source.length == 6 and len(source.skipped) == 1 and "odom -> base has nothing within 0.1 s" in source.skipped[0]
    )
    for i, (f, t) in enumerate(zip(frames, stamps, strict=True)):
        rotation, position = _camera(min(t, 1.0))
        np.testing.assert_allclose(f.rotation, rotation, atol=1e-6)
        np.testing.assert_allclose(f.position, position, atol=1e-6)
        assert f.depth.dtype == np.float32 and f.depth[1, 2] == 0 and f.camera == ""
        np.testing.assert_allclose(f.depth[0], (1000 + i) / 1000, rtol=1e-6)
        assert (f.intrinsics.fx, f.intrinsics.fy, f.intrinsics.cx, f.intrinsics.cy) == (62, 63, 3.5, 2.5)
    turn = Rotation.from_rotvec([0, 0, 0.3])
    for f, g in zip(frames, open_input(r.path), strict=True):  # the root is the world without a name
        np.testing.assert_allclose(g.position, turn.apply(f.position) + np.array([1, 2, 3]), atol=1e-9)
        np.testing.assert_allclose(g.rotation, turn.as_matrix() @ f.rotation, atol=1e-9)
    assert len(list(open_input(r.path, tolerance=0.6))) == 6
    (first, *_) = open_input(r.path, per_metre=500.0)
    np.testing.assert_allclose(first.depth[0], 2, rtol=1e-6)


def test_a_world_beside_the_camera(ros1):
    """A second branch of tf is the world: the moving base turns about it."""
    with ros1 as r:
        r.moving_tf()
        r.tf(0.0, "map", "board", Rotation.from_rotvec([0.1, 0.2, 0.3]), (3, 2, 1), "/tf_static")
        r.camera_info(0.0)
        r.image(0.5, FLAT)
    (seen,) = open_input(r.path, world_frame="board")
    (root,) = open_input(r.path)
    board = Rotation.from_rotvec([0.1, 0.2, 0.3]).as_matrix()
    np.testing.assert_allclose(board @ seen.position + [3, 2, 1], root.position, atol=1e-9)
    np.testing.assert_allclose(board @ seen.rotation, root.rotation, atol=1e-9)


def test_depth_of_floats_and_of_either_byte_order(recorder):
    values = np.array([[1.25, np.nan, -1.0], [np.inf, 0.0, 2.5]])
    with recorder as r:
        r.moving_tf()
        r.camera_info(0.0, width=3, height=2)
        for big in (False, True):
            r.image(0.0, values, "32FC1", big=big)
            r.image(0.0, np.array([[1, 2, 3], [4, 5, 256]]), "16UC1", big=big)
    frames = list(open_input(r.path))
    for first, second in (frames[:2], frames[2:]):
        assert first.depth.tolist() == [[1.25, 0, 0], [0, 0, 2.5]]
        np.testing.assert_allclose(second.depth, np.array([[1, 2, 3], [4, 5, 256]]) / 1000, rtol=1e-6)


def test_point_clouds(recorder):
    with recorder as r:
        r.moving_tf()
        r.image(0.0, np.zeros((2, 2, 3)), "rgb8", topic="/camera/color")
        for big in (False, True):
            r.cloud(0.25, POINTS, big=big)
        r.cloud(0.5, POINTS[2:])
        r.cloud(0.6, POINTS, cut=30)
    source = open_input(r.path, world_frame="odom")
    frames = list(source)
    assert len(frames) == 2
    for frame in frames:
        assert frame.depth is None and frame.intrinsics is None and frame.cloud.dtype == np.float32
        np.testing.assert_allclose(frame.cloud, POINTS[:2])
        np.testing.assert_allclose(frame.position, _camera(0.25)[1], atol=1e-6)
    assert [s.split(": ")[1].split(",")[0] for s in source.skipped] == ["no finite point", "70 bytes"]


def test_poses_of_topics(recorder):
    with recorder as r:
        r.tf(0.0, "base", "/" + FRAME, OPTICAL, MOUNT, "/tf_static")
        r.camera_info(0.0)
        for t in (0.0, 0.1, 0.2, 0.3, 0.4):
            turn, position = _body(t)
            r.odometry(t, "/odometry", turn, position if t != 0.3 else (0, np.nan, 0), "base")
            rotation, position = _camera(t)
            pose = r.pose(Rotation.from_matrix(rotation), position)
            r.write(t, "/pose", "geometry_msgs/msg/PoseStamped", header=r.header(t, "odom"), pose=pose)
            pose = r.pose(*_body(t))
            r.write(t, "/body", "geometry_msgs/msg/PoseStamped", header=r.header(t, "odom"), pose=pose)
            r.image(t + 0.05, FLAT)
    for options in (
        {"pose_topic": "/odometry"},
        {"pose_topic": "/pose"},
        {"pose_topic": "/pose", "body_frame": FRAME},
        {"pose_topic": "/body", "body_frame": "/base"},
    ):
        source = open_input(r.path, **options)
        frames = list(source)
        assert len(frames) == 5
        for f, t in zip(frames, (0.05, 0.15, 0.25, 0.35, 0.4), strict=True):
            rotation, position = _camera(t)
            np.testing.assert_allclose(f.rotation, rotation, atol=1e-6)
            np.testing.assert_allclose(f.position, position, atol=1e-3)  # the camera's own way is an arc
        bad = ["/odometry: 1 poses are not finite or have no unit quaternion"]
        assert source.skipped == (bad if options["pose_topic"] == "/odometry" else [])
    assert "tf does not connect" in _refused(r.path, pose_topic="/odometry", body_frame="gripper")
    assert "has no poses at /none" in _refused(r.path, pose_topic="/none")
    assert "is of sensor_msgs/msg/Image" in _refused(r.path, pose_topic=DEPTH)
    assert "not both" in _refused(r.path, pose_topic="/pose", world_frame="odom")
    assert "needs a pose topic" in _refused(r.path, body_frame="base")


def test_several_cameras_and_topics_by_name(ros1):
    with ros1 as r:
        r.moving_tf()
        r.tf(0.0, "map", "fixed", OPTICAL, (0, 0, 2), "/tf_static")
        for name, frame in (("left", FRAME), ("right", "fixed")):
            r.camera_info(0.0, f"/{name}/camera_info", fx=100.0 if name == "left" else 200.0)
            r.image(0.2, FLAT, topic=f"/{name}/depth", frame=frame)
        r.image(0.2, FLAT, "32FC1", topic="/left/confidence")
        r.cloud(0.2, POINTS)
    left, right = open_input(r.path)
    assert (left.camera, right.camera) == ("/left/depth", "/right/depth")
    assert (left.intrinsics.fx, right.intrinsics.fx) == (102, 202)
    assert right.position.tolist() == [0, 0, 2] and left.position.tolist() != [0, 0, 2]
    (cloud,) = open_input(r.path, topics=["/points"])
    assert cloud.camera == "" and len(cloud.cloud) == 2
    (other,) = open_input(r.path, topics=["/left/depth"], info_topic="/right/camera_info")
    assert other.intrinsics.fx == 202
    (given,) = open_input(r.path, topics=["/left/depth"], intrinsics=left.intrinsics)
    assert given.intrinsics == left.intrinsics
    assert "no depth at /none" in _refused(r.path, topics=["/none"])
    assert "no sensor_msgs/CameraInfo at /none" in _refused(r.path, info_topic="/none")
    assert "does not connect" in _refused(r.path, world_frame="mars")


def test_frames_that_cannot_be_used_are_named(ros1):
    with ros1 as r:
        r.moving_tf()
        r.tf(0.15, "odom", "base", (0, 0, 0, 2), (0, 0, 0))
        r.camera_info(0.0)
        r.image(0.0, FLAT)
        r.image(0.1, FLAT, cut=40)
        r.image(0.2, FLAT[:4])
        r.image(0.3, np.zeros((6, 8, 3)), "rgb8")
        r.image(0.4, FLAT, frame="other")
    source = open_input(r.path, topics=[DEPTH])
    assert len(list(source)) == 1
    expected = ["1 transforms are not finite", "bytes", "8x4 pixels", "encoding rgb8", "its frame is other"]
    assert len(source.skipped) == 5
    assert all(words in line and "\n" not in line for words, line in zip(expected, source.skipped, strict=True))


def test_bags_without_depth_camera_or_pose(tmp_path):
    def bag(number, *steps):
        with Recorder(tmp_path / str(number), 1) as r:
            for name, arguments in steps:
                getattr(r, name)(*arguments)
        return _refused(r.path)

    tf, info, image = ("moving_tf", ()), ("camera_info", (0.0,)), ("image", (0.5, FLAT))
    color = ("image", (0.0, np.zeros((2, 2, 3)), "rgb8"))
    cases = {
        "has no topic of depth": (tf, info, color),
        "no pose of frame": (info, image),
        "has no sensor_msgs/CameraInfo": (tf, image),
        "intrinsics fx 0.0": (tf, ("camera_info", (0.0, INFO, 0.0)), image),
        "8x6 pixels, its intrinsics are of 9x6": (tf, ("camera_info", (0.0, INFO, 60.0, 9)), image),
        "may be depth: name the topics": (tf, info, *(("image", (0, FLAT, "16UC1", n)) for n in ("/a", "/b"))),
        "has the point clouds /a, /b": (tf, *(("cloud", (0, POINTS, n)) for n in ("/a", "/b"))),
        "has the parents map, odom": (tf, ("tf", (0.0, "map", "base", OPTICAL, MOUNT)), info, image),
        "has a cycle": (tf, ("tf", (0.0, FRAME, "map", OPTICAL, MOUNT)), info, image),
        "none of its 1 frames can be used": (tf, info, ("image", (5.0, FLAT))),
        "fields intensity, a, b, c": (tf, ("cloud", (0.0, POINTS, "/points", FRAME, "abc"))),
        "tf has the roots base, map": (
            ("tf", (0.0, "map", "x", OPTICAL, MOUNT)),
            ("tf", (0.0, "base", FRAME, OPTICAL, MOUNT)),
            info,
            image,
            ("image", (0.0, FLAT, "16UC1", "/camera/depth/other", "x")),
        ),
    }
    for number, (words, steps) in enumerate(cases.items()):
        assert words in bag(number, *steps), words


def test_a_camera_that_stands_still_is_its_own_world(ros1):
    with ros1 as r:
        r.camera_info(0.0)
        r.image(0.0, FLAT)
    (frame,) = open_input(r.path, world_frame=FRAME)
    assert (frame.rotation == np.eye(3)).all() and (frame.position == 0).all()


def test_one_body_for_several_sensors_needs_a_name(ros1):
    with ros1 as r:
        for name in ("left", "right"):
            r.tf(0.0, "base", name, OPTICAL, MOUNT, "/tf_static")
            r.image(0.0, FLAT, topic=f"/{name}/depth", frame=name)
        r.camera_info(0.0)
        for topic, rotation in (("/pose", Rotation.identity()), ("/bad", (0, 0, 0, 3))):
            pose = r.pose(rotation, (1, 2, 3))
            r.write(0, topic, "geometry_msgs/msg/PoseStamped", header=r.header(0.0, "map"), pose=pose)
    assert "is of one body" in _refused(r.path, pose_topic="/pose")
    assert "no pose of /bad is finite" in _refused(r.path, pose_topic="/bad", body_frame="base")
    assert len(list(open_input(r.path, pose_topic="/pose", body_frame="base"))) == 2


def test_storages_and_parts(tmp_path):
    def fill(r, t):
        r.moving_tf()
        r.camera_info(0.0)
        r.image(t, FLAT)

    (tmp_path / "parts").mkdir()
    for i, t in enumerate((0.2, 0.5)):
        with Recorder(tmp_path / "parts" / f"part_{i}", 1) as r:
            fill(r, t)
    assert [round(f.stamp - START, 3) for f in open_input(tmp_path / "parts")] == [0.2, 0.5]
    r = Recorder(tmp_path / "m", 2)
    r.writer = rosbag2.Writer(tmp_path / "m", version=9, storage_plugin=rosbag2.StoragePlugin.MCAP)
    with r:
        fill(r, 0.2)
    (file,) = (tmp_path / "m").glob("*.mcap")
    for path in (tmp_path / "m", file):
        assert [round(f.stamp - START, 3) for f in open_input(path)] == [0.2]
    with Recorder(tmp_path / "old", 2) as r:
        fill(r, 0.2)
    (file,) = (tmp_path / "old").glob("*.db3")
    with contextlib.closing(sqlite3.connect(file)) as database:  # older recordings carry no definitions of messages
        database.execute("DELETE FROM message_definitions")
        database.commit()
    assert len(list(open_input(file))) == 1
    file.rename(tmp_path / "parts" / "a.db3")
    assert "holds part_0.bag, part_1.bag, a.db3" in _refused(tmp_path / "parts")
    assert "missing" in _refused(tmp_path / "old")


def test_broken_bags(tmp_path):
    for version, name in product((1, 2), ("a", "b")):
        with Recorder(tmp_path / name, version) as r:
            r.moving_tf()
            r.camera_info(0.0)
            r.image(0.2, FLAT)
    for path in (tmp_path / "a.bag", next((tmp_path / "a").glob("*.db3"))):
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert "cannot be read" in _refused(tmp_path / "a.bag")
    assert "cannot be read" in _refused(tmp_path / "a")
    (tmp_path / "b.bag").write_bytes(b"nothing")
    assert "cannot be read" in _refused(tmp_path / "b.bag")
    (tmp_path / "b" / "metadata.yaml").write_text("nothing: [")
    assert "cannot be read" in _refused(tmp_path / "b")
    (tmp_path / "c.mcap").write_bytes(b"")
    assert "cannot be read" in _refused(tmp_path / "c.mcap")
    for options, words in (({"tolerance": -1.0}, "tolerance of stamps is -1"), ({"per_metre": 0.0}, "scale of depth")):
        assert words in _refused(tmp_path / "b.bag", **options)


def test_without_the_library_one_line_says_what_to_install(tmp_path, monkeypatch):
    (tmp_path / "a.bag").write_bytes(b"")
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    assert "pip install hrcjax[bags]" in _refused(tmp_path / "a.bag")
