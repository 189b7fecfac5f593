"""Errors of distance and gradient in one case, of the map and of other methods on the same images."""

from itertools import pairwise

import numpy as np

from .answers import ask
from .families import Case
from .peers import nearest_point, voxel_transform
from .queries import FAR_BANDS, Queries, far_out, held_out, settled
from .survey import Survey, map_points

QUERIES = 4096
"""Held-out query points of each case."""
NO_GRADIENT = 1e-3
"""A gradient shorter than this points nowhere [1]."""
BOUND_RANGE = 0.2
"""Over-estimation by the bound is evaluated up to this distance [m]."""
BANDS = (0.0, 0.005, 0.01, 0.025, 0.05, 0.1, 0.2, 0.3)
"""Edges of the distance bands for which errors are also given separately [m]."""

Measures = dict[str, float]


def rmse(d: np.ndarray, exact: np.ndarray) -> float:
    """Root mean square error [m]."""
    return float(np.sqrt(np.mean((d - exact) ** 2)))


def cosines(g: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """Cosines between gradients (query,); 0 where the gradient is 0."""
    length = np.linalg.norm(g, axis=1)
    return np.sum(g * exact, axis=1) / np.where(length > 0, length, 1.0)


def measure_case(case: Case, seen: Survey, seed: int) -> tuple[Measures, Queries, np.ndarray]:
    """Errors of all methods at the held-out queries of a case, in metres and cosines; the queries; the bound minus the exact
    distance there [m]."""
    asked = held_out(case, seen.frames, QUERIES, seed)
    exact, ours = asked.distance, ask(seen.state, asked.x)
    answers = {
        "ours": (ours.distance, ours.gradient),
        "plain": (ours.plain, ours.plain_gradient),
        "nearest_map": nearest_point(map_points(seen.state), asked.x),
        "nearest_raw": nearest_point(seen.raw, asked.x),
        "nearest_supported": nearest_point(seen.supported, asked.x),
        "voxels_map": voxel_transform(map_points(seen.state), asked.x),
        "voxels_raw": voxel_transform(seen.raw, asked.x),
        "voxels_supported": voxel_transform(seen.supported, asked.x),
    }
    found: Measures = {"queries": len(exact), "faults": seen.faults}
    for name, (d, g) in answers.items():
        found[f"rmse_{name}"] = rmse(d, exact)
        found[f"cosine_{name}"] = float(np.mean(cosines(g, asked.gradient)))
    clear = settled(case.world, asked)
    found["settled"] = float(np.mean(clear))
    for name in ("ours", "plain", "nearest_map"):
        found[f"settled_cosine_{name}"] = float(np.mean(cosines(answers[name][1], asked.gradient)[clear]))
    lost = (ours.distance == 0) | (np.linalg.norm(ours.gradient, axis=1) < NO_GRADIENT)
    found["lost"] = float(np.max(exact[lost], initial=0.0))
    found["no_gradient"] = float(np.mean(np.linalg.norm(ours.plain_gradient, axis=1) == 0))
    near = exact < BOUND_RANGE
    found["over"] = float(np.percentile((ours.bound - exact)[near], 99))
    found["over_uncorrected"] = float(np.percentile((ours.distance - exact)[near], 99))
    found["coverage"] = float(np.mean(ours.bound <= exact))
    found["bias"] = float(np.mean(ours.distance - exact))
    for low, high in pairwise(BANDS):
        band = (exact >= low) & (exact < high)
        name = f"{1e3 * low:g}_{1e3 * high:g}"
        found[f"band_rmse_{name}"] = rmse(ours.distance[band], exact[band])
        found[f"band_rmse_nearest_{name}"] = rmse(answers["nearest_map"][0][band], exact[band])
        found[f"band_cosine_{name}"] = float(np.mean(cosines(ours.gradient, asked.gradient)[band]))
        found[f"band_cosine_plain_{name}"] = float(np.mean(cosines(ours.plain_gradient, asked.gradient)[band]))
        found[f"band_cover_{name}"] = float(np.mean((ours.bound <= exact)[band]))
    return found | measure_far(case, seen, seed), asked, ours.bound - exact


def measure_far(case: Case, seen: Survey, seed: int) -> Measures:
    """Errors of distance and bound up to 3 m, band by band [m]; NaN in a band without queries."""
    bands = far_out(case, seen.frames, seed)
    every = Queries(*(np.concatenate(parts) for parts in zip(*bands, strict=True)))
    answers, nearest = ask(seen.state, every.x), nearest_point(map_points(seen.state), every.x)[0]
    found: Measures = {"far_queries": len(every.distance)}
    for low, high in pairwise(FAR_BANDS):
        band = (every.distance >= low) & (every.distance < high)
        name, exact = f"{1e3 * low:g}_{1e3 * high:g}", every.distance[band]
        under = exact - answers.bound[band]
        some = len(exact) > 0
        found[f"far_rmse_{name}"] = rmse(answers.distance[band], exact) if some else np.nan
        found[f"far_nearest_{name}"] = rmse(nearest[band], exact) if some else np.nan
        found[f"far_cover_{name}"] = float(np.mean(under >= 0)) if some else np.nan
        found[f"far_under_{name}"] = float(np.percentile(under, 99)) if some else np.nan
    return found
