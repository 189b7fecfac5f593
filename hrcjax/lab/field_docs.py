"""Descriptions and units of parameters, read from the docstrings under their fields."""

import ast
import dataclasses
import inspect
import itertools
import re
import textwrap
from functools import cache
from typing import Any

UNIT = re.compile(r"\s*\[([^\[\]]+)\]\.?\s*")


@cache
def class_docs(kind: type) -> dict[str, str]:
    """The docstring under each annotated field of a class; empty where the source cannot be read."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(kind)))
    except (OSError, TypeError, SyntaxError):
        return {}
    body = tree.body[0].body if isinstance(tree.body[0], ast.ClassDef) else []
    docs = {}
    for field, below in itertools.pairwise(body):
        if not (isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)):
            continue
        if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
            docs[field.target.id] = " ".join(str(below.value.value).split())
    return docs


def split_unit(text: str) -> tuple[str, str]:
    """The first sentence of a docstring up to its unit, and the unit: "Radius [m]." gives ("Radius", "m")."""
    found = UNIT.search(text)
    sentence = text[: found.start()] if found else text
    return sentence.split(". ")[0].strip(" ."), found.group(1) if found else "1"


def leaf_docs(params: Any, prefix: str = "") -> dict[str, tuple[str, str]]:
    """Dotted name -> (description, unit) of every documented field of nested dataclasses."""
    docs = {}
    for field in dataclasses.fields(params):
        value, name = getattr(params, field.name), f"{prefix}{field.name}"
        if dataclasses.is_dataclass(value):
            docs |= leaf_docs(value, f"{name}.")
        elif field.name in class_docs(type(params)):
            docs[name] = split_unit(class_docs(type(params))[field.name])
    return docs
