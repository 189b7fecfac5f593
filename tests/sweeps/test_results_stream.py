"""Traces that are written chunk by chunk: the file that xarray writes at once, in little memory."""

import math
import tracemalloc
from pathlib import Path

import h5netcdf
import numpy as np
import pytest
import toy_cell
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from hrcjax.sweeps.dataset import write_results
from hrcjax.sweeps.settings import make_settings
from hrcjax.sweeps.stream import boxes, new_variable, write_rows


@given(st.lists(st.integers(1, 5), min_size=1, max_size=4), st.data())
def test_boxes_hold_a_range_in_order(shape: list[int], data: st.DataObject) -> None:
    size = math.prod(shape)
    start = data.draw(st.integers(0, size))
    stop = data.draw(st.integers(start, size))
    numbers = np.arange(size).reshape(shape)
    found = [int(n) for box in boxes(start, stop, shape) for n in numbers[box].ravel()]
    assert found == list(range(start, stop))


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int8, np.int32, bool])
def test_the_file_is_that_of_xarray(tmp_path: Path, dtype: type) -> None:
    values = (np.random.default_rng(0).normal(size=(2, 3, 4, 5)) * 20).astype(dtype)
    if dtype in (np.float32, np.float64):
        values[1, 2, 0, 0] = np.nan
    start = xr.Dataset({"score": (("a", "b"), np.ones((2, 3)))}, {"a": [1.0, 2.0]})
    for name in ("streamed", "at-once"):
        start.to_netcdf(tmp_path / name, engine="h5netcdf")
    dims = ("a", "b", "time", "xyz")
    xr.Dataset({"tool": (dims, values)}).to_netcdf(tmp_path / "at-once", mode="a", engine="h5netcdf")
    rows = values.reshape(6, 4, 5)
    with h5netcdf.File(tmp_path / "streamed", "a") as file:
        variable = new_variable(file, "tool", dims, values.shape, dtype)
        for first, last in ((0, 2), (2, 5), (5, 6)):
            write_rows(variable, first, rows[first:last], (2, 3))
    with xr.open_dataset(tmp_path / "streamed") as a, xr.open_dataset(tmp_path / "at-once") as b:
        xr.testing.assert_identical(a, b)
        assert a.tool.dtype == b.tool.dtype == dtype
        assert a.tool.encoding["chunksizes"] == b.tool.encoding["chunksizes"]


def test_a_dim_of_two_sizes_is_refused(tmp_path: Path) -> None:
    with h5netcdf.File(tmp_path / "f", "w") as file:
        new_variable(file, "tool", ("time",), (4,), np.float32)
        with pytest.raises(ValueError, match="zone: time has 5 values, and 4 elsewhere"):
            new_variable(file, "zone", ("time",), (5,), np.int8)


def test_memory_holds_one_chunk_of_a_trace_whatever_the_run(tmp_path: Path) -> None:
    problem = toy_cell.build_problem(("robotica",), ("reach_in",), (0,))
    settings = make_settings(["zeta=lin:2:4:4000", "k_att=log:0.01:0.1:2"], problem.params, aliases=problem.aliases)
    world = problem.describe(problem.worlds[0][1]())  # pyright: ignore[reportOptionalCall]
    kinds = {"plan": (15, 3), "tool": (60, 3), "zone": (60,), "separation": (60,), "speed": (60,)}
    chunk = 200

    def chunks(_: int, name: str):
        for start in range(0, settings.count, chunk):
            dtype = np.int8 if name == "zone" else np.float32
            yield slice(start, start + chunk), np.full((chunk, *kinds.get(name, ())), start % 99, dtype)

    tracemalloc.start()
    try:
        write_results(tmp_path, problem, settings, chunks, lambda _, name: world[name], {"title": "t"})
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    whole = settings.count * 60 * 3 * 4
    assert most < whole / 2  # the metrics of all settings, and little of the longest trace
    with xr.open_dataset(tmp_path / "results.nc", engine="h5netcdf") as ds:
        flat = ds.tool.values.reshape(settings.count, -1)
        np.testing.assert_array_equal(flat[:, 0], np.arange(settings.count) // chunk * chunk % 99)
