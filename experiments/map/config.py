"""What can be set on the command line of the map."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from hrcjax.lab.options import parse_options

DESCRIPTION = """Take a recording of depth frame by frame into a map: a smooth distance field that remembers.

Writes to runs/map-NAME: map.npz (the map, to be opened again), cloud.ply (its points: static, dynamic, new),
statistics.json, and figures: slices of the distance, the points from three sides. Ctrl-C and SIGTERM end early and still write.

What is read (docs/formats.md has all): lengths in metres, stamps in seconds (other units are found by their size), rotations as
quaternions qx qy qz qw, poses from the camera to the world (a point p of the camera is at R p + t), camera axes x right, y down,
z forward.
  folder    depth/*.png or *.pgm (16 bits), pose.txt with a line tx ty tz qx qy qz qw for each image. The camera is read from a
            file beside the images (camera.txt, intrinsics JSON, YAML of ORB-SLAM or ROS, a 3 x 3 matrix). Without one
            fx 518 fy 519 cx 325.5 cy 253.5 of 640x480 pixels and 1000 a metre are ASSUMED: give --intrinsics, --per-metre.
  TUM       depth.txt, groundtruth.txt with lines stamp tx ty tz qx qy qz qw. Without a camera file fx = fy = 525, cx 319.5,
            cy 239.5 of 640x480 pixels and 5000 a metre are ASSUMED.
  NPZ       depth (height, width) or (frame, height, width) with intrinsics fx fy cx cy; or points (n, 3) or (frame, n, 3);
            optionally mask, stamp, rotation (3, 3), position (3). Whole numbers need --per-metre.
  PLY       vertices x y z in the axes of the world. Whole numbers need --per-metre.
  bag       16UC1 (1000 a metre) or 32FC1 images with CameraInfo, or PointCloud2; poses of tf or of a topic.
  --joints  NPZ with stamp (n) and q (n, 6) [rad]: shoulder pan, shoulder lift, elbow, wrist 1, 2, 3; or any order with
            joint_names. ROS's /joint_states is in the order of the alphabet: give the names.

Exit status: 0 done; 1 results could not be written; 2 wrong options, or nothing was taken in; 3 done, but most frames were
refused; 130 or 143 stopped by Ctrl-C or SIGTERM, with results.

Examples:

  A folder with depth/ and pose.txt, or a TUM RGB-D folder; the box is chosen by a first look:
    python -m experiments.map --input path/to/recording --fit

  A room instead of a table: coarser, and surfaces up to 6 m away:
    python -m experiments.map --input path/to/recording --fit --spacing 0.05 --param far=6

  The surroundings of an arm at the origin, every second of 300 frames:
    python -m experiments.map --input path/to/recording --lower -1 -1 -0.2 --shape 20 20 12 --every 2 --frames 300

  A ROS bag with two depth cameras, in the frame of the robot's base:
    python -m experiments.map --input run.bag --topics /left/depth /right/depth --world-frame base_link

  The same with the arm taken out; ROS's base_link is the arm's base turned by 180 degrees:
    python -m experiments.map --input run.bag --world-frame base_link --joints joints.npz --arm-base base_link

  Point clouds taken by a sensor that stood 1.2 m over the origin:
    python -m experiments.map --input path/to/plys --fit --origin 0 0 1.2

  A UR5 that works in the picture, and nothing but its table:
    python -m experiments.map --input run.npz --joints joints.npz --crop -0.8 -0.8 -0.1 0.8 0.8 1.0

  Go on from a map:
    python -m experiments.map --input path/to/more --continue-from runs/map-recording/map.npz

  How true is it?
    python -m experiments.map --evaluate

In a notebook: from hrcjax.io.map_file import open_map; layout, params, state = open_map("runs/.../map.npz");
hrcjax.map.map_distance(layout, state.levels, params.ratio, x)"""


@dataclass(frozen=True)
class MapConfig:
    """Take a recording frame by frame into a map of distances."""

    input: Path | None = None
    """The recording: a folder with depth/ and pose.txt, a TUM RGB-D folder, PLY or NPZ files or a folder of them, a ROS bag."""
    output: Path | None = None
    """Folder of the results; runs/map-NAME of the recording if not given."""
    overwrite: bool = False
    """Replace a map that is in the folder; other files there stay."""
    continue_from: Path | None = None
    """Go on from this map.npz; its box, sizes and parameters hold."""
    fit: bool = False
    """Choose box, sizes and the limits of depth (near, far) by a first look at the recording."""
    lower: tuple[float, float, float] | None = None
    """Corner of the mapped box with the least coordinates [m]; -2 -2 -0.4 if not given."""
    shape: tuple[int, int, int] | None = None
    """Blocks of 4 x 4 x 4 voxels along x, y and z; 40 40 24 if not given: 4 x 4 x 2.4 m at the default spacing."""
    spacing: float = 0.025
    """Edge of a voxel, which holds one point [m]."""
    capacity: int | None = None
    """Blocks that can hold points; 4096, or by --fit."""
    seen: int | None = None
    """Blocks that one frame can see; 2048, for clouds or by --fit up to all."""
    born: int | None = None
    """Blocks that one frame can add; 1024, for clouds or by --fit up to all."""
    param: tuple[str, ...] = ()
    """Parameters of map and frames as NAME=VALUE, such as far=6 patience=3 top_speed=5; --list shows all."""
    list: bool = False
    """Show all parameters, and stop."""
    start: int = 0
    """Frames of the recording that are passed over first."""
    every: int = 1
    """Take every n-th frame."""
    frames: int | None = None
    """Take at most so many frames."""
    intrinsics: tuple[float, float, float, float, int, int] | None = None
    """fx fy cx cy width height of the depth camera, of images without distortion [px]; without it those of a file beside the images or of CameraInfo. Folders of images, bags."""
    per_metre: float | None = None
    """The number of depth images and points for one metre, such as 1000 for millimetres. Folders: that of the camera's file, or 1000, TUM 5000; bags: 1000 for 16UC1, else 1; NPZ and PLY: 1, and needed for whole numbers."""
    rate: float | None = None
    """Frames a second where the recording has no stamps [Hz]; without it no speed is checked there. Folders with pose.txt, PLY, NPZ."""
    tolerance: float | None = None
    """How far the nearest pose may be from a frame [s]. TUM folders, bags."""
    origin: tuple[float, float, float] | None = None
    """Where the sensor of PLY files stood [m]."""
    topics: tuple[str, ...] | None = None
    """Topics of depth images or clouds. Bags."""
    info_topic: str | None = None
    """Topic of the camera's parameters. Bags."""
    world_frame: str | None = None
    """The frame of tf that is the world. Bags."""
    pose_topic: str | None = None
    """Topic of poses, instead of tf. Bags."""
    body_frame: str | None = None
    """The frame whose pose --pose-topic tells. Bags."""
    see_through: Literal["auto", "always", "never"] = "auto"
    """Whether clouds make free what their rays pass; auto: not those of PLY or NPZ files whose sensor stands at the origin unturned."""
    crop: tuple[float, float, float, float, float, float] | None = None
    """Least and greatest corner of what belongs into the map, x y z x y z [m]; what is measured outside is not taken in."""
    joints: Path | None = None
    """Joints of a robot whose base stands at the world's origin: an NPZ file with stamp (n) [s] and q (n, 6) [rad] from the base to the flange, or q (n, m) and joint_names (m); the robot is taken out of the frames."""
    arm: str = "ur5"
    """Which robot these joints are of: ur5 or ur5e."""
    arm_base: Literal["base", "base_link"] = "base"
    """Which frame of the robot's base the world is: base, the controller's; or base_link, that of ROS, turned by 180 degrees about z."""
    slice_at: tuple[float, float, float] | None = None
    """Point through which the slices go [m]; the middle of the points if not given."""
    bound: bool = False
    """Also draw the lower bound of the distance."""
    figures: bool = True
    """Draw the figures into the folder."""
    json: bool = False
    """Print the statistics as JSON on stdout instead of the summary."""
    evaluate: bool = False
    """Instead of a recording: measure how true the map is, in scenes whose distances are known."""


def parse(argv: Sequence[str]) -> MapConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    return parse_options(MapConfig, argv, "python -m experiments.map", description=DESCRIPTION)
