"""Writes the results of a run."""

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from hrcjax.io.map_file import save_map
from hrcjax.io.point_file import write_ply
from hrcjax.lab.any_name import title
from hrcjax.lab.atomic import replace_file, write_bytes
from hrcjax.map import FieldMap, MapLayout, MapParams, labelled_points
from hrcjax.viz import POINT_COLOURS, cloud_views, field_slices

from .map_folder import FIGURES, MAP, POINTS, STATISTICS
from .slices import make_slices

COLOURS = np.array([[round(255 * v) for v in to_rgb(colour)] for colour in POINT_COLOURS])


def write_data(folder: Path, layout: MapLayout, params: MapParams, state: FieldMap, found: dict[str, Any]) -> list[str]:
    """Map, points and statistics; returns the names of the files.

    Raises:
        StorageError: one could not be written.
    """
    save_map(folder / MAP, layout, params, state)
    points, labels = labelled_points(state)
    write_ply(folder / POINTS, points, labels, COLOURS)
    write_bytes(folder / STATISTICS, (json.dumps(found, indent=1, allow_nan=False) + "\n").encode())
    return [MAP, POINTS, STATISTICS]


def draw_map(
    folder: Path, layout: MapLayout, params: MapParams, state: FieldMap, name: str, at: Any = None, bound: bool = False
) -> list[str]:
    """Figures of slices and points; returns the names of the files; none for a map without points.

    Args:
        name: of the recording.
        at: point of the slices (3,) [m]; None: the middle of the points.
        bound: also the lower bound of the distance.

    Raises:
        StorageError: one could not be written.
    """
    points, labels = labelled_points(state)
    if len(points) == 0:
        return []
    slices, lower, cloud = FIGURES
    name = title(name)
    planes = make_slices(layout, params, state, at)
    _write(folder / slices, field_slices(planes, title=f"Distance to the mapped surfaces: {name}")[0])
    names = [slices]
    if bound:
        planes = make_slices(layout, params, state, at, bound=True)
        about = f"Lower bound of the distance (95 %): {name}"
        _write(folder / lower, field_slices(planes, "lower bound of the distance", about)[0])
        names.append(lower)
    _write(folder / cloud, cloud_views(points, labels, f"Points of the map: {name}")[0])
    return [*names, cloud]


def _write(path: Path, figure: Figure) -> None:
    replace_file(path, partial(_save, figure))


def _save(figure: Figure, path: Path) -> None:
    figure.savefig(path, format="png", dpi=150)
