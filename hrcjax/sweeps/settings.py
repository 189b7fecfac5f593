"""The settings of a sweep: axes from text, and their product or a Sobol sample."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from scipy.stats import qmc

from hrcjax.lab.errors import UsageError
from hrcjax.lab.parameters import leaf_names, resolve

FORMS = "NAME=lin:LOW:HIGH:COUNT, NAME=log:LOW:HIGH:COUNT or NAME=V1,V2,..."
MAX_SETTINGS = 10_000_000


@dataclass(frozen=True)
class Axis:
    """One swept parameter."""

    name: str
    """Dotted name in Params."""
    scale: Literal["lin", "log", "list"]
    low: float
    high: float
    values: tuple[float, ...]
    """The values of a grid; empty for a range without a count, for samples only."""
    label: str = ""
    """Short name, unique in the run; the name of the coordinate."""


@dataclass(frozen=True)
class Settings:
    """All settings of a run, in the order in which they are computed (the last axis is the fastest)."""

    axes: tuple[Axis, ...]
    dims: tuple[str, ...]
    """Labels of the axes, or ("sample",)."""
    shape: tuple[int, ...]
    values: dict[str, np.ndarray]
    """Dotted name -> value of every setting, shape (setting,)."""

    @property
    def count(self) -> int:
        return math.prod(self.shape)


def _number(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise UsageError(f"{where}: {text!r} is not a number") from None
    if not math.isfinite(value):
        raise UsageError(f"{where}: {text!r} is not finite")
    return value


def parse_axis(text: str, names: Collection[str], aliases: Mapping[str, str]) -> Axis:
    """One axis from text: `k_att=log:0.005:0.1:16`, `zeta=lin:1.5:5:8`, `policy.collision.k_rep=0.4,0.8`.

    A range without a count is accepted, for samples only.

    Raises:
        UsageError: unknown name, not a number, low > high, log of a value <= 0, count < 1, a value given twice.
    """
    name, separator, spec = text.partition("=")
    if not separator or not name.strip() or not spec.strip():
        raise UsageError(f"{text!r} is not an axis; write {FORMS}")
    full = resolve(name.strip(), names, aliases)
    parts = [part.strip() for part in spec.split(":")]
    if len(parts) == 1:
        values = tuple(_number(part.strip(), text) for part in spec.split(","))
        if len(set(values)) < len(values):
            raise UsageError(f"{text}: a value is given twice")
        return Axis(full, "list", min(values), max(values), values)
    scale = parts[0].lower()
    if scale not in ("lin", "log") or len(parts) not in (3, 4):
        raise UsageError(f"{text!r} is not an axis; write {FORMS}")
    low, high = _number(parts[1], text), _number(parts[2], text)
    if low > high:
        raise UsageError(f"{text}: low {low:g} is greater than high {high:g}")
    if scale == "log" and low <= 0:
        raise UsageError(f"{text}: a log range must start above 0, not at {low:g}")
    if len(parts) == 3:
        return Axis(full, scale, low, high, ())  # pyright: ignore[reportArgumentType]  # checked above
    try:
        count = int(parts[3])
    except ValueError:
        raise UsageError(f"{text}: count {parts[3]!r} is not a whole number") from None
    if count < 1:
        raise UsageError(f"{text}: count {count} is less than 1")
    if count > MAX_SETTINGS:
        raise UsageError(f"{text}: count {count} is greater than {MAX_SETTINGS}")
    if low == high and count > 1:
        raise UsageError(f"{text}: {count} values between {low:g} and {high:g} are equal")
    spaced = np.geomspace(low, high, count) if scale == "log" else np.linspace(low, high, count)
    return Axis(full, scale, low, high, tuple(float(v) for v in spaced))  # pyright: ignore[reportArgumentType]


def check_domain(axis: Axis, domains: Mapping[str, tuple[float, float]]) -> None:
    """Raises UsageError if the axis leaves the domain of its parameter."""
    low, high = domains.get(axis.name, (-math.inf, math.inf))
    for value in (axis.low, axis.high):
        if not low <= value <= high:
            raise UsageError(f"{axis.name} = {value:g} is outside its domain [{low:g}, {high:g}]")


def short_labels(
    names: Sequence[str],
    taken: Collection[str] = (),
    known: Collection[str] = (),
    aliases: Mapping[str, str] | None = None,
) -> list[str]:
    """The shortest unique ending of each dotted name, joined by "_", that is not reserved.

    Args:
        known: all parameters, swept or not, among which the ending must be unique, except for its own alias.
        aliases: short names of parameters.
    """
    labels = []
    own = {alias.lower(): full for alias, full in (aliases or {}).items()}
    for name in names:
        parts = name.split(".")
        alone = own.get(parts[-1].lower()) == name
        among = names if alone else {*names, *known}
        others = [other.split(".") for other in among if other != name]
        for size in range(1, len(parts) + 1):
            ending = parts[-size:]
            label = "_".join(ending)
            if label not in taken and all(other[-size:] != ending for other in others):
                break
        else:
            label = "_".join(["param", *parts])
        labels.append(label)
    return labels


def quick_axes(axes: Sequence[Axis]) -> list[Axis]:
    """At most 4 values of each of the first two axes and 2 of every other, including the ends."""
    few = []
    for i, axis in enumerate(axes):
        most = min(4 if i < 2 else 2, len(axis.values))
        at = np.unique(np.linspace(0, len(axis.values) - 1, most).round().astype(int)) if most else []
        few.append(replace(axis, values=tuple(axis.values[j] for j in at)))
    return few


def make_settings(
    grid: Sequence[str],
    params: Any,
    *,
    aliases: Mapping[str, str] | None = None,
    domains: Mapping[str, tuple[float, float]] | None = None,
    samples: int = 0,
    sample_seed: int = 0,
    quick: bool = False,
    taken: Collection[str] = (),
) -> Settings:
    """All settings: the product of the axes, or `samples` points of a scrambled Sobol sequence within their ranges.

    Args:
        taken: reserved names (dims and variables of the results).

    Raises:
        UsageError: as `parse_axis`; a parameter given twice; too many settings; a list or a negative count in a sample.
    """
    names = leaf_names(params)
    axes = [parse_axis(text, names, aliases or {}) for text in grid]
    if not axes:
        raise UsageError(f"nothing to sweep: --grid is empty; write {FORMS}")
    for axis in axes:
        check_domain(axis, domains or {})
        if sum(axis.name == other.name for other in axes) > 1:
            raise UsageError(f"parameter {axis.name} is given twice")
    if samples < 0:
        raise UsageError(f"--sobol {samples}: accepted is 0 or more")
    if quick and not samples:
        axes = quick_axes(axes)
    labels = short_labels([axis.name for axis in axes], taken, names, aliases)
    axes = [replace(axis, label=label) for axis, label in zip(axes, labels, strict=True)]
    if samples:
        return _sample(axes, min(samples, 16) if quick else samples, sample_seed)
    for axis in axes:
        if not axis.values:
            raise UsageError(f"{axis.name}: a grid needs a count; write {FORMS}")
    shape = tuple(len(axis.values) for axis in axes)
    if math.prod(shape) > MAX_SETTINGS:
        raise UsageError(f"{' x '.join(map(str, shape))} settings are more than {MAX_SETTINGS}")
    mesh = np.meshgrid(*(np.asarray(axis.values) for axis in axes), indexing="ij")
    values = {axis.name: column.ravel() for axis, column in zip(axes, mesh, strict=True)}
    return Settings(tuple(axes), tuple(labels), shape, values)


def _sample(axes: Sequence[Axis], samples: int, seed: int) -> Settings:
    for axis in axes:
        if axis.scale == "list" and len(axis.values) > 1:
            raise UsageError(f"{axis.name}: a sample needs lin:LOW:HIGH, log:LOW:HIGH or one value, not a list")
    if samples > MAX_SETTINGS:
        raise UsageError(f"--sobol {samples}: more than {MAX_SETTINGS} settings")
    if seed < 0:
        raise UsageError(f"--sobol-seed {seed}: accepted is 0 or more")
    powers = max(0, math.ceil(math.log2(samples)))
    unit = qmc.Sobol(len(axes), scramble=True, rng=seed).random_base2(powers)[:samples]
    values = {}
    for axis, u in zip(axes, unit.T, strict=True):
        if axis.scale == "log":
            values[axis.name] = axis.low * (axis.high / axis.low) ** u
        else:
            values[axis.name] = axis.low + (axis.high - axis.low) * u
    return Settings(tuple(axes), ("sample",), (samples,), values)
