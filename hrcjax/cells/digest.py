"""What decides the results of a cell that is not built in: code, files, arm, sizes and defaults, as one digest."""

import dataclasses
import hashlib
import site
import sys
import sysconfig
from pathlib import Path
from typing import Any

import jax
import numpy as np

from hrcjax.cells.named_cell import NamedCell
from hrcjax.lab.errors import UsageError, one_line
from hrcjax.lab.provenance import PACKAGE, file_digest

_first: dict[Path, str] = {}
"""Digest of each module file when this process first looked at it."""


def cell_digest(named: NamedCell) -> str:
    """SHA-256 of everything that decides the results of a cell beside hrcjax; "" for a built-in cell.

    Call it after the parts were traced once, so that modules which they import while running are loaded.

    Raises:
        UsageError: a file cannot be read, or a module was edited since this process imported it.
    """
    if not named.code:
        return ""
    digest = hashlib.sha256()
    try:
        for path in _sources(named.code.partition(".")[0]):
            now = file_digest(path)
            if _first.setdefault(path, now) != now:
                raise UsageError(
                    f"{path} was edited after this process had imported it; start again (restart the kernel)"
                )
            digest.update(f"{path.name}\0{now}\0".encode())
        for file in named.files:
            digest.update(f"{Path(file).name}\0{file_digest(Path(file))}\0".encode())
    except OSError as error:
        raise UsageError(f"--cell {named.code}: {one_line(error)}") from error
    leaves, tree = jax.tree.flatten(named.params)
    _update(digest, [str(tree), *leaves])
    _update(
        digest, [value for part in (named.cell, named.cell.arm, named.cell.arm.chain) for value in vars(part).values()]
    )
    return digest.hexdigest()


def _update(digest: Any, values: list[Any]) -> None:
    """Numbers, texts, arrays and plain dataclasses; functions and the like are covered by their code."""
    for value in values:
        if isinstance(value, np.ndarray | jax.Array):
            array = np.ascontiguousarray(value)
            digest.update(f"{array.dtype}{array.shape}".encode() + array.tobytes())
        elif isinstance(value, int | float | str | tuple) or (
            dataclasses.is_dataclass(value) and "object at" not in repr(value)
        ):
            digest.update(repr(value).encode())


def _sources(package: str) -> list[Path]:
    """Files of all loaded modules that belong neither to Python, nor to hrcjax and what is installed beside it; those of the
    cell's own package always."""
    installed = [
        Path(p).resolve()
        for p in (*site.getsitepackages(), *(sysconfig.get_paths()[k] for k in ("stdlib", "platstdlib")))
    ]
    found = set()
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if not file or not file.endswith(".py"):
            continue
        path = Path(file).resolve()
        if path.is_relative_to(PACKAGE) or name.partition(".")[0] in ("experiments", "__main__"):
            continue
        if name.partition(".")[0] == package or not any(path.is_relative_to(folder) for folder in installed):
            found.add(path)
    return sorted(found)
