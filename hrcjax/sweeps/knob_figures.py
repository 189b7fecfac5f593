"""Figures of what each swept parameter does: sensitivity bars, line ranges, paths and speeds along it."""

import json
from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from hrcjax.sweeps.analysis import KnobEffects, is_grid
from hrcjax.sweeps.dataset import WORLD_DIMS
from hrcjax.sweeps.drawn_world import drawn_world, world_title
from hrcjax.sweeps.summary import ranking, select, setting_dims
from hrcjax.viz import KnobRow, knobs_view, range_table, sensitivity_bars, setting_view
from hrcjax.viz.style import number, parameter_label

COLUMNS = 5
"""Largest number of values of a knob in the figure."""
ROWS = 4
"""Largest number of knobs in the figure."""


def sensitivity_figure(effects: KnobEffects) -> Figure:
    """Sobol indices of every knob, a panel per metric."""
    title = "How much of each metric's variance a knob decides"
    return sensitivity_bars(effects.first, effects.total, effects.labels, effects.metrics, title)[0]


def line_range_figure(effects: KnobEffects) -> Figure:
    """Line ranges, knobs times metrics."""
    return range_table(effects.line_range, effects.labels, effects.metrics, "How far a knob alone moves each metric")[0]


def values_along(sizes: int, base: int, columns: int = COLUMNS) -> list[int]:
    """Indices along an axis: both ends, evenly between, and the base in place of its nearest."""
    at = np.unique(np.linspace(0, sizes - 1, min(columns, sizes)).round().astype(int))
    if base not in at:
        inner = np.arange(1, len(at) - 1) if len(at) > 2 else np.arange(len(at))
        at[inner[np.argmin(np.abs(at[inner] - base))]] = base
    return [int(i) for i in np.sort(at)]


def knobs_figure(results: xr.Dataset, by: str) -> Figure | None:
    """Paths and speeds along every knob through the best setting, in the first world; None if not stored, or not a grid."""
    if not is_grid(results) or any(name not in results for name in ("tool", "speed")):
        return None
    dims = setting_dims(results)
    labels = [dim for dim in dims if results.sizes[dim] > 1][:ROWS]
    if not labels:
        return None
    world = results.isel(dict.fromkeys(WORLD_DIMS, 0)).sortby(list(dims))
    place = np.unravel_index(int(ranking(results.sortby(list(dims)), by)[0]), [world.sizes[dim] for dim in dims])
    base = {dim: int(i) for dim, i in zip(dims, place, strict=True)}
    best = world.isel(base)
    time = world.time.values.astype(float) if "time" in world.coords else np.arange(world.sizes["time"], dtype=float)
    rows = [_row(world, label, base, time, by) for label in labels]
    nearest = None
    separation = "separation_t" if "separation_t" in best else "separation"
    if separation in best and best[separation].dims == ("time",) and np.isfinite(best[separation]).any():
        under_way = time <= (float(best.time_to_goal) if "time_to_goal" in best else time[-1])
        nearest = float(time[int(np.nanargmin(np.where(under_way, best[separation].values, np.inf)))])
    settings = ", ".join(f"{parameter_label(dim)} = {number(float(best[dim]))}" for dim in dims)
    title = f"One knob at a time, from the best setting: ★ {settings}\n{world_title(results)}"
    return knobs_view(rows, time, **drawn_world(world, nearest), title=title)[0]


def setting_figure(results: xr.Dataset, by: str, values: Mapping[str, float]) -> Figure:
    """One setting of a grid beside the best one, in the first world.

    Args:
        values: of the swept parameters by label; the nearest on the grid is taken, the best setting's where not given.

    Raises:
        KeyError: the run has no such parameter, or no paths.
    """
    world = results.isel(dict.fromkeys(WORLD_DIMS, 0))
    best = select(world, int(ranking(results, by)[0]), setting_dims(results))
    place = {dim: values.get(dim, float(best[dim])) for dim in setting_dims(results)}
    unknown = set(values) - set(place)
    if unknown:
        raise KeyError(f"no swept parameter {sorted(unknown)[0]}; there are: {', '.join(place)}")
    one = world.sel(place, method="nearest")
    time = world.time.values.astype(float) if "time" in world.coords else np.arange(world.sizes["time"], dtype=float)
    curves = {}
    for name in ("speed", "separation_t", "separation", "clearance_t"):
        if name in one and one[name].dims == ("time",):
            pair = tuple(part[name].values.astype(float) for part in (one, best))
            curves[name.removesuffix("_t"), str(one[name].attrs.get("units", "1"))] = pair
    code = int(one.status)
    fault = json.loads(results.attrs.get("statuses", "{}")).get(str(code), f"status {code}") if code else ""
    setting = ", ".join(f"{parameter_label(dim)} = {number(float(one[dim]))}" for dim in place)
    title = f"{setting}: {fault or _note(one, by)}"
    ways = (one.tool.values.astype(float), best.tool.values.astype(float))
    return setting_view(*ways, curves, time, ("this setting", "the best one"), **drawn_world(world), title=title)[0]


def _row(world: xr.Dataset, label: str, base: dict[str, int], time: np.ndarray, by: str) -> KnobRow:
    """Settings along one knob."""
    at = values_along(world.sizes[label], base[label])
    line = world.isel({**base, label: at})
    meanings = json.loads(world.attrs.get("statuses", "{}"))
    arrival = line.time_to_goal.values if "time_to_goal" in line else np.full(len(at), time[-1])
    return KnobRow(
        symbol=parameter_label(label),
        meaning=_meaning(line, label),
        values=line[label].values.astype(float),
        tool=line.tool.transpose(label, "time", "xyz").values.astype(float),
        speed=line.speed.transpose(label, "time").values.astype(float),
        arrival=arrival.astype(float),
        fault=[meanings.get(str(code), f"status {code}") if code else "" for code in line.status.values.tolist()],
        base=at.index(base[label]),
        notes=[_note(line.isel({label: i}), by) for i in range(len(at))],
    )


def _note(setting: xr.Dataset, by: str) -> str:
    """Score and clearance of a setting."""
    unit = str(setting[by].attrs.get("units", "1")).removeprefix("1")
    words = [f"{by.replace('_', ' ')} {number(float(setting[by]))} {unit}".rstrip()]
    if "clearance" in setting and by != "clearance" and np.isfinite(setting.clearance):
        words.append(f"clearance {1000 * float(setting.clearance):.0f} mm")
    return ", ".join(words)


def _meaning(results: xr.Dataset, label: str) -> str:
    """The first words of a parameter's description, without its symbol."""
    attrs = results[label].attrs
    words = str(attrs.get("long_name", "")).split(":")[0].split(";")[0].split(",")[0]
    symbols = {str(attrs.get("alias", "")), "K_att", "K_rep", "zeta"}
    kept = " ".join(word for word in words.split() if word not in symbols)
    return "" if kept.lower() == label.lower() else kept.lower()
