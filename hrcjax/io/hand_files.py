"""Files about hands: the weights of a classifier and the table of commands, both TOML."""

import base64
import json
import tomllib
from dataclasses import fields
from itertools import pairwise
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from hrcjax.hand import GESTURES, Classifier, CommandParams, CommandRule
from hrcjax.hand.landmarks import PAIRS

MOST_GAP = 0.5
"""The longest gap between frames over which a table may let a hand count on [s]."""
SAFE = {
    "go": {"hold": ("at least", 0.5), "certainty": ("at least", 0.5), "frames": ("at least", 2), "misses": ("at most", 0), "loss": ("at least", 1)},
    "stop": {"hold": ("at most", 0.2), "certainty": ("at most", 0.9), "frames": ("at most", 3), "loss": ("at most", 2)},
}  # fmt: skip
"""Bounds of the fields of a rule: without hold, row and loss of its time, a go would come of moments of a closed hand."""


def classifier_text(model: Classifier, head: str = "") -> str:
    """A classifier as TOML: sizes of the layers, and all numbers as base64 of little-endian float16, in the order of the fields.

    Args:
        head: lines of comment to begin with.
    """
    sizes = [model.weights[0].shape[0], *(w.shape[1] for w in model.weights)]
    parts = [model.mean, model.spread, *model.weights, *model.biases]
    numbers = np.concatenate([np.asarray(part, np.float64).ravel() for part in parts]).astype("<f2")
    if not np.isfinite(numbers).all():
        raise ValueError("weights are not finite or over 65504; train again with a smaller rate")
    packed = base64.b64encode(numbers.tobytes()).decode("ascii")
    lines = "\n".join(packed[k : k + 120] for k in range(0, len(packed), 120))
    return f'{head}\ngestures = {json.dumps(GESTURES)}\nsizes = {sizes}\nnumbers = """\n{lines}"""\n'


def read_classifier(file: Path) -> Classifier:
    """The classifier of a file, in float32.

    Raises:
        ValueError: another format; the message names the file.
        OSError: it cannot be read.
    """
    try:
        entries = tomllib.loads(file.read_text(encoding="utf-8"))
        sizes = [int(n) for n in entries["sizes"]]
        raw = base64.b64decode("".join(entries["numbers"].split()), validate=True)
        numbers = np.frombuffer(raw, "<f2").astype(np.float32)
        if entries["gestures"] != list(GESTURES) or sizes[0] != len(PAIRS) or sizes[-1] != len(GESTURES):
            raise ValueError("it is of other features or gestures")
        shapes = list(pairwise(sizes))
        lengths = [sizes[0], sizes[0], *(a * b for a, b in shapes), *sizes[1:]]
        if sum(lengths) != len(numbers):
            raise ValueError(f"it has {len(numbers)} numbers instead of {sum(lengths)}")
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{file}: no weights of a classifier of hands ({error})") from error
    mean, spread, *rest = (jnp.asarray(part) for part in np.split(numbers, np.cumsum(lengths)[:-1]))
    layers = len(shapes)
    weights = tuple(part.reshape(shape) for part, shape in zip(rest[:layers], shapes, strict=True))
    return Classifier(mean, spread, weights, tuple(rest[layers:]))


def read_commands(file: Path) -> CommandParams:
    """The table of commands of a file: a table for each of stop, go, point and home, with the fields of `CommandRule`.

    Refused is also what would undo that a go needs half a second of a closed hand, or keep a stop back.

    Raises:
        ValueError: an unknown name, a value out of range; the message names the file.
        OSError: it cannot be read.
    """
    try:
        entries = tomllib.loads(file.read_text(encoding="utf-8"))
        gap = _number("longest_gap", entries.pop("longest_gap", CommandParams.longest_gap))
        if not 0 < gap <= MOST_GAP:
            raise ValueError(
                f"longest_gap = {gap}: accepted is from over 0 to {MOST_GAP} s, as nothing is known of a hand in a gap"
            )
        rules = {name: _rule(name, entries.pop(name, {})) for name in ("stop", "go", "point", "home")}
        if entries:
            raise ValueError(f"{next(iter(entries))}: no such table; accepted: {', '.join(rules)}, longest_gap")
    except (ValueError, TypeError, AttributeError) as error:
        raise ValueError(f"{file}: {error}") from error
    return CommandParams(**rules, longest_gap=gap)


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < float("inf"):
        raise ValueError(f"{name} = {value}: accepted is a number of 0 or more")
    return value


def _rule(name: str, entries: dict[str, Any]) -> CommandRule:
    default = getattr(CommandParams(), name)
    known = {field.name: getattr(default, field.name) for field in fields(CommandRule)}
    for key, value in entries.items():
        if key not in known:
            raise ValueError(f"{name}.{key}: no such field; accepted: {', '.join(known)}")
        known[key] = _number(f"{name}.{key}", value)
    if not known["certainty"] <= 1 or not known["release"] <= 1 or known["certainty"] == 0:
        raise ValueError(f"{name}: certainty must be over 0, and certainty and release at most 1")
    for key, least in (("frames", 1), ("misses", 0)):
        if known[key] != int(known[key]) or known[key] < least:
            raise ValueError(f"{name}.{key} = {known[key]}: accepted is a whole number of {least} or more")
    for key, (relation, bound) in SAFE.get(name, {}).items():
        if known[key] < bound if relation == "at least" else known[key] > bound:
            reason = "the arm moves after it" if name == "go" else "a stop must not wait"
            raise ValueError(f"{name}.{key} = {known[key]}: accepted is {relation} {bound}, as {reason}")
    return CommandRule(**{**known, "frames": int(known["frames"]), "misses": int(known["misses"])})
