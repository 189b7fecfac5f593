"""Where time is lost: that of a run beside that of a free run, by the way along the path, split by zone."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hrcjax.safety import ZONE_NAMES


def lost_by_zone(case: Mapping[str, NDArray], k: int, free: int, dt: float) -> tuple[NDArray, float]:
    """Time lost in every zone, (zone) [s], and the time of the free run for the same way [s].

    A tick loses its length less the time in which the free run comes as far along the path; so all losses add up to the time of the
    run less that of the free run, to where the run came. Both count until their arrivals.

    Args:
        case: way along the path, zone and time to the goal of all variants.
        k: the variant.
        free: the variant without zones.
    """
    end, end_free = (max(int(np.ceil(float(case["time_to_goal"][j]) / dt)), 1) for j in (k, free))
    way = case["travelled"][k][: end + 1].astype(float)
    way_free = case["travelled"][free][: end_free + 1].astype(float)
    rising = np.concatenate([[True], np.diff(way_free) > 0])
    until = np.interp(way, way_free[rising], dt * np.flatnonzero(rising))
    if case["success"][k] and case["success"][free]:
        until[-1] = dt * (len(way_free) - 1)  # the last way is the arrival's
    lost = dt - np.diff(until)
    zone = case["zone"][k][: len(lost)].astype(int)
    return np.array([lost[zone == z].sum() for z in range(len(ZONE_NAMES))]), float(until[-1])
