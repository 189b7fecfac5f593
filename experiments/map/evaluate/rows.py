"""Rows of the evaluation: names, units and targets, from the measurements."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .accuracy import BOUND_RANGE, Measures

Rows = dict[str, dict[str, Any]]

PEERS = {
    "nearest_map": "nearest point of the map",
    "nearest_supported": "nearest measured pixel, one per voxel, flying pixels filtered",
    "nearest_raw": "nearest measured pixel, one per voxel",
    "voxels_map": "distance transform of the map's voxels",
    "voxels_supported": "distance transform, flying pixels filtered",
    "voxels_raw": "distance transform of all measured voxels",
}
"""Other methods on the same images."""
FIGURES = (
    ("rmse", 1e3, "mm", "< 10, below all peers"),
    ("cosine", 1.0, "1", "> 0.99"),
    ("over", 1e3, "mm", "< 3"),
    ("coverage", 1.0, "1", "0.93 to 0.99"),
)
"""Measures of each family: name, factor, unit, target."""


def row(value: float, unit: str, bar: str | None = None) -> dict[str, Any]:
    """One row."""
    return {"value": value, "unit": unit, "bar": bar}


def _key(figure: str, method: str) -> str:
    return f"{figure}_{method}" if figure in ("rmse", "cosine") else figure


def accuracy_rows(families: Mapping[str, Sequence[Measures]]) -> Rows:
    """Distance, gradient and bound: the mean over the seeds of every family, then mean and worst over families."""
    means = {name: {k: float(np.mean([m[k] for m in cases])) for k in cases[0]} for name, cases in families.items()}
    rows: Rows = {}
    for figure, factor, unit, bar in FIGURES:
        values = {name: factor * mean[_key(figure, "ours")] for name, mean in means.items()}
        for name, value in values.items():
            rows[f"{figure}.{name}"] = row(value, unit, bar)
        worst = min(values.values()) if figure == "cosine" else max(values.values())
        rows[f"{figure}.mean"] = row(float(np.mean(list(values.values()))), unit, bar)
        if figure == "coverage":
            rows["coverage.least"] = row(min(values.values()), "1, least family", bar)
        ending = ("most", "most covered family") if figure == "coverage" else ("worst", "worst family")
        rows[f"{figure}.{ending[0]}"] = row(worst, f"{unit}, {ending[1]}", bar)
        if figure in ("rmse", "cosine"):
            method = f"{unit}, without the correction for curvature"
            rows[f"{figure}_plain.mean"] = row(factor * _mean(means, _key(figure, "plain")), method)
            for family, mean in means.items():
                rows[f"{figure}_plain.{family}"] = row(factor * mean[_key(figure, "plain")], method)
            for peer, words in PEERS.items():
                rows[f"{figure}_{peer}.mean"] = row(factor * _mean(means, _key(figure, peer)), f"{unit}, {words}")
    place = "1, more than 1 cm from surfaces and not near the medial axis"
    for name, words in (("ours", ""), ("plain", ", plain"), ("nearest_map", ", nearest point of the map")):
        rows[f"settled_cosine_{name}.mean"] = row(_mean(means, f"settled_cosine_{name}"), place + words)
    rows["cosine_exact_points.mean"] = row(
        _mean(means, "cosine_exact_points"), "1, plain gradient, if all points of the map lay on the exact surfaces"
    )
    rows["settled.mean"] = row(_mean(means, "settled"), "1, share of such queries")
    lost = 1e3 * max(mean["lost"] for mean in means.values())
    rows["lost.worst"] = row(
        lost, "mm from surfaces at most, where the distance is 0 or the gradient points nowhere", "< 5"
    )
    rows["no_gradient.mean"] = row(_mean(means, "no_gradient"), "1, share of queries where the plain gradient is 0")
    for peer in ("nearest_map", "nearest_supported", "voxels_map", "voxels_supported"):
        ratio = max(mean["rmse_ours"] / mean[f"rmse_{peer}"] for mean in means.values())
        rows[f"rmse_over_{peer}.worst"] = row(ratio, "1, ratio to that method's, worst family", "< 1")
    bands = [name.removeprefix("band_rmse_") for name in next(iter(means.values())) if name.startswith("band_rmse_")]
    for band in (name for name in bands if not name.startswith("nearest")):
        place = f"{band.replace('_', ' to ')} mm from surfaces"
        rows[f"rmse_at_{band}.mean"] = row(1e3 * _mean(means, f"band_rmse_{band}"), f"mm, {place}")
        nearest = f"mm, {place}, nearest point of the map"
        rows[f"rmse_nearest_map_at_{band}.mean"] = row(1e3 * _mean(means, f"band_rmse_nearest_{band}"), nearest)
        bar = ">= 0.95" if band == "0_5" else None
        rows[f"cosine_at_{band}.mean"] = row(_mean(means, f"band_cosine_{band}"), f"1, {place}", bar)
        rows[f"cosine_plain_at_{band}.mean"] = row(_mean(means, f"band_cosine_plain_{band}"), f"1, {place}, plain")
        rows[f"coverage_at_{band}.mean"] = row(_mean(means, f"band_cover_{band}"), f"1, {place}")
    rows |= far_rows(means)
    queries = sum(m["queries"] for cases in families.values() for m in cases)
    rows["queries"] = row(queries, "held-out queries")
    rows["incomplete_blocks"] = row(sum(m["faults"] for cases in families.values() for m in cases), "blocks", "0")
    return rows


def far_rows(means: Mapping[str, Measures]) -> Rows:
    """Distance and bound up to 3 m: means over the families, and the largest ratio to the nearest point."""
    rows: Rows = {}
    bands = [name.removeprefix("far_rmse_") for name in next(iter(means.values())) if name.startswith("far_rmse_")]
    for band in bands:
        place = f"{band.replace('_', ' to ')} mm from surfaces"
        ours, nearest = (1e3 * _mean(means, f"far_{which}_{band}") for which in ("rmse", "nearest"))
        rows[f"far_rmse_at_{band}.mean"] = row(ours, f"mm, {place}")
        rows[f"far_nearest_map_at_{band}.mean"] = row(nearest, f"mm, {place}, nearest point of the map")
        rows[f"far_ratio_at_{band}"] = row(ours / nearest, "1, ratio of the two", "< 1.5")
        rows[f"far_coverage_at_{band}.mean"] = row(_mean(means, f"far_cover_{band}"), f"1, {place}", "0.93 to 1")
        under = 1e3 * float(np.nanmax([mean[f"far_under_{band}"] for mean in means.values()]))
        rows[f"far_bound_under_at_{band}.worst"] = row(under, "mm, bound under the exact distance, 99 %", "< 50")
    return rows


def _mean(means: Mapping[str, Measures], key: str) -> float:
    """Mean over the families that have such queries."""
    return float(np.nanmean([mean[key] for mean in means.values()]))


def bound_rows(excess: np.ndarray, distance: np.ndarray) -> Rows:
    """The bound at all queries of all worlds together.

    Args:
        excess: bound minus exact distance (query,) [m].
        distance: the exact distances (query,) [m].
    """
    over = 1e3 * float(np.percentile(excess[distance < BOUND_RANGE], 99))
    return {
        "over.all": row(over, "mm, all queries together", "< 3"),
        "coverage.all": row(float(np.mean(excess <= 0)), "1, all queries together", "0.93 to 0.99"),
    }


def normal_rows(noisy: Mapping[str, Measures], clean: Mapping[str, Measures], mapped: Measures) -> Rows:
    """Normals and curvatures: the worst body of the samples, each body's curvatures, and those of a map."""
    rows: Rows = {}
    for kind, words in (("hessian", "Hessian alone"), ("normal", "Hessian and fit")):
        for figure, bar in (("median", "< 4"), ("p95", "< 12")):
            worst = max(m[f"{kind}_{figure}"] for m in noisy.values())
            rows[f"{kind}_2mm_{figure}.worst"] = row(worst, f"degrees, {words}, worst body", bar)
    for name, measures in noisy.items():
        if "curvature_p95" in measures:
            rows[f"curvature_2mm.{name}"] = row(measures["curvature_p95"], "1, 95th percentile", "< 0.1")
            rows[f"curvature_clean.{name}"] = row(clean[name]["curvature_p95"], "1, 95th percentile", "< 0.1")
    rows["surface_refused.samples"] = row(max(m["refused"] for m in noisy.values()), "1, worst body")
    for figure, unit, bar in (
        ("normal_median", "degrees, on the map of smooth bodies", "< 4"),
        ("normal_p95", "degrees, on the map of smooth bodies", "< 12"),
        ("curvature_median", "1, on the map of smooth bodies", "< 0.1"),
        ("curvature_p95", "1, on the map of smooth bodies", None),
        ("refused", "1, share refused on the map of smooth bodies", None),
    ):
        rows[f"map_{figure}"] = row(mapped[figure], unit, bar)
    return rows


def change_rows(moved: Sequence[Measures], noisy: Sequence[Measures], passed: Sequence[Measures]) -> Rows:
    """Moved object, also with errors of the poses, and passing person: the worst of the seeds."""
    rows: Rows = {}
    for name, cases, words in (("moved", moved, ""), ("noisy", noisy, ", poses with errors of 5 mm and 0.3 degrees")):
        for key, after in (("gone", "1 frame"), ("gone_2", "2 frames")):
            rows[f"{name}_{key}"] = row(
                min(m[key] for m in cases), f"1, stale points removed after {after}{words}", ">= 0.95"
            )
        rows[f"{name}_found"] = row(
            min(m["found"] for m in cases), f"1, new surface found after 1 frame{words}", ">= 0.95"
        )
        rows[f"{name}_ghosts"] = row(
            max(m["ghosts"] for m in cases), f"1, points in free space after 2 frames{words}", "< 0.01"
        )
        rows[f"{name}_eaten"] = row(
            max(m["eaten"] for m in cases), f"1, points of other surfaces lost{words}", "< 0.01"
        )
    return rows | {
        "hidden_lost": row(max(m["lost"] for m in passed), "1, occluded points lost behind a person", "< 0.001"),
    }


def real_rows(found: Measures | None) -> Rows:
    """The recorded frames."""
    if found is None:
        return {"real_median": row(float("nan"), "mm; the recording is not available", "< 25")}
    return {
        "real_median": row(1e3 * found["median"], "mm, held-out points of a frame to the map of the others", "< 25"),
        "real_median.worst": row(1e3 * found["worst"], "mm, worst frame", "< 25"),
        "real_p90": row(1e3 * found["p90"], "mm, 90th percentile"),
        "real_refused": row(found["refused"], "1, frames refused of 5: poses jump"),
    }
