"""Recorded depth into scene files: the frames of recordings, each alone or together, with the plane they stand on."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

from hrcjax.io.onnx_segmenter import open_segmenter
from hrcjax.io.recordings.frame import InputFrame
from hrcjax.io.recordings.open_input import open_input
from hrcjax.io.scene_file import write_scene
from hrcjax.lab.case_store import FIGURES
from hrcjax.lab.errors import UsageError
from hrcjax.lab.progress import Progress
from hrcjax.sense import NoiseParams
from hrcjax.task_space import (
    Segmenter,
    TaskSpace,
    TaskSpaceParams,
    View,
    find_table,
    instances_scene,
    map_table,
    no_segmenter,
    obstacle_grid,
)
from hrcjax.task_space.view import mean_depth
from hrcjax.world import robotica

from .config import TaskSpaceConfig

KINDS = {-1: "points", 0: "sphere", 1: "column", 2: "box"}
TILT = 0.8
"""Greatest angle of the plane's normal to upwards if that is not given: a camera may look down [rad]."""
PARAMS = TaskSpaceParams(ceiling=1.2)
"""Of recorded frames: rooms have higher things than tables."""


class MappedFrame(NamedTuple):
    """What became of one frame, or of several together."""

    name: str
    found: TaskSpace | None
    """None: no plane in it."""
    figure: str
    """Name of its figure; "" without."""
    text: str
    """One line."""


def check_input(config: TaskSpaceConfig) -> None:
    """Refuses options of --input that cannot be.

    Raises:
        UsageError: what is wrong.
    """
    for option in ("up", "start", "goal"):
        values = getattr(config, option)
        if values and len(values) != 3:
            raise UsageError(f"--{option} has {len(values)} numbers; accepted are three")
    if config.up and np.linalg.norm(config.up) < 1e-6:
        raise UsageError("--up is no direction; accepted are three numbers that are not all 0")
    if config.names and not config.segmenter:
        raise UsageError("--names needs --segmenter")


def colours(path: Path, count: int) -> list[np.ndarray | None]:
    """Colour images in color/ beside depth/, in natural order; None where they are not as many as depth images."""
    files = [file for file in (path / "color").glob("*") if file.suffix.lower() in (".png", ".jpg", ".jpeg")]
    if len(files) != count:
        return [None] * count
    files.sort(key=lambda file: [int(word) if word.isdigit() else word for word in re.split(r"(\d+)", file.name)])
    return [np.asarray(Image.open(file).convert("RGB")) for file in files]


def view_of_frame(frame: InputFrame, colour: np.ndarray | None) -> View:
    """The view of one frame."""
    if frame.depth is None or frame.intrinsics is None:
        raise UsageError("--input holds clouds; accepted are recordings of depth images")
    k = frame.intrinsics
    depth, deviation = mean_depth(np.asarray(frame.depth, float)[None], NoiseParams())
    same = colour is not None and colour.shape[:2] == depth.shape
    focal, centre = np.array([k.fx, k.fy]), np.array([k.cx, k.cy])
    return View(frame.rotation, frame.position, focal, centre, depth, deviation, colour if same else None)


def read_views(config: TaskSpaceConfig, path: Path) -> list[View]:
    """The views of a recording."""
    source = open_input(path)
    frames = []
    for frame in source:
        frames.append(frame)
        if config.frames and len(frames) == config.frames:
            break
    if not frames:
        raise UsageError(f"{path} holds no frame that can be read")
    images = colours(path, source.length or 0)[: len(frames)] if path.is_dir() else [None] * len(frames)
    return [view_of_frame(frame, image) for frame, image in zip(frames, images or [None] * len(frames), strict=True)]


def map_input(config: TaskSpaceConfig, folder: Path) -> list[MappedFrame]:
    """Maps every frame, or all together; writes scene files, grids and figures into the folder."""
    segmenter = open_segmenter(config.segmenter, config.names) if config.segmenter else no_segmenter
    groups: list[tuple[str, list[View]]] = []
    for text in config.input:
        views = read_views(config, Path(text))
        one = [(Path(text).stem, views)] if config.together else [(f"{Path(text).stem}-{k + 1}" if len(config.input) > 1 else str(k + 1), [v]) for k, v in enumerate(views)]  # fmt: skip
        groups += one
    done = []
    with Progress(len(groups), unit="frame") as progress:
        for name, views in groups:
            done.append(_mapped(config, folder, name, views, segmenter))
            progress.advance(1, None, name)
            progress.say(done[-1].text)
    if not any(one.found for one in done):
        raise UsageError(f"no plane to stand on in any frame of {', '.join(config.input)}; give --up")
    return done


def _mapped(config: TaskSpaceConfig, folder: Path, name: str, views: list[View], segmenter: Segmenter) -> MappedFrame:
    up = np.array(config.up, float) if config.up else -views[0].rotation[:, 1]
    try:
        table = find_table(views, up / np.linalg.norm(up), 0.35 if config.up else TILT)
        found = map_table(views, up, PARAMS, segmenter, table)
    except ValueError as error:
        return MappedFrame(name, None, "", f"{name}: {error}")
    like = robotica()
    ends = {option: np.asarray(getattr(config, option) or getattr(like, option), np.float32) for option in ("start", "goal")}  # fmt: skip
    scene = instances_scene(found.instances, type(like)(**{**vars(like), **ends}))
    names = [f"{one.name} {k + 1}" for k, one in enumerate(found.instances)]
    note = f"Things of {name} on the plane found, in its frame: z upwards from the plane; see docs/task-space.md."
    place = folder / FIGURES
    place.mkdir(exist_ok=True)
    write_scene(place / f"scene-{name}.toml", scene, names, note)
    figure = ""
    grid = obstacle_grid(found, 0.02)
    from .figures import frame_figure, write_grid  # here: drawing is slow to import

    write_grid(place, grid, f"grid-{name}")
    if config.figures:
        figure = f"frame-{name}.png"
        frame_figure(place / figure, found, found.views[0], f"frame {name}", grid)
    kinds = [KINDS[one.kind] for one in found.instances]
    what = ", ".join(f"{kinds.count(kind)} {kind}" for kind in KINDS.values() if kind in kinds) or "nothing"
    size = np.ptp(found.table.corners, axis=0)
    text = f"{name}: plane of {size[0]:.1f} x {size[1]:.1f} m, residual {1e3 * found.table.deviation:.1f} mm; {what} -> {place / f'scene-{name}.toml'}"
    return MappedFrame(name, found, figure, text)


FRAMES = """
## Recorded frames

{count} frames of a living room by a hand-held RGB-D camera (640 x 480 pixels), each mapped alone: one image, no mean. Upwards is assumed to be
within 46 degrees of upwards in the image.

| frame | plane: extent [m] | residual [mm] | noise over the model's | spheres | columns | boxes | points |
|---|---|---|---|---|---|---|---|
{rows}

{seen}
"""
SEEN = """What can be seen in the figures, looked at one by one; there is no other truth for these frames.

* **The plane is right in all five.** In frame 1 it is the top of the dining table, and not the floor; in frames 2 to 5, which show hardly any table,
  the floor. Beyond 4 m the depth has steps, and the floor is in and out of 2 cm.
* **Frame 1: two candlesticks stand on the table, and are not found.** The camera measured no depth on them and on the far end of the table
  (white in the middle picture): what has no depth is in no map. The two things found are pieces of the back of a chair behind the table, within 5 cm of
  its outline: a box, and a small ball, which is none. The backs of the other chairs stand beside the table, and are rightly left out.
* **The armchair** of frames 2 to 5 is found each time, and kept as points with a box about them, as it is no sphere, column or box. That is right.
  Its legs and seat are within; the side that faces away is missing, as no frame shows it.
* **The buffet at the left** is kept whole in frame 2, as points with a box about them. In the others it is mostly not mapped: it stands where no floor is
  seen, outside of the plane's outline. What is left of it within, its front, is cut into thin boxes side by side, with a column among them in frame 5, as
  what a camera measures of it is no plane to within its noise. In frame 3 a round piece of its top is taken for a thin disc of 15 cm radius at its height,
  which covers floor that is free on the grid; in frame 4 a piece of its edge for a ball.
* **Chairs at the right edge** are kept as points in frames 2 and 4, with a box about most of what is seen of one; in frame 2 a second one is a box that
  covers its back and more. In frame 3 one of their legs is found, in frame 5 their backs and what stands behind as thin boxes, a column and points. The rest of
  the chairs is left out: it reaches more than 30 cm beyond where floor is seen.
* **The cabinet and the sofa** at 5 to 7 m are found as points or boxes of the right extent where floor is seen before them, and not at all elsewhere.

So one image of a room gives a usable plane, and shapes for what stands free on it. Thin, cut or far things, and everything without depth, need a
second view or a detector. Of things that are no spheres, columns or boxes much is tried: these frames take about 20 s of one core each, a table of eight
things two."""
"""What a person sees who looks at the figures."""


def frames_text(frames: Sequence[MappedFrame], figures: Sequence[str]) -> str:
    """The part of the page about recorded frames."""
    if not frames:
        return ""
    rows = []
    for frame in frames:
        if frame.found is None:
            rows.append(f"| {frame.name} | none | | | | | | |")
            continue
        size, table = np.ptp(frame.found.table.corners, axis=0), frame.found.table
        kinds = [one.kind for one in frame.found.instances]
        counts = " | ".join(str(kinds.count(kind)) for kind in (0, 1, 2, -1))
        rows.append(
            f"| {frame.name} | {size[0]:.1f} x {size[1]:.1f} | {1e3 * table.deviation:.1f} | {table.excess:.1f} | {counts} |"
        )
    text = FRAMES.format(count=len(frames), rows="\n".join(rows), seen=SEEN)
    return text + "\n" + "\n\n".join(f"![{name}]({name})" for name in figures) + "\n"
