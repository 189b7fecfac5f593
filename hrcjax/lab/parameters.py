"""The leaves of a pytree of parameters by their dotted names: listed, looked up, replaced, batched."""

import dataclasses
import difflib
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.lab.errors import UsageError


def path_name(path: Sequence[Any]) -> str:
    """The dotted name of a leaf's path in a pytree."""
    return jax.tree_util.keystr(tuple(path), simple=True, separator=".")


def leaf_names(params: Any) -> dict[str, float]:
    """Dotted name and default of every leaf that is one real number."""
    leaves, _ = jax.tree_util.tree_flatten_with_path(params)
    return {
        path_name(path): float(leaf)
        for path, leaf in leaves
        if not isinstance(leaf, bool | str) and np.ndim(leaf) == 0 and np.isrealobj(leaf)
    }


def set_leaves(params: Any, values: Mapping[str, Any]) -> Any:
    """A copy of `params` with the named leaves replaced.

    Raises:
        UsageError: a name is not a leaf.
    """
    unknown = set(values) - set(leaf_names(params))
    if unknown:
        raise UsageError(f"no parameter {sorted(unknown)[0]!r}")
    return jax.tree_util.tree_map_with_path(lambda path, leaf: values.get(path_name(path), leaf), params)


def batch_params(params: Any, values: Mapping[str, np.ndarray], dtype: Any = jnp.float32) -> Any:
    """Params whose named leaves have the shape (setting,); the others keep theirs, and are shared by all settings.

    Raises:
        UsageError: a name is not a leaf.
    """
    columns = {name: np.asarray(column) for name, column in values.items()}
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), set_leaves(params, columns))


def resolve(name: str, names: Collection[str], aliases: Mapping[str, str]) -> str:
    """The dotted name for a dotted name, an alias, or a unique ending of one; case-sensitive only where an alias would
    otherwise match another parameter's ending.

    Raises:
        UsageError: unknown or ambiguous; names the closest ones.
    """
    if name in names:
        return name
    if name in aliases:
        return aliases[name]
    lower = name.lower()
    endings = [full for full in names if full.lower() == lower or full.lower().endswith("." + lower)]
    by_alias = {alias.lower(): full for alias, full in aliases.items()}
    if lower in by_alias and set(endings) <= {by_alias[lower]}:
        return by_alias[lower]
    if len(endings) == 1:
        return endings[0]
    if endings:
        raise UsageError(f"parameter {name!r} is ambiguous: {', '.join(sorted(endings))}")
    known = {**{full.lower(): full for full in names}, **{a.lower(): a for a in aliases}}
    last = {full.rsplit(".", 1)[-1].lower(): full for full in names}
    close = [known[key] for key in difflib.get_close_matches(lower, known, n=3, cutoff=0.6)]
    close += [last[key] for key in difflib.get_close_matches(lower.rsplit(".", 1)[-1], last, n=3, cutoff=0.7)]
    hint = f"; close: {', '.join(dict.fromkeys(close))}" if close else ""
    raise UsageError(f"unknown parameter {name!r}{hint}; --list shows all")


def numbers_of(params: Any) -> dict[str, float]:
    """Name -> value of a dataclass whose fields are single numbers."""
    return {field.name: float(getattr(params, field.name)) for field in dataclasses.fields(params)}
