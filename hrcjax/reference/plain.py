"""Parameters as plain namespaces, with faster attribute access than a pytree."""

import dataclasses
from types import SimpleNamespace
from typing import TypeVar, cast

Tree = TypeVar("Tree")


def plain(params: Tree) -> Tree:
    """The same names and numbers as `params`, in bare namespaces."""
    if not dataclasses.is_dataclass(params):
        return params
    values = {field.name: plain(getattr(params, field.name)) for field in dataclasses.fields(params)}
    return cast(Tree, SimpleNamespace(**values))
