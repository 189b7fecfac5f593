"""One labelled dataset from the chunks of a run."""

import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np
import xarray as xr

from hrcjax.lab.any_name import printable
from hrcjax.lab.atomic import replace_file
from hrcjax.lab.field_docs import leaf_docs
from hrcjax.sweeps.settings import Settings
from hrcjax.sweeps.store import ENGINE, RESULTS
from hrcjax.sweeps.stream import new_variable, write_rows
from hrcjax.sweeps.sweepable import NOT_FINITE, Sweepable

WORLD_DIMS = ("scene", "person", "seed")


def world_shape(problem: Sweepable) -> tuple[dict[str, list[Any]], tuple[int, ...]]:
    """The labels along scene, person and seed, and their number.

    Raises:
        ValueError: the worlds are not the full product in order.
    """
    labels = {dim: list(dict.fromkeys(world[0][dim] for world in problem.worlds)) for dim in WORLD_DIMS}
    shape = tuple(len(values) for values in labels.values())
    product = [(s, p, n) for s in labels["scene"] for p in labels["person"] for n in labels["seed"]]
    if [tuple(world[0][dim] for dim in WORLD_DIMS) for world in problem.worlds] != product:
        raise ValueError("worlds are not the product of scenes, people and seeds in this order")
    return labels, shape


def taken_names(problem: Sweepable) -> set[str]:
    """Names of dims and variables of the results, which are reserved."""
    dims = {dim for trace in [*problem.traces.values(), *problem.described.values()] for dim in trace[0]}
    variables = {*problem.metrics, *problem.traces, *problem.described}
    return {*WORLD_DIMS, "setting", "sample", "status", *dims, *variables}


def _coordinates(problem: Sweepable, settings: Settings) -> dict[str, Any]:
    labels, _ = world_shape(problem)
    coords: dict[str, Any] = {
        dim: (dim, np.asarray([printable(v) if isinstance(v, str) else v for v in values]))
        for dim, values in labels.items()
    }
    sampled = settings.dims == ("sample",)
    docs = leaf_docs(problem.params)
    aliases = {full: alias for alias, full in problem.aliases.items()}
    if sampled:
        coords["sample"] = ("sample", np.arange(settings.count))
    for axis in settings.axes:
        values = settings.values[axis.name] if sampled else np.asarray(axis.values)
        description, unit = docs.get(axis.name, (axis.label, "1"))
        attrs = {"units": unit, "long_name": description, "parameter": axis.name, "scale": axis.scale}
        attrs |= {"alias": aliases[axis.name]} if axis.name in aliases else {}
        coords[axis.label] = ("sample" if sampled else axis.label, values, attrs)
    for dim, (values, unit, description) in problem.coords.items():
        coords[dim] = (dim, np.asarray(values), {"units": unit, "long_name": description})
    traces = [*problem.traces.values(), *problem.described.values()]
    if any("xyz" in trace[0] for trace in traces) and "xyz" not in coords:
        coords["xyz"] = ("xyz", np.asarray(["x", "y", "z"]))
    return coords


def _status_attrs(problem: Sweepable) -> dict[str, Any]:
    meanings = {**problem.statuses, NOT_FINITE: "a result or a command is not finite"}
    return {
        "units": "1",
        "long_name": "; ".join(f"{code}: {text}" for code, text in sorted(meanings.items())),
    }


def write_results(
    folder: Path,
    problem: Sweepable,
    settings: Settings,
    chunks: Callable[[int, str], Iterable[tuple[slice, np.ndarray]]],
    described: Callable[[int, str], np.ndarray],
    attrs: Mapping[str, Any],
) -> Path:
    """Writes results.nc; of the traces only one chunk is in memory at a time.

    Args:
        chunks: (index of the world, name of the output) -> (slice of settings, array) of each chunk.
        described: (index of the world, name) -> array of `Sweepable.describe`.

    Raises:
        StorageError: it could not be written; the chunks are kept.
    """
    _, worlds = world_shape(problem)
    count = int(np.prod(worlds))
    axes = settings.dims
    encoded = {key: printable(value) if isinstance(value, str) else json.dumps(value) for key, value in attrs.items()}

    def gather(name: str) -> np.ndarray:
        whole: np.ndarray | None = None
        for world in range(count):
            for place, part in chunks(world, name):
                if whole is None:
                    whole = np.empty((count, settings.count, *part.shape[1:]), part.dtype)
                whole[world, place] = part
        assert whole is not None
        return whole.reshape(*worlds, *settings.shape, *whole.shape[2:])

    front = (*WORLD_DIMS, *axes)

    def small() -> xr.Dataset:
        variables = {}
        for name, (unit, better, description) in problem.metrics.items():
            variables[name] = (front, gather(name), {"units": unit, "long_name": description, "better": better})
        variables["status"] = (front, gather("status"), _status_attrs(problem))
        for name, (dims, unit, description) in problem.described.items():
            stacked = np.stack([described(world, name) for world in range(count)])
            array = stacked.reshape(*worlds, *stacked.shape[1:])
            variables[name] = ((*WORLD_DIMS, *dims), array, {"units": unit, "long_name": description})
        return xr.Dataset(variables, _coordinates(problem, settings), encoded)

    def write(temporary: Path) -> None:
        small().to_netcdf(temporary, mode="w", engine=ENGINE)
        with h5netcdf.File(temporary, "a") as file:
            for name, (dims, unit, description) in problem.traces.items():
                parts = ((world, place, part) for world in range(count) for place, part in chunks(world, name))
                variable = None
                for world, place, part in parts:
                    if variable is None:
                        shape = (*worlds, *settings.shape, *part.shape[1:])
                        variable = new_variable(file, name, (*front, *dims), shape, part.dtype)
                        variable.attrs.update({"units": unit, "long_name": description})
                    write_rows(variable, world * settings.count + place.start, part, (*worlds, *settings.shape))

    replace_file(folder / RESULTS, write)
    return folder / RESULTS
