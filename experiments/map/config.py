"""Command-line options of the map program."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from hrcjax.lab.options import parse_options

DESCRIPTION = """Map a recording of depth images or point clouds: a smooth distance field that is updated frame by frame.

Writes to runs/map-NAME: map.npz (the map), cloud.ply (its points, labelled static, dynamic or new), statistics.json, and figures:
slices of the distance field and three views of the points. After Ctrl-C or SIGTERM the results so far are written.

Accepted formats (details in docs/formats.md): lengths in metres, stamps in seconds (other units are inferred), rotations as
quaternions qx qy qz qw, poses from the camera to the world (camera point p is at R p + t in the world), camera axes x right, y down,
z forward.
  folder    depth/*.png or *.pgm (16 bits), pose.txt with a line tx ty tz qx qy qz qw for each image. The camera is read from a
            file beside the images (camera.txt, intrinsics JSON, YAML of ORB-SLAM or ROS, a 3 x 3 matrix). Without one
            fx 518 fy 519 cx 325.5 cy 253.5 of 640x480 pixels and 1000 per metre are ASSUMED: give --intrinsics, --per-metre.
  TUM       depth.txt, groundtruth.txt with lines stamp tx ty tz qx qy qz qw. Without a camera file fx = fy = 525, cx 319.5,
            cy 239.5 of 640x480 pixels and 5000 per metre are ASSUMED.
  NPZ       depth (height, width) or (frame, height, width) with intrinsics fx fy cx cy; or points (n, 3) or (frame, n, 3);
            optionally mask, stamp, rotation (3, 3), position (3). Integers need --per-metre.
  PLY       vertices x y z in world axes. Integers need --per-metre.
  bag       16UC1 (1000 per metre) or 32FC1 images with CameraInfo, or PointCloud2; poses of tf or of a topic.
  --joints  NPZ with stamp (n) and q (n, 6) [rad]: shoulder pan, shoulder lift, elbow, wrist 1, 2, 3; or any order with
            joint_names. ROS's /joint_states is in alphabetical order: give the names.

Exit status: 0 done; 1 results could not be written; 2 invalid options, or no data in the map; 3 done, but most frames were
refused; 130 or 143 stopped by Ctrl-C or SIGTERM, with results.

Examples:

  A folder with depth/ and pose.txt, or a TUM RGB-D folder; the box is chosen from the data:
    python -m experiments.map --input path/to/recording --fit

  A room instead of a table: coarser, and surfaces up to 6 m away:
    python -m experiments.map --input path/to/recording --fit --spacing 0.05 --param far=6

  The surroundings of an arm at the origin, 300 frames, every second one:
    python -m experiments.map --input path/to/recording --lower -1 -1 -0.2 --shape 20 20 12 --every 2 --frames 300

  A ROS bag with two depth cameras, in the frame of the robot's base:
    python -m experiments.map --input run.bag --topics /left/depth /right/depth --world-frame base_link

  The same with the arm removed; ROS's base_link is the arm's base rotated by 180 degrees:
    python -m experiments.map --input run.bag --world-frame base_link --joints joints.npz --arm-base base_link

  Point clouds of a sensor 1.2 m above the origin:
    python -m experiments.map --input path/to/plys --fit --origin 0 0 1.2

  A UR5 in view; map its table only:
    python -m experiments.map --input run.npz --joints joints.npz --crop -0.8 -0.8 -0.1 0.8 0.8 1.0

  Continue from a saved map:
    python -m experiments.map --input path/to/more --continue-from runs/map-recording/map.npz

  Measure the accuracy:
    python -m experiments.map --evaluate

In a notebook: from hrcjax.io.map_file import open_map; layout, params, state = open_map("runs/.../map.npz");
hrcjax.map.map_distance(layout, state.levels, params.ratio, x)"""


@dataclass(frozen=True)
class MapConfig:
    """Map a recording of depth images or point clouds."""

    input: Path | None = None
    """The recording: a folder with depth/ and pose.txt, a TUM RGB-D folder, PLY or NPZ files or a folder of them, a ROS bag."""
    output: Path | None = None
    """Folder of the results; runs/map-NAME of the recording if not given."""
    overwrite: bool = False
    """Replace a map in the folder; other files there are kept."""
    continue_from: Path | None = None
    """Continue from this map.npz, with its box, sizes and parameters."""
    fit: bool = False
    """Choose box, sizes and depth range (near, far) from the recording, in a first pass over some frames."""
    lower: tuple[float, float, float] | None = None
    """Minimum corner of the mapped box [m]; -2 -2 -0.4 if not given."""
    shape: tuple[int, int, int] | None = None
    """Blocks of 4 x 4 x 4 voxels along x, y and z; 40 40 24 if not given: 4 x 4 x 2.4 m at the default spacing."""
    spacing: float = 0.025
    """Edge of a voxel, which holds one point [m]."""
    capacity: int | None = None
    """Blocks that can hold points; 4096, or by --fit."""
    seen: int | None = None
    """Blocks that one frame can update; 2048, for clouds or by --fit up to all."""
    born: int | None = None
    """Blocks that one frame can add; 1024, for clouds or by --fit up to all."""
    param: tuple[str, ...] = ()
    """Parameters of map and frames as NAME=VALUE, such as far=6 patience=3 top_speed=5; --list shows all of them."""
    list: bool = False
    """List all parameters and exit."""
    start: int = 0
    """Number of frames to skip at the beginning."""
    every: int = 1
    """Use every n-th frame."""
    frames: int | None = None
    """Use at most this many frames."""
    intrinsics: tuple[float, float, float, float, int, int] | None = None
    """Intrinsics fx fy cx cy width height of the depth camera, without distortion [px]; if not given, those of a camera file in the folder or of CameraInfo. Folders of images, bags."""
    per_metre: float | None = None
    """Units of depth or coordinates per metre, such as 1000 for millimetres. If not given: folders: that of the camera file, or 1000, TUM 5000; bags: 1000 for 16UC1, else 1; NPZ and PLY: 1; required for integers."""
    rate: float | None = None
    """Frame rate of a recording without stamps [Hz]; if not given, speeds are not checked. Folders with pose.txt, PLY, NPZ."""
    tolerance: float | None = None
    """Largest time difference between a frame and the nearest pose [s]. TUM folders, bags."""
    origin: tuple[float, float, float] | None = None
    """Position of the sensor of PLY files [m]."""
    topics: tuple[str, ...] | None = None
    """Topics of depth images or clouds. Bags."""
    info_topic: str | None = None
    """Topic of the CameraInfo. Bags."""
    world_frame: str | None = None
    """The tf frame used as the world frame. Bags."""
    pose_topic: str | None = None
    """Topic of poses, instead of tf. Bags."""
    body_frame: str | None = None
    """The tf frame whose pose --pose-topic holds. Bags."""
    see_through: Literal["auto", "always", "never"] = "auto"
    """Free-space carving by clouds: whether points that their rays pass are removed; auto: except for PLY and NPZ files whose sensor pose is the identity, as it may be unknown."""
    crop: tuple[float, float, float, float, float, float] | None = None
    """Crop box, minimum and maximum corner x y z x y z [m]; points outside are not added to the map."""
    joints: Path | None = None
    """Joints of a robot whose base stands at the world's origin: an NPZ file with stamp (n) [s] and q (n, 6) [rad] from the base to the flange, or q (n, m) and joint_names (m); the robot's points are removed from the frames."""
    arm: str = "ur5"
    """Robot of these joints: ur5 or ur5e."""
    arm_base: Literal["base", "base_link"] = "base"
    """Base frame of the robot that coincides with the world: base, the controller's; or base_link, that of ROS, rotated by 180 degrees about z."""
    slice_at: tuple[float, float, float] | None = None
    """Point through which the slices pass [m]; the centre of the points if not given."""
    bound: bool = False
    """Also draw the 95 % lower bound of the distance."""
    figures: bool = True
    """Draw figures into the folder."""
    json: bool = False
    """Print the statistics as JSON on stdout instead of the summary."""
    evaluate: bool = False
    """Measure the accuracy of the map in generated scenes with exact distances, instead of mapping a recording."""


def parse(argv: Sequence[str]) -> MapConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    return parse_options(MapConfig, argv, "python -m experiments.map", description=DESCRIPTION)
