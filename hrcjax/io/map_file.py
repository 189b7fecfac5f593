"""Map files: an NPZ archive with layout, parameters and all arrays of a map."""

import dataclasses
import json
import zipfile
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.io.map_arrays import fault_of_map
from hrcjax.io.map_header import check_keys, layout_of, params_of
from hrcjax.lab.atomic import replace_file
from hrcjax.lab.errors import UsageError, one_line
from hrcjax.lab.parameters import numbers_of
from hrcjax.map import FieldMap, MapLayout, MapParams, empty_map

FORMAT, VERSION = "hrcjax map", 4
HEADER = "header"
"""Name of the array that holds format, version, layout and parameters as JSON."""
ACCEPTED = f"a file map.npz of python -m experiments.map, version {VERSION}"


def _leaves(state: Any) -> dict[str, Any]:
    """The arrays of a map by name, such as levels.0.rows."""
    found, _ = jax.tree_util.tree_flatten_with_path(state)
    return {jax.tree_util.keystr(path, simple=True, separator="."): leaf for path, leaf in found}


def save_map(path: str | Path, layout: MapLayout, params: MapParams, state: FieldMap) -> None:
    """Writes a map atomically.

    Raises:
        StorageError: it could not be written.
    """
    header = {"format": FORMAT, "version": VERSION, "layout": dataclasses.asdict(layout), "params": numbers_of(params)}
    arrays = {name: np.asarray(leaf) for name, leaf in _leaves(state).items()}

    def write(temporary: Path) -> None:
        with open(temporary, "wb") as file:  # an open file, as numpy would append a suffix to a name
            np.savez_compressed(file, allow_pickle=False, **{HEADER: np.array(json.dumps(header)), **arrays})

    replace_file(Path(path), write)


def open_map(path: str | Path) -> tuple[MapLayout, MapParams, FieldMap]:
    """Reads a map file.

    Raises:
        UsageError: no such file, another kind of file, a damaged one, another version; one line says which.
    """
    path = Path(path)
    header, arrays = _read(path)
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise UsageError(f"{path} holds no map: accepted is {ACCEPTED}")
    if header.get("version") != VERSION:
        raise UsageError(f"{path} is a map of version {header.get('version')}: accepted is {ACCEPTED}")
    try:
        check_keys(header)
        layout, params = layout_of(header), params_of(header)
    except (ValueError, OverflowError) as error:
        raise _damaged(path, f"its header: {one_line(error)}") from error
    try:
        first = arrays.get("levels.0.rows")
        empty = jax.eval_shape(lambda: empty_map(layout, jnp.float32 if first is None else _float(first.dtype)))
    except (TypeError, ValueError, OverflowError) as error:
        raise _damaged(path, f"its sizes: {one_line(error)}") from error
    expected = _leaves(empty)
    if set(arrays) != set(expected):
        odd = sorted(set(arrays) ^ set(expected))
        raise _damaged(path, f"{odd[0]} is {'missing' if odd[0] in expected else 'not known'}")
    for name, like in expected.items():
        array = arrays[name]
        if (array.shape, array.dtype) != (like.shape, like.dtype):
            raise _damaged(path, f"{name} is {array.dtype} {array.shape}, not {like.dtype} {like.shape}")
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            raise _damaged(path, f"a number of {name} is not finite")
    state: FieldMap = jax.tree.unflatten(jax.tree.structure(empty), [jnp.asarray(arrays[name]) for name in expected])
    fault = fault_of_map(layout, state)
    if fault:
        raise _damaged(path, fault)
    return layout, params, state


def _float(dtype: np.dtype) -> np.dtype:
    """The floating type of a map: that of the file if it is a floating type, else single precision."""
    return dtype if dtype in (np.float32, np.float64) else np.dtype(np.float32)


def _read(path: Path) -> tuple[Any, dict[str, np.ndarray]]:
    """The header, or None, and the other arrays."""
    try:
        if not zipfile.is_zipfile(path):
            if not path.exists():
                raise UsageError(f"no map at {path}: accepted is {ACCEPTED}")
            return None, {}
        with np.load(path, allow_pickle=False) as file:
            if HEADER not in file.files:
                return None, {}
            header = json.loads(str(file[HEADER][()]))
            return header, {name: file[name] for name in file.files if name != HEADER}
    except UsageError:
        raise
    except Exception as error:  # a damaged archive raises errors of many types
        raise _damaged(path, one_line(error)) from error


def _damaged(path: Path, what: str) -> UsageError:
    return UsageError(f"map {path} is damaged ({what}): accepted is {ACCEPTED}")
