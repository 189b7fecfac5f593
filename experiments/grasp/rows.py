"""The rows: value, unit, definition and bar of each."""

from collections.abc import Mapping, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta

from hrcjax.grasp.arm_motion import CLOSE, STRAIGHT
from hrcjax.grasp.params import GraspParams
from hrcjax.lab.case_store import Case

from .pipeline import WAYS

FRICTION = float(jnp.asarray(GraspParams().friction))
"""That grasps are chosen for [1]."""
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
    "antipodal_share": "free grasps whose closing axis lies within the cones of friction (0.5) of the exact normals too, mean over objects that have any",
    "pull": "greatest force along all six axes of the hand, over the weight, that a lifted object bears without slipping by 2 cm; 0 if not lifted; median",
    "pull_p10": "10th percentile of the same",
    "settled": "how far an object turned while the fingers closed, median",
    "settled_p90": "90th percentile of the same",
    "pushed": "how far the approach alone moved an object, 95th percentile",
    "turned": "how far an object turned in the hand while it was lifted, 95th percentile",
    "looks_reached_share": "places of the camera in the hand that the arm reaches; from others it does not look",
    "aim_error": "distance of where the camera in the hand looks from where the object stands, median",
    "reached": "objects to whose chosen grasp the arm came by its policies within 5 mm and 3 degrees, touching neither object nor table on the way, of those with a grasp",
    "reach_error_mm": "distance of the tool point from the grasp at the end of the motion, median",
    "reach_error_mm_p95": "95th percentile of the same",
    "reach_error_deg": "angle of the gripper from the grasp at the end, median",
    "reach_error_deg_p95": "95th percentile of the same",
    "reach_seconds": "from home to within 5 mm and 3 degrees of the grasp, median over motions that came there",
    "reach_touched": "motions in which gripper or links touched object or table",
    "reach_clearance_mm": "least distance of the gripper from object and table in a motion, median",
    "reach_links_mm": "least distance of the links before the gripper from object and table, least of all",
    "reach_top_speed": "greatest joint speed over its limit, of all motions",
    "reach_lifted": "lifted from where the arm arrived, the hand going the arm's way, of those with a grasp",
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
    alone = "; by the stationary cameras alone" if "_fixed" in name else ""
    stem = stem.replace("_fixed", "")
    for end, words in (
        ("_pca", "; normals by the plane through neighbours"),
        ("_nearest", "; normals by the nearest point"),
    ):
        if stem.endswith(end):
            stem, way = stem.removesuffix(end), words
    way += alone
    if "_friction" in stem:
        stem, _, mu = stem.partition("_friction")
        return f"{DEFINITIONS[stem]}; pads with a coefficient of friction of {int(mu) / 100}{way}"
    if stem.startswith("lifted_share_") and stem not in DEFINITIONS:
        return f"the same of one shape{way}"
    if stem.startswith("normal_error_") and stem not in DEFINITIONS:
        return f"normal_error of one shape{way}"
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
    return np.concatenate(found) if found else np.zeros(0)


def share_within(cases: Sequence[Case], way: str, friction: float = FRICTION) -> float:
    """Mean share of the free grasps that hold by the exact normals too, over objects that have any [1]."""
    edge = np.arctan(friction)
    shares = [np.mean(case[f"{way}_true_angles"][case[f"{way}_free"]] <= edge) for case in cases if case[f"{way}_free"].any()]  # fmt: skip
    return float(np.mean(shares)) if shares else 0.0


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
    pulls = joined(cases, f"{way}_pull")
    rows |= {
        f"antipodal_share{end}": row(share_within(cases, way)),
        f"pull{end}": row(np.median(pulls)),
        f"pull_p10{end}": row(np.percentile(pulls, 10)),
    }
    for name, values in (("normal_error", off), ("normal_error_same", off_same)):
        if len(values):
            rows[f"{name}{end}"] = row(np.median(values), "deg")
            rows[f"{name}_p95{end}"] = row(np.percentile(values, 95), "deg")
    if taken.any():
        angle = np.rad2deg(joined(cases, f"{way}_true_angle")[taken])
        pushed, settled, turned = (np.stack([case[f"{way}_{key}"] for case in cases])[taken, 0] for key in ("pushed", "settled", "turned"))  # fmt: skip
        rows |= {
            f"true_angle{end}": row(np.median(angle), "deg"),
            f"true_angle_p90{end}": row(np.percentile(angle, 90), "deg"),
            f"settled{end}": row(np.rad2deg(np.median(settled)), "deg"),
            f"settled_p90{end}": row(np.rad2deg(np.percentile(settled, 90)), "deg"),
            f"pushed{end}": row(1e3 * np.percentile(pushed, 95), "mm"),
            f"turned{end}": row(np.rad2deg(np.percentile(turned, 95)), "deg"),
        }
    return rows


def fixed_rows(cases: Sequence[Case], way: str) -> Rows:
    """Rows of one way by the stationary cameras alone."""
    end, alone = f"_fixed{END[way]}", f"{way}_fixed"
    lifted, taken = (np.stack([np.atleast_1d(case[f"{alone}_{key}"])[0] for case in cases]) for key in ("lifted", "taken"))  # fmt: skip
    found = taken >= 0
    rows = {
        f"lifted_share{end}": row(lifted.mean()),
        f"found_share{end}": row(found.mean()),
        f"lifted_of_found{end}": row(lifted[found].mean() if found.any() else 0),
        f"antipodal_share{end}": row(share_within(cases, alone)),
    }
    off = errors(cases, alone)
    if len(off):
        rows[f"normal_error{end}"] = row(np.median(off), "deg")
        rows[f"normal_error_p95{end}"] = row(np.percentile(off, 95), "deg")
    return rows


def came(case: Case) -> bool:
    """Whether the arm came to the grasp, and touched nothing before."""
    close = case["moved_off"] <= CLOSE and case["moved_twist"] <= STRAIGHT
    return bool(close and min(case["moved_free"], case["moved_links"]) > 0)


def moved_rows(cases: Sequence[Case]) -> Rows:
    """Rows of the arm's motion to the grasps by Hessian normals."""
    some = [case for case in cases if "moved_off" in case]
    if not some:
        return {}
    off, twist, free, links, top, lifted, seconds = (joined(some, f"moved_{key}") for key in ("off", "twist", "free", "links", "top_speed", "lifted", "seconds"))  # fmt: skip
    rows = {
        "reached": row(np.mean([came(case) for case in some])),
        "reach_error_mm": row(1e3 * np.median(off), "mm"),
        "reach_error_mm_p95": row(1e3 * np.percentile(off, 95), "mm"),
        "reach_error_deg": row(np.rad2deg(np.median(twist)), "deg"),
        "reach_error_deg_p95": row(np.rad2deg(np.percentile(twist, 95)), "deg"),
        "reach_touched": row(np.sum(np.minimum(free, links) <= 0)),
        "reach_clearance_mm": row(1e3 * np.median(free), "mm"),
        "reach_links_mm": row(1e3 * links.min(), "mm"),
        "reach_top_speed": row(top.max()),
        "reach_lifted": row(lifted.mean()),
    }
    if np.isfinite(seconds).any():
        rows["reach_seconds"] = row(np.nanmedian(seconds), "s")
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
    rows |= moved_rows(objects)
    if "hessian_fixed_ok" in objects[0]:
        for way in WAYS:
            rows |= fixed_rows(objects, way)
    for way in WAYS:
        rows |= {f"lifted_share_{shape}{END[way]}": row(share) for shape, share in by_shape(cases, way).items()}
    for way in ("hessian", "pca"):
        for shape in dict.fromkeys(name.split("/")[0] for name in cases):
            off = errors([case for name, case in cases.items() if name.startswith(f"{shape}/")], way)
            if len(off):
                rows[f"normal_error_{shape}{END[way]}"] = row(np.median(off), "deg")
    rows["points"] = row(np.mean([case["mask"].sum() for case in objects]))
    if "looks_reached" in objects[0]:
        rows["looks_reached_share"] = row(joined(objects, "looks_reached").mean())
        rows["aim_error"] = row(1e3 * np.median([np.linalg.norm(case["aim"] - case["place"]) for case in objects]), "mm")  # fmt: skip
    return rows
