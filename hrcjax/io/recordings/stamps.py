"""The unit of time stamps, inferred from their magnitude."""

import numpy as np

UNITS = {"seconds": 1.0, "milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}
"""Units of time -> their number per second."""
EPOCH = (5e8, 1e10)
"""Seconds since 1970 of the years 1985 to 2286."""
LONGEST_STEP = 10.0
"""Largest plausible median time between frames [s]."""


def stamp_unit(stamps: np.ndarray, longest: float = LONGEST_STEP) -> str:
    """The unit of stamps (n,): a key of UNITS.

    The unit of a clock that counts from 1970 follows from its magnitude. Any other clock is in the largest unit in which
    the median step is at most `longest` [s]; a single stamp is in seconds.
    """
    stamps = np.asarray(stamps, np.float64)
    steps = np.diff(np.unique(stamps))
    step = float(np.median(steps)) if len(steps) else 0.0
    fitting = [unit for unit, per_second in UNITS.items() if step / per_second <= longest] or ["nanoseconds"]
    for unit in fitting:
        if stamps.size and EPOCH[0] <= stamps.min() / UNITS[unit] and stamps.max() / UNITS[unit] < EPOCH[1]:
            return unit
    return fitting[0]
