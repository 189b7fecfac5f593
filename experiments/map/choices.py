"""Layout, parameters and recording chosen by the options."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from hrcjax.io.recordings.frame import Intrinsics
from hrcjax.io.recordings.open_input import open_input
from hrcjax.io.recordings.source import InputSource
from hrcjax.lab.errors import UsageError
from hrcjax.lab.field_docs import leaf_docs
from hrcjax.lab.table import aligned
from hrcjax.map import MapLayout, MapParams, StreamParams
from hrcjax.map.params import POSITIVE

from .config import MapConfig
from .frame_check import check_near_origin

T = TypeVar("T", MapParams, StreamParams)

MOST_PLACES = 30_000_000
"""Largest number of blocks in the box, with or without points; each takes 8 bytes."""
MOST_LAST = 64
"""Largest number of blocks of the coarsest level, all of which every query reads."""
SPACINGS = (0.001, 1.0)
"""Smallest and largest edge of a voxel [m]."""
PATIENCE = (1.0, 127.0)
"""Smallest and largest `patience`: counted in 8 bits."""
NEIGHBOURS = ("clear_distance", "new_distance")
"""Parameters that are distances to points of the 26 neighbouring voxels."""
FITTED = ("ratio", "noise")
"""Parameters on which the weights of a map depend."""
OF_INPUT = (
    "per_metre",
    "rate",
    "tolerance",
    "origin",
    "topics",
    "info_topic",
    "world_frame",
    "pose_topic",
    "body_frame",
)


def check(config: MapConfig) -> None:
    """Refuses options that contradict each other or are out of range.

    Raises:
        UsageError: names the option and what is accepted.
    """
    if config.input is None:
        raise UsageError("no recording: give --input PATH; --help shows examples")
    for name, least in (("start", 0), ("every", 1), ("frames", 1), ("capacity", 1), ("seen", 1), ("born", 1)):
        value = getattr(config, name)
        if value is not None and value < least:
            raise UsageError(f"--{name} {value}: accepted is {least} or more")
    sizes = [name for name in ("lower", "shape", "capacity", "seen", "born") if getattr(config, name) is not None]
    sizes += ["spacing"] if config.spacing != MapConfig.spacing else []
    if config.continue_from and (config.fit or sizes):
        names = ", ".join(f"--{name}" for name in (["fit"] if config.fit else []) + sizes)
        raise UsageError(f"{names}: not accepted with --continue-from, which keeps the map's box and sizes")
    if config.fit and (config.lower or config.shape):
        raise UsageError("--fit chooses the box: accepted is either --fit or --lower and --shape")
    for name in ("lower", "slice_at"):
        if not all(math.isfinite(v) for v in getattr(config, name) or ()):
            raise UsageError(f"--{name.replace('_', '-')}: accepted are three finite numbers [m]")
    least, greatest = SPACINGS
    if not least <= config.spacing <= greatest:
        raise UsageError(f"--spacing {config.spacing:g}: accepted is a number from {least:g} to {greatest:g} [m]")
    if config.lower is not None:
        check_near_origin("--lower", np.asarray(config.lower), config.spacing)


def recording(config: MapConfig) -> InputSource:
    """Opens the recording.

    Raises:
        UsageError: as `open_input`.
    """
    assert config.input is not None
    intrinsics = None if config.intrinsics is None else Intrinsics(*config.intrinsics)
    return open_input(config.input, intrinsics=intrinsics, **{name: getattr(config, name) for name in OF_INPUT})


def choose_params(texts: Sequence[str], params: MapParams, continued: bool) -> tuple[MapParams, StreamParams]:
    """Parameters of map and frames, with those given as NAME=VALUE replaced.

    Args:
        params: defaults of the map.
        continued: the map was fitted with `params`.

    Raises:
        UsageError: an unknown name, not a number, a number out of range.
    """
    values: dict[str, float] = {}
    known = [field.name for kind in (params, StreamParams()) for field in dataclasses.fields(kind)]
    for text in texts:
        name, _, value = text.partition("=")
        if name not in known:
            raise UsageError(f"--param {text}: no parameter {name!r}; accepted: {', '.join(known)}")
        if name in values:
            raise UsageError(f"--param: {name} is given twice")
        try:
            values[name] = float(value)
        except ValueError:
            raise UsageError(f"--param {text}: accepted is NAME=NUMBER") from None
        if not (math.isfinite(values[name]) and values[name] >= 0):
            raise UsageError(f"--param {text}: accepted is a finite number, not negative")
        if values[name] == 0 and name in POSITIVE:
            raise UsageError(f"--param {text}: accepted is a number above 0")
        if name == "patience" and not PATIENCE[0] <= values[name] <= PATIENCE[1]:
            raise UsageError(f"--param {text}: accepted is a number from {PATIENCE[0]:g} to {PATIENCE[1]:g}")
        if continued and name in FITTED and values[name] != float(getattr(params, name)):
            raise UsageError(f"--param {text}: the map of --continue-from was fitted with {getattr(params, name):g}")
    return _with(params, values), _with(StreamParams(), values)


def _with(params: T, values: dict[str, float]) -> T:
    own = {field.name for field in dataclasses.fields(params)}
    return dataclasses.replace(params, **{name: value for name, value in values.items() if name in own})


def beyond_neighbours(texts: Sequence[str], params: MapParams, spacing: float) -> str:
    """A note on given distances beyond the range of comparison; "": none.

    Args:
        texts: NAME=VALUE, as given.
        spacing: edge of a voxel [m].
    """
    given = [name for name in NEIGHBOURS if any(text.partition("=")[0] == name for text in texts)]
    far = [f"{name}={getattr(params, name):g}" for name in given if getattr(params, name) > 2 * spacing]
    if not far:
        return ""
    return f"{', '.join(far)}: a point is compared only with those of the 26 neighbouring voxels, so reliably only up to {spacing:g} m (--spacing)"


def check_slices(at: Sequence[float] | None, layout: MapLayout) -> None:
    """Refuses slices through a point (3,) [m] farther outside the mapped box than the size of the box.

    Raises:
        UsageError: such a point.
    """
    if at is None:
        return
    lower, size = np.asarray(layout.lower), layout.edge_of(0) * np.asarray(layout.shape)
    low, high = lower - size, lower + 2 * size
    if not ((np.asarray(at) >= low) & (np.asarray(at) <= high)).all():
        least, greatest = (" ".join(f"{v:.2f}" for v in corner) for corner in (low, high))
        place = " ".join(f"{v:g}" for v in at)
        raise UsageError(f"--slice-at {place}: accepted is a point near the mapped box, from {least} to {greatest} [m]")


def parameter_table() -> str:
    """All parameters with defaults, units and meanings."""
    lines = [["parameter", "default", "unit", "meaning"]]
    for params in (MapParams(), StreamParams()):
        for name, (meaning, unit) in leaf_docs(params).items():
            lines.append([name, f"{float(getattr(params, name)):g}", unit, meaning])
    return aligned(lines)


def choose_layout(
    config: MapConfig,
    clouds: bool,
    lower: Sequence[float] | None = None,
    shape: Sequence[int] | None = None,
    **sizes: int,
) -> MapLayout:
    """The layout of the options, with `lower`, `shape` and `sizes`, or the library's defaults, for those not given.

    Args:
        clouds: the frames are clouds; one cloud may cover a whole room.

    Raises:
        UsageError: an invalid box or size.
    """
    own: dict[str, Any] = {field.name: field.default for field in dataclasses.fields(MapLayout)}
    own |= {"spacing": config.spacing, **sizes}
    own |= {name: tuple(v) for name, v in (("lower", lower), ("shape", shape)) if v is not None}
    for name in ("lower", "shape", "capacity"):
        if getattr(config, name) is not None:
            own[name] = getattr(config, name)
    if min(own["shape"]) < 1:
        raise UsageError(f"--shape {own['shape']}: accepted are three numbers of blocks of at least 1")
    places = math.prod(own["shape"])
    if places > MOST_PLACES:
        raise UsageError(
            f"a box of {' x '.join(map(str, own['shape']))} blocks is too large: accepted are up to {MOST_PLACES:,} blocks; "
            "raise --spacing or reduce --shape"
        )
    own["capacity"] = min(own["capacity"], places)
    own["refitted"] = min(own["refitted"], own["capacity"])
    for name in ("seen", "born"):
        own[name] = own["capacity"] if clouds else own[name]
        own[name] = min(getattr(config, name) or own[name], own["capacity"])
    own["levels"] = levels_for(own["shape"])
    return MapLayout(**own)


def levels_for(shape: Sequence[int]) -> int:
    """Number of levels with which the coarsest one is small."""
    levels = 2
    while math.prod(-(-n // 4 ** (levels - 1)) for n in shape) > MOST_LAST:
        levels += 1
    return levels
