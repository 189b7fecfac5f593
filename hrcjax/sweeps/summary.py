"""The best settings of a run as a short table."""

import json

import numpy as np
import xarray as xr

from hrcjax.lab.table import aligned
from hrcjax.sweeps.dataset import WORLD_DIMS


def setting_dims(results: xr.Dataset) -> tuple[str, ...]:
    """The dims of the settings: the axes of a grid, or `sample`."""
    return tuple(str(dim) for dim in results.status.dims if dim not in WORLD_DIMS)


def axis_labels(results: xr.Dataset) -> list[str]:
    """The coordinates of the swept parameters, in order."""
    return [str(name) for name, coord in results.coords.items() if "parameter" in coord.attrs]


def metric_names(results: xr.Dataset) -> list[str]:
    """Names of the metrics, in order."""
    return [str(name) for name, variable in results.data_vars.items() if "better" in variable.attrs]


def trade_off(results: xr.Dataset) -> list[str]:
    """The metrics of the Pareto figure, as far as the run has them."""
    names = metric_names(results)
    return [name for name in json.loads(results.attrs.get("trade_off", "[]")) if name in names]


def ranking(results: xr.Dataset, by: str) -> np.ndarray:
    """Flat indices of the settings, best first, by the mean over all worlds; then those that failed in some world, then those
    without a finite value."""
    values = results[by].mean(WORLD_DIMS, skipna=False).values.ravel()
    failed = (results.status != 0).any(WORLD_DIMS).values.ravel()
    cost = -values if results[by].attrs["better"] != "low" else values
    missing = ~np.isfinite(cost)
    return np.lexsort((np.where(missing, 0, cost), failed, missing))


def select(results: xr.Dataset, setting: int, dims: tuple[str, ...] | None = None) -> xr.Dataset:
    """The results of one setting by its flat index, in all worlds."""
    dims = setting_dims(results) if dims is None else dims
    at = np.unravel_index(setting, [results.sizes[dim] for dim in dims])
    return results.isel(dict(zip(dims, (int(i) for i in at), strict=True)))


def best_table(results: xr.Dataset, by: str, rows: int = 5, columns: int = 5) -> str:
    """The best settings as aligned text; metrics are means over all worlds."""
    names = list(dict.fromkeys([by, *trade_off(results), *metric_names(results)]))[:columns]
    axes = axis_labels(results)
    order = ranking(results, by)[:rows]
    units = {name: results[name].attrs.get("units", "1") for name in names}
    head = ["", *axes, *(name if units[name] in ("1", "") else f"{name} [{units[name]}]" for name in names), "failed"]
    means = results[names].mean(WORLD_DIMS, skipna=False)
    failed = (results.status != 0).sum(WORLD_DIMS)
    worlds = int(np.prod([results.sizes[dim] for dim in WORLD_DIMS]))
    table = [head]
    for rank, setting in enumerate(order, start=1):
        row = select(means, int(setting), setting_dims(results))
        count = int(failed.values.ravel()[setting])
        values = [f"{float(row[name]):.4g}" for name in [*axes, *names]]
        table.append([str(rank), *values, f"{count}/{worlds}" if count else "no"])
    return aligned(table, ">")
