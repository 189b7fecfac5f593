"""`run_evaluation`: all rows on the accuracy of a map."""

import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from .accuracy import Measures, measure_case
from .ceiling import exact_points_cosine
from .families import FAMILIES
from .jumps import largest_jump
from .moved import moved_box, person_passes
from .normals import NOISE, mapped, sampled
from .real import leave_one_out
from .rows import accuracy_rows, bound_rows, change_rows, normal_rows, real_rows, row
from .survey import survey
from .weights import lumped_and_exact

SEEDS_OF_CHANGE = (0, 1)


def run_evaluation(progress: bool = True) -> dict[str, dict[str, Any]]:
    """Measures everything; takes a few minutes.

    Args:
        progress: one line to standard error after each part.

    Returns:
        name -> {"value": number, "unit": text, "bar": text or None}; a value that is not available is NaN, and its
        unit says why.
    """
    begin = time.monotonic()

    def say(text: str) -> None:
        if progress:
            print(f"{time.monotonic() - begin:5.0f} s  {text}", file=sys.stderr, flush=True)

    families, bound, jumps, weights, on_map = _families(say)
    rows = accuracy_rows(families) | bound_rows(*bound)
    rows["jump"] = row(1e3 * max(jumps.values()), "mm, largest along lines, worst family", "< 0.2")
    rows["rmse_lumped"] = row(1e3 * weights["rmse_lumped"], "mm, lumped weights, clutter, within 20 cm, uncorrected")
    rows["rmse_exact"] = row(1e3 * weights["rmse_exact"], "mm, exact weights there")
    rows["cosine_lumped"] = row(weights["cosine_lumped"], "1, lumped weights there")
    rows["cosine_exact"] = row(weights["cosine_exact"], "1, exact weights there")
    rows["lumped_to_exact"] = row(1e3 * weights["apart"], "mm, RMS between the two")
    moved, noisy = ([moved_box(seed, noisy) for seed in SEEDS_OF_CHANGE] for noisy in (False, True))
    passed = [person_passes(seed) for seed in SEEDS_OF_CHANGE]
    rows |= change_rows(moved, noisy, passed)
    say("moving objects")
    rows |= normal_rows(sampled(NOISE), sampled(0.0), on_map)
    say("normals and curvatures")
    rows |= real_rows(leave_one_out())
    say("recorded frames")
    rows["seconds"] = row(time.monotonic() - begin, "s, whole evaluation, on this machine", "< 300")
    return rows


def _families(
    say: Callable[[str], None],
) -> tuple[dict[str, list[Measures]], tuple[np.ndarray, np.ndarray], dict[str, float], Measures, Measures]:
    """Accuracy of all cases, excess of the bound and the exact distances there, the largest jump of each family, weights on
    clutter, surfaces of smooth bodies."""
    families: dict[str, list[Measures]] = {}
    bounds: list[tuple[np.ndarray, np.ndarray]] = []
    jumps: dict[str, float] = {}
    weights: Measures = {}
    on_map: Measures = {}
    for name, (make, seeds) in FAMILIES.items():
        families[name] = []
        for seed in seeds:
            case = make(seed)
            seen = survey(case, seed)
            measures, asked, excess = measure_case(case, seen, seed)
            measures["cosine_exact_points"] = exact_points_cosine(case, seen, asked)
            bounds.append((excess, asked.distance))
            families[name].append(measures)
            if seed == seeds[0]:
                jumps[name] = largest_jump(case, seen.state, seed)
                if name == "clutter":
                    weights = lumped_and_exact(seen.state, asked)
                if name == "smooth":
                    on_map = mapped(case, seen)
            say(f"{name}, seed {seed}: {1e3 * measures['rmse_ours']:.1f} mm")
    excess, distance = (np.concatenate(parts) for parts in zip(*bounds, strict=True))
    return families, (excess, distance), jumps, weights, on_map
