"""Variables of a netCDF file that are written part by part, so that they need not fit into memory."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import h5netcdf
import numpy as np


def boxes(start: int, stop: int, shape: Sequence[int]) -> Iterator[tuple[slice, ...]]:
    """Rectangular parts of an array that hold its elements from `start` to `stop` in C order, in this order."""
    if start >= stop:
        return
    if len(shape) == 1:
        yield (slice(start, stop),)
        return
    inner = math.prod(shape[1:])
    first, last = start // inner, (stop - 1) // inner
    if first == last:
        for box in boxes(start - first * inner, stop - first * inner, shape[1:]):
            yield (slice(first, first + 1), *box)
        return
    whole, end = -(-start // inner), stop // inner
    yield from boxes(start, whole * inner, shape)
    if whole < end:
        yield (slice(whole, end), *(slice(0, size) for size in shape[1:]))
    yield from boxes(end * inner, stop, shape)


def new_variable(file: h5netcdf.File, name: str, dims: Sequence[str], shape: Sequence[int], dtype: Any) -> Any:
    """A variable as xarray would write it, without its values; dims that the file lacks are added.

    Raises:
        ValueError: a dim has another size in the file.
    """
    for dim, size in zip(dims, shape, strict=True):
        if dim not in file.dimensions:
            file.dimensions[dim] = size
        elif file.dimensions[dim].size != size:
            raise ValueError(f"{name}: {dim} has {size} values, and {file.dimensions[dim].size} elsewhere")
    dtype = np.dtype(dtype)
    stored = np.dtype(np.int8) if dtype.kind == "b" else dtype
    fill = stored.type(np.nan) if np.issubdtype(stored, np.floating) else None
    variable = file.create_variable(name, tuple(dims), stored, fillvalue=fill)
    if dtype.kind == "b":
        variable.attrs["dtype"] = "bool"
    return variable


def write_rows(variable: Any, start: int, rows: np.ndarray, front: Sequence[int]) -> None:
    """Writes rows into a variable whose leading axes, flattened, count them.

    Args:
        start: index of the first row.
        rows: (row, ...).
        front: sizes of the leading axes.
    """
    rows = rows.astype(np.int8) if rows.dtype.kind == "b" else rows
    at = 0
    for box in boxes(start, start + len(rows), front):
        sizes = [part.stop - part.start for part in box]
        count = math.prod(sizes)
        variable[box] = rows[at : at + count].reshape(*sizes, *rows.shape[1:])
        at += count
