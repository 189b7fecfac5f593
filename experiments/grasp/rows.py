"""The rows: value, unit, definition and bar of each."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta

from hrcjax.lab.case_store import Case

from .pipeline import WAYS

Rows = dict[str, dict[str, Any]]
BARS = {"lifted_share": 0.8}
"""Least value of a row."""
END = {"hessian": "", "pca": "_pca", "nearest": "_nearest"}
"""Ends of the rows' names by the way of the normals."""
DEFINITIONS = {
    "objects": "shapes times poses",
    "lifted_share": "objects lifted: the centre rose by over 10 cm, and both fingers hold it after 1 s",
    "lifted_share_low": "95 % lower limit of the same, by the binomial distribution (Clopper and Pearson)",
    "found_share": "objects with a grasp that is free and reached",
    "lifted_of_found": "lifted of those",
    "candidates": "free grasps of an object, at most 64, mean",
    "contacts": "places whose normal may be used, mean of an object",
    "normal_error": "angle between normal and the exact one at the nearest place of the surface, median over places that may be used",
    "normal_error_p95": "95th percentile of the same",
    "normal_error_same": "median at the places that both the Hessian and the plane accept",
    "normal_error_same_p95": "95th percentile of the same",
    "true_angle": "greater angle between the closing axis and the exact normals at the contacts, median over chosen grasps",
    "true_angle_p90": "90th percentile of the same",
    "pushed": "how far the approach alone moved an object, 95th percentile",
    "turned": "how far an object turned in the hand while it was lifted, 95th percentile",
    "looks_reached_share": "places of the camera in the hand that the arm reaches",
    "points": "points of an object, mean",
}


def row(value: Any, unit: str = "1") -> dict[str, Any]:
    """One row."""
    return {"value": float(value), "unit": unit}


def holds(name: str, value: float) -> bool | None:
    """Whether a row is above its bar; None: it has none."""
    return value >= BARS[name] if name in BARS else None


def definition(name: str) -> str:
    """What a row measures."""
    stem, way = name, ""
    for end, words in (
        ("_pca", "; normals by the plane through neighbours"),
        ("_nearest", "; normals by the nearest point"),
    ):
        if stem.endswith(end):
            stem, way = stem.removesuffix(end), words
    if "_friction" in stem:
        stem, _, mu = stem.partition("_friction")
        return f"{DEFINITIONS[stem]}; pads with a coefficient of friction of {int(mu) / 100}{way}"
    if stem.startswith("lifted_share_") and stem not in DEFINITIONS:
        return f"the same of one shape{way}"
    return DEFINITIONS.get(stem, "") + way


def joined(cases: Sequence[Case], name: str) -> NDArray:
    """A value of all objects."""
    return np.concatenate([np.atleast_1d(case[name]) for case in cases])


def errors(cases: Sequence[Case], way: str, same: bool = False) -> NDArray:
    """Errors of the normals that a way accepts, or at the places that both the Hessian and the plane accept [deg]."""
    found = []
    for case in cases:
        use = case["hessian_ok"] & case["pca_ok"] if same else case[f"{way}_ok"]
        found.append(np.rad2deg(case[f"{way}_error"][use]))
    return np.concatenate(found)


def lower_limit(lifted: int, count: int) -> float:
    """The share that is exceeded with a confidence of 95 % [1]."""
    return float(beta.ppf(0.05, lifted, count - lifted + 1)) if lifted else 0.0


def way_rows(cases: Sequence[Case], way: str, frictions: Sequence[float]) -> Rows:
    """Rows of one way."""
    end = END[way]
    lifted = np.stack([case[f"{way}_lifted"] for case in cases])
    taken = joined(cases, f"{way}_taken") >= 0
    off, off_same = errors(cases, way), errors(cases, way, same=True)
    rows = {f"lifted_share{end}": row(lifted[:, 0].mean())}
    rows[f"lifted_share_low{end}"] = row(lower_limit(int(lifted[:, 0].sum()), len(lifted)))
    for k, mu in enumerate(frictions[1:], 1):
        rows[f"lifted_share_friction{round(100 * mu):03d}{end}"] = row(lifted[:, k].mean())
    rows |= {
        f"found_share{end}": row(taken.mean()),
        f"lifted_of_found{end}": row(lifted[taken, 0].mean() if taken.any() else 0),
        f"candidates{end}": row(np.mean([case[f"{way}_free"].sum() for case in cases])),
        f"contacts{end}": row(np.mean([case[f"{way}_ok"].sum() for case in cases])),
    }
    for name, values in (("normal_error", off), ("normal_error_same", off_same)):
        if len(values):
            rows[f"{name}{end}"] = row(np.median(values), "deg")
            rows[f"{name}_p95{end}"] = row(np.percentile(values, 95), "deg")
    if taken.any():
        angle = np.rad2deg(joined(cases, f"{way}_true_angle")[taken])
        pushed, turned = (np.stack([case[f"{way}_{key}"] for case in cases])[taken, 0] for key in ("pushed", "turned"))
        rows |= {
            f"true_angle{end}": row(np.median(angle), "deg"),
            f"true_angle_p90{end}": row(np.percentile(angle, 90), "deg"),
            f"pushed{end}": row(1e3 * np.percentile(pushed, 95), "mm"),
            f"turned{end}": row(np.rad2deg(np.percentile(turned, 95)), "deg"),
        }
    return rows


def by_shape(cases: Mapping[str, Case], way: str, friction: int = 0) -> dict[str, float]:
    """Share lifted of every shape [1]."""
    found: dict[str, list[float]] = {}
    for name, case in cases.items():
        found.setdefault(name.split("/")[0], []).append(float(case[f"{way}_lifted"][friction]))
    return {shape: float(np.mean(values)) for shape, values in found.items()}


def all_rows(cases: Mapping[str, Case], frictions: Sequence[float]) -> Rows:
    """All rows of a run."""
    objects = list(cases.values())
    rows: Rows = {"objects": row(len(objects))}
    for way in WAYS:
        rows |= way_rows(objects, way, frictions)
    for way in WAYS:
        rows |= {f"lifted_share_{shape}{END[way]}": row(share) for shape, share in by_shape(cases, way).items()}
    rows["points"] = row(np.mean([case["mask"].sum() for case in objects]))
    if "looks_reached" in objects[0]:
        rows["looks_reached_share"] = row(joined(objects, "looks_reached").mean())
    return rows
