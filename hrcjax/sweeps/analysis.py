"""What the knobs of a sweep do to its metrics: ranges along lines of the grid, Sobol indices, distinct outcomes.

Only settings that succeeded count. Every world is analysed by itself; shares are of all worlds together, line ranges the
median over the lines of all worlds, indices the mean over the worlds.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from hrcjax.sweeps.dataset import WORLD_DIMS
from hrcjax.sweeps.summary import axis_labels, metric_names, ranking, select, setting_dims
from hrcjax.sweeps.variance import sobol_indices

SECTION = "sweep_analysis"
SHARES = ("success_share", "distinct_share", "best_inside_axes")
"""The rows that are not of a knob."""
MEASURES = (
    "score_sound", "score_overall", "time_to_goal", "clearance", "separation", "tool_bending_energy", "tool_length",
)  # fmt: skip
"""The metrics of the analysis, as far as a run has them."""
ROUNDING = {"tool_length": 1e-3, "clearance": 1e-3, "time_to_goal": 0.02}
"""Differences that count as none when outcomes are told apart [m], [m], [s]."""
SCORE_ROUNDING = 1e-3
"""Relative difference of the score that counts as none [1]."""
NEGLIGIBLE = 1e-6
"""Range of a metric over a grid, relative to its size, that is rounding of float32 [1]."""

Row = dict[str, float | str]


class KnobEffects(NamedTuple):
    """What each knob does to each metric; NaN where it cannot be told."""

    knobs: list[str]
    """Names of the swept parameters with more than one value, as on the command line."""
    labels: list[str]
    """Their coordinates in the results."""
    metrics: list[str]
    line_range: np.ndarray
    """Median over the lines along a knob of the range on the line over the range in the grid, (knob, metric) [1]."""
    first: np.ndarray
    """First-order Sobol index, (knob, metric) [1]."""
    total: np.ndarray
    """Total Sobol index, (knob, metric) [1]."""

    def kinds(self) -> dict[str, np.ndarray]:
        """The numbers by the beginning of their rows' names."""
        return {"line_range": self.line_range, "sobol_first": self.first, "sobol_total": self.total}


def knob_name(results: xr.Dataset, label: str) -> str:
    """The alias of a swept parameter, such as K_att; its label where it has none."""
    return str(results[label].attrs.get("alias") or {"k_att": "K_att", "k_rep": "K_rep"}.get(label, label))


def is_grid(results: xr.Dataset) -> bool:
    """Whether the settings are a full grid, not a sample."""
    return "sample" not in results.status.dims


def _by_world(results: xr.Dataset, name: str) -> np.ndarray:
    """A variable as (world, axis, axis, ...)."""
    dims = setting_dims(results)
    array = results[name].transpose(*WORLD_DIMS, *dims).values
    return array.reshape(-1, *array.shape[len(WORLD_DIMS) :])


def success_share(results: xr.Dataset) -> float:
    """Share of the results, settings times worlds, with status 0 [1]."""
    return float((results.status == 0).mean())


def distinct_share(results: xr.Dataset, by: str) -> float:
    """Share of the successful results that differ from all others of their world in the score `by`, the length of the way, the
    clearance or the time, each rounded [1]; NaN where none succeeded."""
    good = _by_world(results, "status") == 0
    score = _by_world(results, by).astype(float)
    columns = [np.sign(score), np.round(np.log(np.maximum(np.abs(score), 1e-12)) / SCORE_ROUNDING)]
    columns += [
        np.round(_by_world(results, name) / step) for name, step in ROUNDING.items() if name in results and name != by
    ]
    table = np.nan_to_num(np.stack(columns, axis=-1), nan=-1e9)
    distinct = sum(len(np.unique(rows[there], axis=0)) for rows, there in zip(table, good, strict=True))
    return distinct / good.sum() if good.any() else float("nan")


def line_range(values: np.ndarray, axis: int, good: np.ndarray) -> np.ndarray:
    """Of every line along an axis with at least two good points: its range over that of the grid [1].

    Args:
        values: on the grid.
        good: which points count, of the same shape.
    """
    if good.sum() < 2:
        return np.empty(0)
    whole = np.ptp(values[good])
    lines, counts = np.moveaxis(values, axis, -1), np.moveaxis(good, axis, -1)
    used = counts.sum(axis=-1) >= 2
    low = np.min(lines, axis=-1, where=counts, initial=np.inf)[used]
    high = np.max(lines, axis=-1, where=counts, initial=-np.inf)[used]
    if whole <= NEGLIGIBLE * np.abs(values[good]).max():
        return np.zeros(len(low))
    return (high - low) / whole


def best_inside_axes(results: xr.Dataset, by: str) -> int:
    """Number of axes in which the best setting is not at an end; 0 where none succeeded."""
    best = select(results, int(ranking(results, by)[0]))
    if not bool((best.status == 0).all()):
        return 0
    return sum(
        float(results[label].min()) < float(best[label]) < float(results[label].max()) for label in axis_labels(results)
    )


def measures_of(results: xr.Dataset, by: str) -> list[str]:
    """The metrics of the analysis: those of `MEASURES` that the run has, or else all; the one for ranking first."""
    known = metric_names(results)
    names = [name for name in MEASURES if name in known]
    return list(dict.fromkeys([by, *(names if len(names) > 1 else known)]))


def knob_effects(results: xr.Dataset, metrics: Sequence[str] = MEASURES) -> KnobEffects:
    """Line ranges and Sobol indices of every knob and metric of a full grid.

    Raises:
        ValueError: the settings are a sample.
    """
    if not is_grid(results):
        raise ValueError("the settings are a sample; a full grid is needed")
    dims = setting_dims(results)
    labels = [dim for dim in dims if results.sizes[dim] > 1]
    known = metric_names(results)
    names = [name for name in metrics if name in known]
    shape = (len(labels), len(names))
    ranges, first, total = (np.full(shape, np.nan) for _ in range(3))
    good = _by_world(results, "status") == 0
    for m, name in enumerate(names):
        values = _by_world(results, name).astype(float)
        there = good & np.isfinite(values)
        indices = [sobol_indices(v, g, NEGLIGIBLE) for v, g in zip(values, there, strict=True) if g.any()]
        for k, label in enumerate(labels):
            axis = dims.index(label)
            lines = [line_range(v, axis, g) for v, g in zip(values, there, strict=True)]
            lines = np.concatenate(lines)
            ranges[k, m] = np.median(lines) if len(lines) else np.nan
            if indices:
                first[k, m] = np.mean([f[axis] for f, _ in indices])
                total[k, m] = np.mean([t[axis] for _, t in indices])
    return KnobEffects([knob_name(results, label) for label in labels], labels, names, ranges, first, total)


def effects_of(results: xr.Dataset, by: str) -> KnobEffects | None:
    """The effects of the knobs on `measures_of`; None for a sample, or where nothing can be told."""
    if not is_grid(results):
        return None
    effects = knob_effects(results, measures_of(results, by))
    return effects if np.isfinite(effects.line_range).any() else None


def analysis_rows(results: xr.Dataset, by: str, effects: KnobEffects | None) -> dict[str, Row]:
    """The rows of the section `sweep_analysis`. Those that cannot be told, for want of successful settings or of a grid, are absent.

    Args:
        by: metric for ranking the settings.
        effects: those of `effects_of`.
    """
    rows = {"success_share": success_share(results), "distinct_share": distinct_share(results, by)}
    if is_grid(results):
        rows["best_inside_axes"] = float(best_inside_axes(results, by))
    if effects:
        for prefix, numbers in effects.kinds().items():
            for (k, m), value in np.ndenumerate(numbers):
                rows[f"{prefix}_{effects.knobs[k]}_{effects.metrics[m]}"] = float(value)
    return {name: {"value": value, "unit": "1"} for name, value in rows.items() if np.isfinite(value)}
