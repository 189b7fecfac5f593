"""All figures of a finished sweep, as PNG in its folder."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from hrcjax.lab.atomic import replace_file, storage_errors
from hrcjax.lab.errors import UsageError
from hrcjax.sweeps.analysis import KnobEffects, effects_of
from hrcjax.sweeps.dataset import WORLD_DIMS
from hrcjax.sweeps.drawn_world import drawn_world, world_name, world_title
from hrcjax.sweeps.knob_figures import knobs_figure, line_range_figure, sensitivity_figure
from hrcjax.sweeps.store import open_run
from hrcjax.sweeps.summary import axis_labels, metric_names, ranking, select, setting_dims, trade_off
from hrcjax.viz import (
    GridAxis,
    PathLine,
    curve,
    heat_maps,
    pareto_figure,
    path_views,
    sample_map,
    zones_view,
)
from hrcjax.viz.style import BEST, PLAN, WORST


def _unit(results: xr.Dataset, name: str) -> str:
    return str(results[name].attrs.get("units", "1"))


def _axis(results: xr.Dataset, label: str) -> GridAxis:
    coord = results[label]
    return GridAxis(label, coord.values.astype(float), coord.attrs.get("scale") == "log", _unit(results, label))


def _over(results: xr.Dataset) -> str:
    worlds = [world_name(results, dim) for dim in WORLD_DIMS if results.sizes[dim] == 1 and dim != "seed"]
    count = int(np.prod([results.sizes[dim] for dim in WORLD_DIMS]))
    return ", ".join(worlds) + (f"{', ' if worlds else ''}mean over {count} worlds" if count > 1 else "")


def metric_figure(results: xr.Dataset, name: str) -> Figure:
    """A metric over the settings: heat maps for two or three axes, a curve for one, points for samples.

    With more than three axes the others are fixed at the best setting.
    """
    variable = results[name].mean(WORLD_DIMS, skipna=False)
    metric = (name, _unit(results, name), str(results[name].attrs.get("better", "")))
    title = f"{name.replace('_', ' ')}: {_over(results)}"
    if "sample" in variable.dims:
        labels = axis_labels(results)
        x = _axis(results, labels[0])
        if len(labels) == 1:
            order = np.argsort(x.values)
            return curve(variable.values[order], x._replace(values=x.values[order]), *metric, title)[0]
        good = (results.status == 0).all(WORLD_DIMS).values
        return sample_map(variable.values, x, _axis(results, labels[1]), *metric, title, feasible=good)[0]
    best = select(results, int(ranking(results, str(results.attrs["rank"]))[0]))
    wide = [str(dim) for dim in variable.dims if results.sizes[dim] > 1]
    fixed = [str(dim) for dim in variable.dims if str(dim) not in wide[:3]]
    failed = (results.status != 0).any(WORLD_DIMS)
    variable, failed = (part.sel({dim: best[dim].item() for dim in fixed}) for part in (variable, failed))
    if len(wide) > 3:
        title += " at " + ", ".join(f"{dim} = {best[dim].item():.3g}" for dim in wide[3:])
    ordered = [results[dim].argsort().values for dim in wide[:3]]
    variable, failed = (part.isel(dict(zip(wide, ordered, strict=False))) for part in (variable, failed))
    axes = [_axis(results, dim) for dim in wide[:3]]
    axes = [axis._replace(values=axis.values[at]) for axis, at in zip(axes, ordered, strict=True)]
    if not wide:
        only = _axis(results, str(results[name].dims[len(WORLD_DIMS)]))
        return curve(np.atleast_1d(variable.values), only, *metric, title)[0]
    if len(wide) == 1:
        return curve(variable.values, axes[0], *metric, title)[0]
    panel = axes[2] if len(axes) > 2 else GridAxis("", np.zeros(1))
    values, bad = (part.transpose(*wide[:3]).values for part in (variable, failed))
    values, bad = (part.reshape(*part.shape[:2], -1) for part in (values, bad))
    return heat_maps(values, axes[0], axes[1], panel, *metric, title, bad)[0]


def best_and_worst(results: xr.Dataset, by: str) -> dict[str, int]:
    """Flat indices of the best setting and of the worst one with a finite value."""
    order = ranking(results, by)
    finite = np.isfinite(results[by].mean(WORLD_DIMS, skipna=False).values.ravel()[order])
    return {"best": int(order[0]), "worst": int(order[finite][-1] if finite.any() else order[-1])}


def trade_off_figure(results: xr.Dataset, by: str) -> Figure | None:
    """The Pareto front of three metrics; None if the run does not have them, or all settings failed."""
    names = trade_off(results)
    if len(names) != 3:
        return None
    means = [results[name].mean(WORLD_DIMS, skipna=False).values.ravel().astype(float) for name in names]
    better = [str(results[name].attrs["better"]) for name in names]
    feasible = (results.status == 0).all(WORLD_DIMS).values.ravel()
    if not (np.isfinite(means).all(axis=0) & feasible).any():
        return None
    units = [_unit(results, name) for name in names]
    marks = {f"{which} {by.replace('_', ' ')}": at for which, at in best_and_worst(results, by).items()}
    return pareto_figure(np.stack(means, axis=1), names, units, better, feasible, marks)[0]


def _describe_setting(results: xr.Dataset, which: str, setting: int, by: str) -> str:
    one = select(results, setting)
    axes = ", ".join(f"{label} {float(one[label]):.3g}" for label in axis_labels(results))
    value = float(one[by].isel(dict.fromkeys(WORLD_DIMS, 0)))
    return f"{which}: {axes} ({by.replace('_', ' ')} {value:.3g})"


def paths_figure(results: xr.Dataset, by: str) -> Figure | None:
    """Best and worst path of the first world from above and in 3-D; None if paths were not stored."""
    if "tool" not in results and "plan" not in results:
        return None
    world = results.isel(dict.fromkeys(WORLD_DIMS, 0))
    lines = []
    for (which, setting), colour in zip(best_and_worst(results, by).items(), (BEST, WORST), strict=True):
        one = select(world, setting, setting_dims(results))
        if "plan" in one:
            plan_colour = PLAN if which == "best" else "#edb78f"
            lines.append(PathLine(one.plan.values, f"{which}, planned", plan_colour, dashed=True))
        if "tool" in one:
            lines.append(PathLine(one.tool.values, _describe_setting(results, which, setting, by), colour))
    surroundings = drawn_world(world)
    title = "Best and worst path: " + world_title(results)
    return path_views(lines, title=title, **surroundings)[0]


def zones_figure(results: xr.Dataset, by: str) -> Figure | None:
    """Zones, separation and speed of the best and the worst setting in the first world; None if not stored."""
    separation = "separation_t" if "separation_t" in results else "separation"
    wanted = ("zone", separation, "speed")
    if any(name not in results for name in wanted):
        return None
    world = results.isel(dict.fromkeys(WORLD_DIMS, 0))
    runs = [select(world[list(wanted)], at, setting_dims(results)) for at in best_and_worst(results, by).values()]
    time = world.time.values.astype(float) if "time" in world.coords else np.arange(world.sizes["time"], dtype=float)
    zone, distance, speed = (np.stack([run[name].values for run in runs]) for name in wanted)
    title = "Zones over time: " + world_title(results)
    return zones_view(time, zone.astype(np.int32), distance, speed, ["best", "worst"], title=title)[0]


def draw_run(folder: str | Path, by: str = "", metrics: Sequence[str] = ()) -> list[Path]:
    """Draws the figures of a run into its folder `figures`; returns the files.

    Args:
        by: metric for ranking the settings; that of the run if empty.
        metrics: metrics to draw in addition to that one and those of the Pareto front.

    Raises:
        UsageError: no finished run there, or no such metric.
        StorageError: a figure cannot be written.
    """
    folder = Path(folder)
    with open_run(folder) as results:
        by = by or str(results.attrs["rank"])
        known = metric_names(results)
        for name in (by, *metrics):
            if name not in known:
                raise UsageError(f"{name}: no such metric; accepted: {', '.join(known)}")
        drawn = dict.fromkeys([by, *trade_off(results), *metrics])
        drawn = [name for name in drawn if np.isfinite(results[name].values).any()]
        figures = {f"metric-{name}": metric_figure(results, name) for name in drawn}
        others = {"pareto": trade_off_figure, "paths": paths_figure, "zones": zones_figure}
        figures |= {name: figure for name, draw in others.items() if (figure := draw(results, by)) is not None}
        figures |= analysis_figures(results, by, effects_of(results, by))
    return write_figures(folder, figures)


def analysis_figures(results: xr.Dataset, by: str, effects: KnobEffects | None) -> dict[str, Figure]:
    """What each knob does, by name of the file: as far as the run has paths, and effects are known."""
    figures = {"knobs": knobs_figure(results, by)}
    if effects:
        figures |= {"sensitivity": sensitivity_figure(effects), "line-ranges": line_range_figure(effects)}
    return {name: figure for name, figure in figures.items() if figure is not None}


def write_figures(folder: Path, figures: Mapping[str, Figure]) -> list[Path]:
    """Writes figures into the folder `figures` of a run; returns the files.

    Raises:
        StorageError: a figure cannot be written.
    """
    target = folder / "figures"
    with storage_errors(target):
        target.mkdir(exist_ok=True)
    written = []
    for name, figure in figures.items():
        path = target / f"{name.replace('_', '-')}.png"
        replace_file(path, lambda temporary, figure=figure: figure.savefig(temporary, dpi=130, format="png"))
        written.append(path)
    return written
